#include "parts.hpp"

#include <algorithm>

#include "exemplar/base/text.hpp"

namespace exemplar::figures {
namespace {

// Breaks at spaces where a line would pass `width` px.
std::vector<std::string> Wrapped(const std::string& text, double width) {
  std::vector<std::string> lines(1);
  for (const std::string_view word : Split(text, ' ')) {
    std::string& line = lines.back();
    if (!line.empty() && TextWidth(line + " " + std::string(word), 14) > width) {
      lines.emplace_back(word);
    } else {
      line += (line.empty() ? "" : " ") + std::string(word);
    }
  }
  return lines;
}

}  // namespace

std::string Heading(int number, const std::string& title) {
  return "Fig. " + std::to_string(number) + "  " + title;
}

Figure CannotDraw(int number, const std::string& title, const std::string& why) {
  Svg svg;
  svg.Text({24, 32}, Heading(number, title), Anchor::kStart, 18);
  double y = 70;
  for (const std::string& line : Wrapped("Not drawn for this skill: " + why + ".", 940)) {
    svg.Text({24, y}, line, Anchor::kStart, 14);
    y += 22;
  }
  return {.number = number,
          .title = title,
          .svg = svg.Document(1000, y + 10, Heading(number, title)),
          .caption = "Not drawn for this skill: " + why + ".",
          .drawn = false};
}

std::vector<std::size_t> ShownTrials(const learning::Alignment& alignment, std::size_t most) {
  std::vector<std::size_t> shown;
  for (std::size_t j = 0; j < std::min(most, alignment.trials.size()); ++j) shown.push_back(j);
  return shown;
}

std::string TrialName(const Subject& subject, std::size_t trial, double width) {
  const learning::AlignedTrial& aligned = subject.alignment.trials[trial];
  std::string name = aligned.id;
  for (const learning::SkillReport::TrialPart& part : subject.report.trials) {
    if (part.id == aligned.id && !part.source.empty()) name = part.source;
  }
  name = name.substr(name.find_last_of('/') + 1);
  const auto most = static_cast<std::size_t>(std::max(8.0, width / TextWidth("m", 14)));
  if (name.size() > most) name = name.substr(0, most - 3) + "...";
  return name;
}

std::vector<double> CommonParts(const learning::Alignment& alignment) {
  std::vector<double> parts;
  for (const double time_s : alignment.time_s) {
    parts.push_back(time_s / alignment.time_s.back());
  }
  return parts;
}

Eigen::Vector3d RowOf(const Eigen::MatrixXd& path, int row) { return path.row(row).transpose(); }

Eigen::MatrixXd PositionsOf(const std::vector<geometry::Pose>& poses) {
  Eigen::MatrixXd positions(static_cast<Eigen::Index>(poses.size()), 3);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    positions.row(static_cast<Eigen::Index>(i)) = poses[i].translation.transpose();
  }
  return positions;
}

}  // namespace exemplar::figures
