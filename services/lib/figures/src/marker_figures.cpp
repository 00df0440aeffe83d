// Figs. 5 to 7: boundaries of episodes, and the warps through them.

#include <algorithm>

#include "exemplar/base/text.hpp"
#include "exemplar/learning/hermite.hpp"
#include "parts.hpp"

namespace exemplar::figures {
namespace {

// Eq. 1 has one unit for joints, another for the tool.
std::string MsvLabel(const learning::AlignedTrial& trial) {
  return trial.own.joint_names.empty() ? "MSV in m²/s²" : "MSV in rad²/s²";
}

std::vector<Point> MarkerPoints(const learning::AlignedTrial& trial, learning::MarkerKind kind) {
  std::vector<Point> points;
  for (const learning::Marker& marker : trial.segmentation.markers) {
    if (marker.kind != kind) continue;
    points.push_back({marker.time_s, trial.segmentation.msv[marker.frame]});
  }
  return points;
}

}  // namespace

Figure CandidateMarkers(const Subject& subject) {
  constexpr const char* kTitle = "Candidate episode boundaries of three trials";
  const learning::Alignment& alignment = subject.alignment;
  const bool touch = std::any_of(alignment.trials.begin(), alignment.trials.end(),
                                 [](const auto& trial) { return trial.own.touch_n.size() > 0; });
  Page page(Heading(5, kTitle));
  const std::vector<std::size_t> shown = ShownTrials(alignment, 3);
  const std::vector<Rect> above = page.Row(static_cast<int>(shown.size()), Page::kTop, 260);
  const std::vector<Rect> below =
      page.Row(static_cast<int>(shown.size()), above[0].bottom() + 84, 130);
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const learning::AlignedTrial& trial = alignment.trials[shown[k]];
    const learning::Segmentation& segmentation = trial.segmentation;
    Panel& panel =
        page.Add<Panel>(above[k], PanelText{.title = TrialName(subject, shown[k], above[k].width),
                                            .x = "time in s",
                                            .y = MsvLabel(trial)});
    panel.TightX();
    panel.Line(trial.own.time_s, segmentation.msv, {.colour = kInk, .width = 1.4}, "MSV");
    const Stroke low{.colour = kBlue, .width = 1.4, .dash = "6 3"};
    const Stroke high{.colour = kPurple, .width = 1.4, .dash = "2 3"};
    if (segmentation.c_along.size() > 0) {
      panel.Line(trial.own.time_s, segmentation.c_along, low, "c, low motion there (Eq. 3)");
      panel.Line(trial.own.time_s, segmentation.high_along, high, "kc, high motion there (Eq. 4)");
    } else {
      panel.Horizontal(segmentation.c, low, "c, low motion (Eq. 3)");
      panel.Horizontal(segmentation.k * segmentation.c, high, "kc, high motion (Eq. 4)");
    }
    panel.Marks(MarkerPoints(trial, learning::MarkerKind::kBeginning), Symbol::kTriangle, 11,
                kGreen, "beginning");
    panel.Marks(MarkerPoints(trial, learning::MarkerKind::kEnding), Symbol::kSquare, 9, kVermilion,
                "ending");
    if (trial.own.touch_n.size() == 0) continue;
    Panel& force =
        page.Add<Panel>(below[k], PanelText{.title = "touch", .x = "time in s", .y = "force in N"});
    force.TightX();
    force.Line(trial.own.time_s, trial.own.touch_n, {.colour = kInk, .width = 1.4});
    for (const Point& beginning : MarkerPoints(trial, learning::MarkerKind::kBeginning)) {
      force.Vertical(beginning.x, {.colour = kGreen, .width = 1, .dash = "4 3"});
    }
    for (const Point& ending : MarkerPoints(trial, learning::MarkerKind::kEnding)) {
      force.Vertical(ending.x, {.colour = kVermilion, .width = 1, .dash = "4 3"});
    }
  }
  std::string caption =
      "Mean squared velocity (MSV, Eqs. 1 and 2) over each trial's own time, with its own "
      "thresholds c and kc. An episode begins where MSV rises through c and goes on to kc, and "
      "ends "
      "where the same holds backwards in time.";
  caption += touch
                 ? " Below, the touch sensors: touch can bound an episode without a stop in motion."
                 : " These trials measured no touch.";
  return {.number = 5, .title = kTitle, .svg = page.ToSvg(), .caption = caption};
}

