#pragma once
// The paper's Figs. 4 to 14 for any skill (PAPER.md section 7). Pure functions: values in, SVG out.

#include <span>
#include <string>
#include <vector>

#include "exemplar/learning/inspection.hpp"

namespace exemplar::figures {

/// One figure. Where it cannot be drawn for this skill, the picture and the caption say why.
struct Figure {
  int number = 0;  ///< the paper's
  std::string title;
  std::string svg;
  std::string caption;  ///< what one sees, and by which method
  bool drawn = true;
};

/// What the figures are drawn from. References: the values must outlive it.
struct Subject {
  const learning::SkillReport& report;
  const learning::Alignment& alignment;
  const learning::Inspection& inspection;
};

Figure PlainMean(const Subject& subject);            ///< Fig. 4
Figure CandidateMarkers(const Subject& subject);     ///< Fig. 5
Figure TimeWarps(const Subject& subject);            ///< Fig. 6
Figure ChosenMarkers(const Subject& subject);        ///< Fig. 7
Figure AlignedMsv(const Subject& subject);           ///< Fig. 8
Figure AlignedPaths(const Subject& subject);         ///< Fig. 9
Figure ContactErrors(const Subject& subject);        ///< Fig. 10
Figure TwoFrames(const Subject& subject);            ///< Fig. 11
Figure ObjectivityOverTime(const Subject& subject);  ///< Fig. 12
Figure TwoSolutions(const Subject& subject);         ///< Fig. 13
Figure BlendedSolution(const Subject& subject);      ///< Fig. 14

/// All of them, in order.
std::vector<Figure> DrawFigures(const Subject& subject);

/// "figure-04.svg".
std::string FileName(const Figure& figure);
/// One page that shows the figures, by their file names, with captions.
std::string IndexHtml(const learning::SkillReport& report, std::span<const Figure> figures);

}  // namespace exemplar::figures
