#include "exemplar/figures/figures.hpp"

#include "exemplar/base/text.hpp"
#include "exemplar/base/xml.hpp"
#include "exemplar/figures/svg.hpp"

namespace exemplar::figures {

std::vector<Figure> DrawFigures(const Subject& subject) {
  std::vector<Figure> figures;
  for (const auto draw :
       {PlainMean, CandidateMarkers, TimeWarps, ChosenMarkers, AlignedMsv, AlignedPaths,
        ContactErrors, TwoFrames, ObjectivityOverTime, TwoSolutions, BlendedSolution}) {
    figures.push_back(draw(subject));
  }
  return figures;
}

std::string FileName(const Figure& figure) {
  const std::string number = std::to_string(figure.number);
  return "figure-" + std::string(number.size() < 2 ? "0" : "") + number + ".svg";
}

std::string IndexHtml(const learning::SkillReport& report, std::span<const Figure> figures) {
  const std::string name = EscapeXml(report.skill) + ", version " + std::to_string(report.version);
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<title>Exemplar: " +
      name +
      "</title>\n<style>\nbody { max-width: 1000px; margin: 2em auto; padding: 0 1em; "
      "font-family: sans-serif; color: #222222; }\nfigure { margin: 0 0 3em 0; }\n"
      "img { width: 100%; height: auto; }\nfigcaption { line-height: 1.4; }\n</style>\n</head>\n"
      "<body>\n<h1>Exemplar: " +
      name + "</h1>\n<p>" + std::to_string(report.trials.size()) +
      (report.trials.size() == 1 ? " trial" : " trials") + ", method " + EscapeXml(report.method) +
      (report.target.empty() ? std::string() : ", target " + EscapeXml(report.target)) + ", " +
      FormatFixed(report.duration_s, 1) +
      " s. Figures are numbered as in the paper whose method this is.</p>\n";
  for (const Figure& figure : figures) {
    const std::string number = std::to_string(figure.number);
    html += "<figure id=\"figure-" + number + "\">\n<img src=\"" + FileName(figure) + "\" alt=\"" +
            EscapeXml(figure.title) + "\"/>\n<figcaption><b>Fig. " + number + ".</b> " +
            EscapeXml(figure.caption) + "</figcaption>\n</figure>\n";
  }
  return html + "</body>\n</html>\n";
}

}  // namespace exemplar::figures