Figure TimeWarps(const Subject& subject) {
  constexpr const char* kTitle = "Warps of time through the chosen markers";
  const learning::Alignment& alignment = subject.alignment;
  // The two trials that the markers bend most.
  std::vector<std::pair<double, std::size_t>> bends;
  for (std::size_t j = 0; j < alignment.trials.size(); ++j) {
    const std::vector<double>& own = alignment.trials[j].own_knots_s;
    double bend = 0;
    for (std::size_t k = 0; k < own.size(); ++k) {
      bend = std::max(
          bend, std::abs(own[k] / own.back() - alignment.knots_s[k] / alignment.knots_s.back()));
    }
    bends.emplace_back(-bend, j);
  }
  std::sort(bends.begin(), bends.end());
  bends.resize(std::min<std::size_t>(2, bends.size()));

  Page page(Heading(6, kTitle));
  Panel& panel = page.Add<Panel>(
      Rect{250, Page::kTop, 500, 500},
      PanelText{
          .title = "", .x = "own time, part of the trial", .y = "warped time, part of the motion"});
  panel.TightX();
  panel.ReachX(0);
  panel.ReachX(1);
  panel.EqualScale();
  panel.Line({0, 1}, Eigen::Vector2d(0, 1), {.colour = kInk, .width = 1, .dash = "6 4"}, "no warp");
  const std::vector<double> common = CommonParts(alignment);
  for (std::size_t i = 0; i < bends.size(); ++i) {
    const learning::AlignedTrial& trial = alignment.trials[bends[i].second];
    const learning::MonotoneHermite own_at(alignment.knots_s, trial.own_knots_s);
    std::vector<double> own;
    for (const double time_s : alignment.time_s) {
      own.push_back(own_at(time_s) / trial.own_knots_s.back());
    }
    const Eigen::Map<const Eigen::VectorXd> warped(common.data(),
                                                   static_cast<Eigen::Index>(common.size()));
    const std::string colour = TrialColour(i);
    panel.Line(own, warped, {.colour = colour, .width = 2},
               TrialName(subject, bends[i].second, 400));
    const learning::MonotoneHermite common_at(trial.own_knots_s, alignment.knots_s);
    std::vector<Point> chosen;
    for (const int m : trial.chosen) {
      const double time_s = trial.segmentation.markers[static_cast<std::size_t>(m)].time_s;
      chosen.push_back(
          {time_s / trial.own_knots_s.back(), common_at(time_s) / alignment.knots_s.back()});
    }
    panel.Marks(chosen, Symbol::kRing, 9, colour, i == 0 ? "chosen marker" : "");
  }
  return {.number = 6,
          .title = kTitle,
          .svg = page.ToSvg(),
          .caption =
              "Monotone cubic Hermite splines (Fritsch and Carlson) that bring each trial's "
              "chosen markers to their mean times, for the trials that are bent most. "
              "Steeper is faster local time; the dashed line is a trial that needs no warp."};
}

Figure ChosenMarkers(const Subject& subject) {
  constexpr const char* kTitle = "Which candidates are the true markers";
  const learning::Alignment& alignment = subject.alignment;
  Page page(Heading(7, kTitle));
  double top = Page::kTop;
  const bool vote = subject.report.options.contains("selection") &&
                    subject.report.options.at("selection") == "vote";
  for (const std::size_t j : ShownTrials(alignment, 3)) {
    const learning::AlignedTrial& trial = alignment.trials[j];
    const Rect box = page.Row(1, top, 150)[0];
    top = box.bottom() + 84;
    Panel& panel = page.Add<Panel>(
        box,
        PanelText{.title = TrialName(subject, j, 600), .x = "time in s", .y = MsvLabel(trial)});
    panel.TightX();
    panel.Line(trial.own.time_s, trial.segmentation.msv, {.colour = kInk, .width = 1.4}, "MSV");
    std::vector<Point> chosen, others;
    for (std::size_t m = 0; m < trial.segmentation.markers.size(); ++m) {
      const learning::Marker& marker = trial.segmentation.markers[m];
      if (marker.kind != learning::MarkerKind::kBeginning) continue;
      const bool is_chosen = std::find(trial.chosen.begin(), trial.chosen.end(),
                                       static_cast<int>(m)) != trial.chosen.end();
      (is_chosen ? chosen : others)
          .push_back({marker.time_s, trial.segmentation.msv[marker.frame]});
    }
    for (const Point& point : chosen) {
      panel.Vertical(point.x, {.colour = kVermilion, .width = 1.2, .dash = "5 3"});
    }
    panel.Marks(others, Symbol::kRing, 9, kBlue, "candidate, not chosen");
    panel.Marks(chosen, Symbol::kTriangle, 12, kVermilion, "chosen marker");
  }
  return {.number = 7,
          .title = kTitle,
          .svg = page.ToSvg(),
          .caption = std::string("All beginnings found in each trial, and those that were chosen, "
                                 "as many in every trial: ") +
                     (vote ? "by the paper's vote, the subset with the highest sum of correlations "
                             "with all subsets of the other trials."
                           : "by the best joint choice, the subsets whose warped trials correlate "
                             "most with each other.")};
}

}  // namespace exemplar::figures
