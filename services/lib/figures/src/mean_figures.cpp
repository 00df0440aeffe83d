// Figs. 4, 8 and 9: what plain means lose and aligned ones keep.

#include <algorithm>
#include <array>

#include "exemplar/base/text.hpp"
#include "parts.hpp"

namespace exemplar::figures {
namespace {

double Extent(const Eigen::Ref<const Eigen::VectorXd>& v) { return v.maxCoeff() - v.minCoeff(); }

// One channel of all trials on a common grid; columns are trials.
struct Channel {
  std::string name;
  std::string unit;
  Eigen::MatrixXd values;
};

std::vector<Channel> ChannelsOf(const std::vector<learning::UniformTrial>& trials) {
  const learning::UniformTrial& first = trials.front();
  const auto frames = static_cast<Eigen::Index>(first.time_s.size());
  const auto n = static_cast<Eigen::Index>(trials.size());
  std::vector<Channel> channels;
  for (std::size_t k = 0; k < first.joint_names.size(); ++k) {
    Channel channel{"joint " + first.joint_names[k], "rad", Eigen::MatrixXd(frames, n)};
    for (Eigen::Index j = 0; j < n; ++j) {
      channel.values.col(j) =
          trials[static_cast<std::size_t>(j)].joints.col(static_cast<Eigen::Index>(k));
    }
    channels.push_back(std::move(channel));
  }
  if (!channels.empty() || first.base_T_tool.empty()) return channels;
  for (int axis = 0; axis < 3; ++axis) {
    Channel channel{std::string("end effector ") + "xyz"[axis], "m", Eigen::MatrixXd(frames, n)};
    for (Eigen::Index j = 0; j < n; ++j) {
      channel.values.col(j) =
          PositionsOf(trials[static_cast<std::size_t>(j)].base_T_tool).col(axis);
    }
    channels.push_back(std::move(channel));
  }
  return channels;
}

}  // namespace

Figure PlainMean(const Subject& subject) {
  constexpr const char* kTitle = "A plain mean loses the trials' extremes";
  const std::vector<std::size_t> shown = ShownTrials(subject.alignment, 3);
  if (shown.size() < 2) return CannotDraw(4, kTitle, "a mean needs two trials, the skill has one");
  std::vector<learning::UniformTrial> trials = learning::LengthNormalised(subject.alignment);
  trials.resize(shown.size());
  // The channel whose mean falls shortest of the trials.
  const std::vector<Channel> channels = ChannelsOf(trials);
  const auto loss = [](const Channel& channel) {
    double extent = 0;
    for (Eigen::Index j = 0; j < channel.values.cols(); ++j) {
      extent += Extent(channel.values.col(j)) / static_cast<double>(channel.values.cols());
    }
    return extent - Extent(channel.values.rowwise().mean());
  };
  const Channel& channel =
      *std::max_element(channels.begin(), channels.end(),
                        [&](const Channel& a, const Channel& b) { return loss(a) < loss(b); });

  Page page(Heading(4, kTitle));
  Panel& panel = page.Add<Panel>(page.Row(1, Page::kTop, 400)[0],
                                 PanelText{.title = channel.name,
                                           .x = "time, part of the trial's duration",
                                           .y = channel.name + " in " + channel.unit});
  panel.TightX();
  const std::vector<double> time = CommonParts(subject.alignment);
  for (std::size_t k = 0; k < shown.size(); ++k) {
    panel.Line(time, channel.values.col(static_cast<Eigen::Index>(k)),
               {.colour = TrialColour(k), .width = 1.5, .opacity = 0.85},
               TrialName(subject, shown[k], 220));
  }
  const Eigen::VectorXd mean = channel.values.rowwise().mean();
  panel.Line(time, mean, {.colour = kInk, .width = 3}, "plain mean");
  return {.number = 4,
          .title = kTitle,
          .svg = page.ToSvg(),
          .caption = "Trials normalised in length only, and their mean, in " + channel.name +
                     " (where the mean loses most). Events fall at different times, so the mean "
                     "spans " +
                     FormatFixed(Extent(mean), 3) + " " + channel.unit + " where the trials span " +
                     FormatFixed(Extent(mean) + loss(channel), 3) + " " + channel.unit +
                     " on average."};
}

Figure AlignedMsv(const Subject& subject) {
  constexpr const char* kTitle = "Motion after alignment, and after normalising length only";
  const learning::Alignment& alignment = subject.alignment;
  if (alignment.trials.size() < 2) {
    return CannotDraw(8, kTitle, "a mean needs two trials, the skill has one");
  }
  const bool tool = !alignment.trials[0].own.base_T_tool.empty();
  const std::vector<Eigen::VectorXd> own = learning::ToolMsv(alignment);
  const std::array<Eigen::MatrixXd, 2> series = {learning::WarpSeries(alignment, own, true),
                                                 learning::WarpSeries(alignment, own, false)};
  Page page(Heading(8, kTitle));
  const std::vector<Rect> boxes = page.Row(2, Page::kTop, 360);
  const double most = std::max(series[0].maxCoeff(), series[1].maxCoeff());
  for (std::size_t side = 0; side < 2; ++side) {
    const double correlation = side == 0 ? alignment.mean_correlation : alignment.plain_correlation;
    Panel& panel = page.Add<Panel>(
        boxes[side],
        PanelText{.title = std::string(side == 0 ? "aligned by markers" : "length only") +
                           ": mean correlation " + FormatFixed(correlation, 2),
                  .x = "common time in s",
                  .y = tool ? "end effector's MSV in m²/s²" : "MSV in rad²/s²"});
    panel.TightX();
    panel.ReachY(0);
    panel.ReachY(most);
    for (Eigen::Index j = 0; j < series[side].cols(); ++j) {
      panel.Line(alignment.time_s, series[side].col(j), {.colour = kPale, .width = 1.1}, "trials");
    }
    panel.Line(alignment.time_s, series[side].rowwise().mean(),
               {.colour = side == 0 ? kBlue : kVermilion, .width = 2.6},
               side == 0 ? "mean of aligned trials" : "mean of length-normalised trials");
    for (std::size_t k = 1; side == 0 && k + 1 < alignment.markers_s.size(); ++k) {
      panel.Vertical(alignment.markers_s[k], {.colour = kGreen, .width = 1.2, .dash = "4 3"},
                     "mean marker times");
    }
  }
  const double peak = series[0].colwise().maxCoeff().mean();
  const auto part = [&](const Eigen::MatrixXd& trials) {
    return FormatFixed(100 * trials.rowwise().mean().maxCoeff() / std::max(peak, 1e-12), 0) + " %";
  };
  return {.number = 8,
          .title = kTitle,
          .svg = page.ToSvg(),
          .caption = "Mean squared velocity of all trials with their mean. The mean's peak is " +
                     part(series[0]) + " of the trials' mean peak after alignment, and " +
                     part(series[1]) + " of it where only the length was normalised."};
}

Figure AlignedPaths(const Subject& subject) {
  constexpr const char* kTitle = "The end effector's mean path";
  const learning::Alignment& alignment = subject.alignment;
  if (alignment.trials[0].own.base_T_tool.empty()) {
    return CannotDraw(9, kTitle, subject.inspection.obstacle);
  }
  const std::vector<learning::UniformTrial> plain = learning::LengthNormalised(alignment);
  Eigen::MatrixXd plain_mean = Eigen::MatrixXd::Zero(alignment.canonical_tool.rows(), 3);
  for (const learning::UniformTrial& trial : plain) {
    plain_mean += PositionsOf(trial.base_T_tool) / static_cast<double>(plain.size());
  }
  std::vector<Eigen::MatrixXd> paths;
  for (std::size_t i = 0; i < alignment.trials.size(); ++i) {
    paths.push_back(PositionsOf(learning::Warped(alignment, i).base_T_tool));
  }
  Page page(Heading(9, kTitle));
  double top = Page::kTop;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, "xyz"[axis]);
    const Rect box = page.Row(1, top, 170)[0];
    top = box.bottom() + 72;
    Panel& panel = page.Add<Panel>(
        box, PanelText{.title = name, .x = "common time in s", .y = name + " in m"});
    panel.TightX();
    for (const Eigen::MatrixXd& path : paths) {
      panel.Line(alignment.time_s, path.col(axis), {.colour = kPale, .width = 1.1},
                 "trials, aligned");
    }
    panel.Line(alignment.time_s, plain_mean.col(axis),
               {.colour = kVermilion, .width = 2.2, .dash = "7 3"}, "plain mean (length only)");
    panel.Line(alignment.time_s, alignment.canonical_tool.col(axis),
               {.colour = kBlue, .width = 2.6}, "aligned mean (canonical motion)");
  }
  return {.number = 9,
          .title = kTitle,
          .svg = page.ToSvg(),
          .caption =
              "Position of the end effector in the robot's base frame. The plain mean blurs "
              "what happens at different times in different trials; the aligned mean keeps "
              "it."};
}

}  // namespace exemplar::figures
