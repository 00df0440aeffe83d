#include "rewarp.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/learning/touch.hpp"

namespace exemplar::learning {
namespace {

// Part of time in a trial's phase; the rest is path length. A pause still takes its share.
constexpr double kTimePart = 0.3;
// Frames between two knots of an alignment.
constexpr double kLeastGap = 2;

// Value at `x` of the polyline through (xs, ys), xs increasing; held outside.
double Lookup(std::span<const double> xs, std::span<const double> ys, double x) {
  const auto after = std::upper_bound(xs.begin(), xs.end(), x);
  if (after == xs.begin()) return ys.front();
  if (after == xs.end()) return ys.back();
  const auto k = static_cast<std::size_t>(after - xs.begin());
  const double s = (x - xs[k - 1]) / (xs[k] - xs[k - 1]);
  return ys[k - 1] + s * (ys[k] - ys[k - 1]);
}

std::vector<double> Frames(int frames) {
  std::vector<double> all(static_cast<std::size_t>(frames));
  for (int i = 0; i < frames; ++i) all[static_cast<std::size_t>(i)] = i;
  return all;
}

// 0 to 1 along the trial, strictly increasing; at the boundaries of measured contacts it equals
// their part of the frames.
std::vector<double> Phase(const Exemplars& exemplars, const ExemplarTrial& trial) {
  const int n = exemplars.frames;
  std::vector<int> anchors = {0};
  for (const ContactSpan& contact : exemplars.contacts) {
    if (!contact.at_one_time) continue;
    for (const int frame : {contact.first, contact.last}) {
      if (frame > anchors.back() && frame < n - 1) anchors.push_back(frame);
    }
  }
  anchors.push_back(n - 1);
  std::vector<double> phase(static_cast<std::size_t>(n), 0.0);
  for (std::size_t a = 1; a < anchors.size(); ++a) {
    const int begin = anchors[a - 1];
    const int end = anchors[a];
    std::vector<double> length = {0};
    for (int i = begin + 1; i <= end; ++i) {
      length.push_back(length.back() + (trial.tool[static_cast<std::size_t>(i)].translation -
                                        trial.tool[static_cast<std::size_t>(i - 1)].translation)
                                           .norm());
    }
    const double whole = length.back();
    for (int i = begin; i <= end; ++i) {
      const double even = static_cast<double>(i - begin) / (end - begin);
      const double lasted = trial.own_time[end] - trial.own_time[begin];
      const double time = lasted > 0 ? (trial.own_time[i] - trial.own_time[begin]) / lasted : even;
      const double way = whole > 0 ? length[static_cast<std::size_t>(i - begin)] / whole : even;
      const double part = kTimePart * time + (1 - kTimePart) * way;
      phase[static_cast<std::size_t>(i)] = (begin + part * (end - begin)) / (n - 1);
    }
  }
  return phase;
}

}  // namespace

ExemplarTrial Rewarped(const ExemplarTrial& trial, std::span<const double> from) {
  ExemplarTrial result;
  result.situation = trial.situation;
  result.own_contacts = trial.own_contacts;
  const auto sample = [&](const std::vector<geometry::Pose>& path) {
    std::vector<geometry::Pose> sampled;
    sampled.reserve(from.size());
    for (const double at : from) {
      const double whole = std::clamp(std::floor(at), 0.0, static_cast<double>(path.size() - 1));
      const auto k = static_cast<std::size_t>(whole);
      const double s = std::clamp(at - whole, 0.0, 1.0);
      sampled.push_back(
          s > 0 && k + 1 < path.size() ? geometry::Interpolate(path[k], path[k + 1], s) : path[k]);
    }
    return sampled;
  };
  const auto mix = [&](const Eigen::MatrixXd& rows) {
    Eigen::MatrixXd sampled(static_cast<Eigen::Index>(from.size()), rows.cols());
    for (std::size_t i = 0; i < from.size(); ++i) {
      const double whole =
          std::clamp(std::floor(from[i]), 0.0, static_cast<double>(rows.rows() - 1));
      const auto k = static_cast<Eigen::Index>(whole);
      const double s = std::clamp(from[i] - whole, 0.0, 1.0);
      const auto row = static_cast<Eigen::Index>(i);
      sampled.row(row) = rows.row(k);
      if (s > 0 && k + 1 < rows.rows()) sampled.row(row) += s * (rows.row(k + 1) - rows.row(k));
    }
    return sampled;
  };
  if (!trial.tool.empty()) result.tool = sample(trial.tool);
  for (const std::vector<geometry::Pose>& path : trial.moving) {
    result.moving.push_back(path.empty() ? path : sample(path));
  }
  result.joints = trial.joints.cols() > 0 ? mix(trial.joints) : trial.joints;
  if (trial.hand.size() > 0) result.hand = mix(trial.hand);
  if (trial.touch_n.size() > 0) result.touch_n = mix(trial.touch_n);
  result.own_time = mix(trial.own_time);
  if (!trial.own_contacts.empty()) {
    const std::vector<double> to = Frames(static_cast<int>(from.size()));
    for (ContactWindow& window : result.own_contacts) {
      for (double* frame : {&window.first, &window.still, &window.last}) {
        *frame = Lookup(from, to, *frame);
      }
    }
  }
  return result;
}

namespace {

// Contacts known from the trials' own windows lie at their means.
void SetMeanSpans(Exemplars& exemplars) {
  for (std::size_t k = 0; k < exemplars.trials[0].own_contacts.size(); ++k) {
    ContactWindow mean;
    for (const ExemplarTrial& trial : exemplars.trials) {
      mean.first += trial.own_contacts[k].first / exemplars.size();
      mean.still += trial.own_contacts[k].still / exemplars.size();
      mean.last += trial.own_contacts[k].last / exemplars.size();
    }
    exemplars.contacts[k].first = static_cast<int>(std::lround(mean.first));
    exemplars.contacts[k].meets = static_cast<int>(std::lround(mean.still));
    exemplars.contacts[k].last = static_cast<int>(std::lround(mean.last));
  }
}

// Warps each trial so that its knots (own frames, start and end among them) fall on their mean over
// the trials. False, and nothing done, where the mean leaves no frame between two of them.
bool AlignKnots(const std::vector<std::vector<double>>& knots, Exemplars& exemplars) {
  std::vector<double> mean(knots.front().size(), 0.0);
  for (const std::vector<double>& own : knots) {
    for (std::size_t k = 0; k < mean.size(); ++k) {
      mean[k] += own[k] / static_cast<double>(knots.size());
    }
  }
  // Whole frames, so that the onset is a sample of the common time base; still increasing.
  for (double& frame : mean) frame = std::round(frame);
  for (std::size_t k = 1; k < mean.size(); ++k) {
    if (mean[k] <= mean[k - 1]) return false;
  }
  const std::vector<double> all = Frames(exemplars.frames);
  for (std::size_t j = 0; j < knots.size(); ++j) {
    std::vector<double> from;
    for (const double frame : all) from.push_back(Lookup(mean, knots[j], frame));
    exemplars.trials.Replace(j, Rewarped(exemplars.trials[j], from));
  }
  return true;
}

}  // namespace

void AlignTouches(Exemplars& exemplars) {
  std::vector<std::vector<double>> knots;
  for (const ExemplarTrial& trial : exemplars.trials) {
    if (trial.touch_n.size() == 0) return;
    std::vector<double> own = {0};
    for (const Touch& touch : FindTouches(trial.touch_n)) {
      for (const int frame : {touch.first, touch.last}) {
        if (frame > own.back() && frame < exemplars.frames - 1) own.push_back(frame);
      }
    }
    own.push_back(exemplars.frames - 1);
    if (!knots.empty() && own.size() != knots.front().size()) return;
    knots.push_back(std::move(own));
  }
  if (knots.front().size() == 2) return;
  AlignKnots(knots, exemplars);
}

Exemplars AlignedAtContacts(Exemplars exemplars) {
  const std::size_t count = exemplars.trials[0].own_contacts.size();
  if (count == 0) return exemplars;
  // Ends that the trials reach with the recording are knots already.
  const double end = exemplars.frames - 1;
  std::vector<std::vector<double>> knots(exemplars.trials.size(), {0.0});
  for (std::size_t k = 0; k < count; ++k) {
    for (const bool last : {false, true}) {
      bool inside = true;
      for (std::size_t j = 0; j < knots.size(); ++j) {
        const ContactWindow& window = exemplars.trials[j].own_contacts[k];
        const double frame = last ? window.last : window.first;
        inside = inside && frame > knots[j].back() + kLeastGap && frame < end - kLeastGap;
      }
      if (!inside) continue;
      for (std::size_t j = 0; j < knots.size(); ++j) {
        const ContactWindow& window = exemplars.trials[j].own_contacts[k];
        knots[j].push_back(last ? window.last : window.first);
      }
    }
  }
  for (std::vector<double>& own : knots) own.push_back(end);
  if (knots.front().size() == 2 || !AlignKnots(knots, exemplars)) return exemplars;
  SetMeanSpans(exemplars);
  for (ContactSpan& contact : exemplars.contacts) contact.at_one_time = true;
  return exemplars;
}

Exemplars AlignedByLength(Exemplars exemplars) {
  const int n = exemplars.frames;
  if (!exemplars.has_tool || n < 3) return exemplars;
  const std::vector<double> all = Frames(n);
  std::vector<std::vector<double>> phases;
  // Mean time of each phase, on a grid as fine as the frames.
  std::vector<double> grid;
  std::vector<double> mean(static_cast<std::size_t>(n), 0.0);
  for (const double frame : all) grid.push_back(frame / (n - 1));
  for (const ExemplarTrial& trial : exemplars.trials) {
    phases.push_back(Phase(exemplars, trial));
    for (std::size_t i = 0; i < grid.size(); ++i) {
      mean[i] += Lookup(phases.back(), all, grid[i]) / exemplars.size();
    }
  }
  for (std::size_t j = 0; j < phases.size(); ++j) {
    std::vector<double> from;
    for (const double frame : all) {
      from.push_back(Lookup(phases[j], all, Lookup(mean, grid, frame)));
    }
    from.front() = 0;
    from.back() = n - 1;
    exemplars.trials.Replace(j, Rewarped(exemplars.trials[j], from));
  }
  SetMeanSpans(exemplars);
  return exemplars;
}

}  // namespace exemplar::learning
