#include <algorithm>
#include <cmath>

#include "elastic.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/learning/aligned.hpp"
#include "exemplar/learning/hermite.hpp"
#include "exemplar/learning/marker_choice.hpp"
#include "exemplar/learning/warp.hpp"
#include "exemplar/signal/resample.hpp"

namespace exemplar::learning {
namespace {

// Beginnings as the choice takes them: inside the trial, and no nearer to each other than a warp
// can bear.
struct Candidates {
  MarkerCandidates choice;
  std::vector<int> marker;  // index within Segmentation::markers, one a candidate
};

int Rank(const Marker& marker) {
  if (marker.cause == "touch onset") return 2;
  if (marker.cause == "touch release") return 1;
  return 0;
}

// Means of so many neighbours that the signal is not much finer than the grid of the correlation.
Eigen::VectorXd Condensed(const Eigen::VectorXd& signal) {
  const Eigen::Index fold =
      std::max<Eigen::Index>(1, signal.size() / (2 * MarkerChoiceOptions().points));
  if (fold == 1) return signal;
  const Eigen::Index count = signal.size() / fold;
  Eigen::VectorXd means(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index first = k * signal.size() / count;
    const Eigen::Index behind = (k + 1) * signal.size() / count;
    means[k] = signal.segment(first, behind - first).mean();
  }
  return means;
}

// Who stays when there are too many candidates: touch was measured, motion only exceeds a level.
double ScoreOf(const Marker& marker) {
  constexpr double kTouchFirst = 1000;
  return marker.score + kTouchFirst * Rank(marker);
}

Candidates CandidatesOf(const UniformTrial& trial, const Segmentation& segmentation) {
  constexpr double kNear_s = 0.1;
  constexpr double kNearPart = 0.02;  // of the trial
  constexpr double kEdgeFrames = 2;
  Candidates result;
  result.choice.id = trial.id;
  result.choice.duration_s = trial.time_s.back();
  result.choice.signal = Condensed(segmentation.msv);
  const double step_s = trial.time_s[1];
  const double duration_s = trial.time_s.back();
  const double near_s = std::max(3 * step_s, std::min(kNear_s, kNearPart * duration_s));
  const double edge_s = std::min(kEdgeFrames * step_s, duration_s / 8);
  for (std::size_t m = 0; m < segmentation.markers.size(); ++m) {
    const Marker& marker = segmentation.markers[m];
    if (marker.kind != MarkerKind::kBeginning) continue;
    const double time_s = std::clamp(marker.time_s, edge_s, duration_s - edge_s);
    if (!result.marker.empty() && time_s - result.choice.time_s.back() < near_s) {
      const Marker& before = segmentation.markers[static_cast<std::size_t>(result.marker.back())];
      if (ScoreOf(marker) > ScoreOf(before)) {
        result.choice.time_s.back() = time_s;
        result.choice.score.back() = ScoreOf(marker);
        result.marker.back() = static_cast<int>(m);
      }
      continue;
    }
    result.choice.time_s.push_back(time_s);
    result.choice.score.push_back(ScoreOf(marker));
    result.marker.push_back(static_cast<int>(m));
  }
  return result;
}

std::vector<double> KnotsOf(const Candidates& candidates, const std::vector<int>& chosen) {
  std::vector<double> knots = {0};
  for (const int c : chosen) {
    knots.push_back(candidates.choice.time_s[static_cast<std::size_t>(c)]);
  }
  knots.push_back(candidates.choice.duration_s);
  return knots;
}

// Mean of Pearson's r over all pairs of columns.
double MeanCorrelation(Eigen::MatrixXd columns) {
  const Eigen::Index n = columns.cols();
  if (n < 2) return 1;
  columns.rowwise() -= columns.colwise().mean();
  double ones = 0;
  for (Eigen::Index c = 0; c < n; ++c) {
    const double norm = columns.col(c).norm();
    if (norm > 0) {
      columns.col(c) /= norm;
      ones += 1;
    }
  }
  return (columns.rowwise().sum().squaredNorm() - ones) / static_cast<double>(n * (n - 1));
}

Eigen::MatrixXd WarpedSignals(const std::vector<AlignedTrial>& trials,
                              const std::vector<std::vector<double>>& own_knots,
                              const std::vector<double>& common_knots,
                              const std::vector<double>& common_s) {
  Eigen::MatrixXd signals(static_cast<Eigen::Index>(common_s.size()),
                          static_cast<Eigen::Index>(trials.size()));
  for (std::size_t i = 0; i < trials.size(); ++i) {
    UniformTrial signal;
    signal.time_s = trials[i].own.time_s;
    signal.joints = trials[i].segmentation.msv;
    signals.col(static_cast<Eigen::Index>(i)) =
        WarpTrial(signal, own_knots[i], common_knots, common_s).joints.col(0);
  }
  return signals;
}

// One common course of time for the joints' curves, without joints the tool's, as knots: parts of
// the own duration, a row a trial.
std::vector<std::vector<double>> ElasticKnots(const std::vector<AlignedTrial>& trials) {
  std::vector<Eigen::MatrixXd> curves;
  for (const AlignedTrial& trial : trials) {
    const UniformTrial& own = trial.own;
    if (own.joints.cols() > 0) {
      curves.push_back(own.joints);
      continue;
    }
    curves.emplace_back(static_cast<Eigen::Index>(own.base_T_tool.size()), 3);
    for (std::size_t k = 0; k < own.base_T_tool.size(); ++k) {
      curves.back().row(static_cast<Eigen::Index>(k)) = own.base_T_tool[k].translation.transpose();
    }
  }
  std::vector<std::vector<double>> knots = RegisterElastically(curves);
  for (std::size_t i = 0; i < knots.size(); ++i) {
    for (double& knot : knots[i]) knot *= trials[i].own.time_s.back();
  }
  return knots;
}

std::vector<double> MeanKnots(const std::vector<std::vector<double>>& own_knots) {
  std::vector<double> means(own_knots.front().size(), 0);
  for (const std::vector<double>& knots : own_knots) {
    for (std::size_t k = 0; k < knots.size(); ++k) {
      means[k] += knots[k] / static_cast<double>(own_knots.size());
    }
  }
  return means;
}

// Trials with fewer candidates than all others, whose lack decides how many markers there are.
void WarnOfFewCandidates(const std::vector<Candidates>& candidates,
                         std::vector<std::string>& warnings) {
  if (candidates.size() < 2) return;
  std::vector<std::size_t> counts;
  for (const Candidates& c : candidates) counts.push_back(c.marker.size());
  std::sort(counts.begin(), counts.end());
  const auto trial_with = [&](std::size_t count) -> const std::string& {
    return std::find_if(candidates.begin(), candidates.end(),
                        [&](const Candidates& c) { return c.marker.size() == count; })
        ->choice.id;
  };
  if (counts[0] == 0) {
    std::vector<std::string> ids;
    for (const Candidates& c : candidates) {
      if (c.marker.empty()) ids.push_back(c.choice.id);
    }
    warnings.push_back("no beginning of an episode found in " + Join(ids, ", ") +
                       ": all trials are aligned by linear time only; leave_out=" + Join(ids, ",") +
                       " leaves it out");
  } else if (counts[0] < counts[1]) {
    warnings.push_back("trial " + trial_with(counts[0]) + " has " + std::to_string(counts[0]) +
                       " candidate markers, each other trial at least " +
                       std::to_string(counts[1]) + ": it alone limits the number of episodes");
  }
}

}  // namespace

Result<Alignment> Align(std::vector<UniformTrial> trials, const LearnOptions& options,
                        const Progress& progress, std::stop_token stop) {
  const auto report = [&](double fraction, std::string_view step) {
    if (progress) progress(fraction, step);
  };
  const auto cancelled = [] { return Error{ErrorCode::kCancelled, "alignment was cancelled", {}}; };
  Alignment result;
  for (const std::string& id : options.leave_out) {
    std::erase_if(trials, [&](const UniformTrial& trial) { return trial.id == id; });
  }
  if (trials.empty()) {
    return InvalidArgument("no trial to align: all are left out", "leave_out");
  }

  std::vector<Candidates> candidates;
  for (UniformTrial& trial : trials) {
    if (stop.stop_requested()) return cancelled();
    AlignedTrial aligned;
    aligned.id = trial.id;
    aligned.segmentation = Segment(trial, options);
    candidates.push_back(CandidatesOf(trial, aligned.segmentation));
    aligned.own = std::move(trial);
    result.trials.push_back(std::move(aligned));
    report(0.2 * static_cast<double>(candidates.size()) / static_cast<double>(trials.size()),
           "segmentation");
  }
  const bool elastic = options.alignment == AlignmentRule::kElastic;
  if (!elastic) WarnOfFewCandidates(candidates, result.warnings);

  std::vector<MarkerCandidates> choices;
  for (const Candidates& c : candidates) choices.push_back(c.choice);
  const MarkerChoice choice =
      options.selection == Selection::kJoint ? ChooseJointly(choices) : ChooseByVote(choices);
  result.warnings.insert(result.warnings.end(), choice.warnings.begin(), choice.warnings.end());
  result.choice_value = choice.value;
  result.choice_bound = choice.bound;
  if (stop.stop_requested()) return cancelled();
  report(0.7, "marker choice");

  const std::size_t n = result.trials.size();
  std::vector<std::vector<double>> own_knots;
  std::vector<std::vector<double>> plain_knots;
  double mean_duration_s = 0;
  for (std::size_t i = 0; i < n; ++i) {
    own_knots.push_back(KnotsOf(candidates[i], choice.chosen[i]));
    plain_knots.push_back({0, own_knots.back().back()});
    mean_duration_s += own_knots.back().back() / static_cast<double>(n);
    for (const int c : choice.chosen[i]) {
      result.trials[i].chosen.push_back(candidates[i].marker[static_cast<std::size_t>(c)]);
    }
  }
  result.knots_s = MeanKnots(own_knots);
  result.markers_s = result.knots_s;
  if (elastic) {
    const std::vector<std::vector<double>> own_markers = std::move(own_knots);
    own_knots = ElasticKnots(result.trials);
    result.knots_s = MeanKnots(own_knots);
    std::vector<std::vector<double>> common_markers;
    for (std::size_t i = 0; i < n; ++i) {
      const MonotoneHermite common_from_own(own_knots[i], result.knots_s);
      common_markers.emplace_back();
      for (const double t : own_markers[i]) common_markers.back().push_back(common_from_own(t));
    }
    result.markers_s = MeanKnots(common_markers);
  }
  for (std::size_t i = 0; i < n; ++i) result.trials[i].own_knots_s = own_knots[i];
  const int frames =
      options.frames > 0
          ? options.frames
          : std::clamp(static_cast<int>(std::lround(mean_duration_s * options.sample_rate_hz)) + 1,
                       2, 36000);
  result.time_s = signal::EvenTimes(0, result.knots_s.back(), frames);

  for (std::size_t i = 0; i < n; ++i) {
    if (stop.stop_requested()) return cancelled();
    const UniformTrial warped = Warped(result, i);
    if (i == 0) {
      result.canonical_joints = Eigen::MatrixXd::Zero(frames, warped.joints.cols());
      result.canonical_tool = Eigen::MatrixXd::Zero(warped.base_T_tool.empty() ? 0 : frames, 3);
    }
    result.canonical_joints += warped.joints / static_cast<double>(n);
    for (Eigen::Index k = 0; k < result.canonical_tool.rows(); ++k) {
      result.canonical_tool.row(k) +=
          warped.base_T_tool[static_cast<std::size_t>(k)].translation.transpose() /
          static_cast<double>(n);
    }
    report(0.7 + 0.3 * static_cast<double>(i + 1) / static_cast<double>(n), "warping");
  }
  result.mean_correlation =
      MeanCorrelation(WarpedSignals(result.trials, own_knots, result.knots_s, result.time_s));
  result.plain_correlation = MeanCorrelation(
      WarpedSignals(result.trials, plain_knots, {0, result.knots_s.back()}, result.time_s));
  return result;
}

}  // namespace exemplar::learning
