#include "exemplar/ircp/trial_player.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace exemplar::ircp {
namespace {

using demonstration::PoseSeries;
using demonstration::ScalarSeries;

/// Finds the rows of a series by time, and remembers which were not asked for.
class RowsByTime {
 public:
  explicit RowsByTime(const ScalarSeries& series) : series_(series) {}

  std::optional<Eigen::Index> At(double time_s) {
    while (next_ < series_.time_s.size() && series_.time_s[next_] < time_s) Pass();
    if (next_ == series_.time_s.size() || series_.time_s[next_] != time_s) return std::nullopt;
    return static_cast<Eigen::Index>(next_++);
  }
  std::vector<std::size_t> TakeUnused() {
    while (next_ < series_.time_s.size()) Pass();
    return std::move(unused_);
  }

 private:
  void Pass() { unused_.push_back(next_++); }

  const ScalarSeries& series_;
  std::size_t next_ = 0;
  std::vector<std::size_t> unused_;
};

std::optional<Eigen::Index> ChannelOf(const ScalarSeries& series, const std::string& name) {
  const auto found = std::find(series.names.begin(), series.names.end(), name);
  if (found == series.names.end()) return std::nullopt;
  return found - series.names.begin();
}

std::vector<double> RowOf(const ScalarSeries& series, Eigen::Index row) {
  const Eigen::VectorXd values = series.values.row(row);
  return {values.begin(), values.end()};
}

/// What was measured of a hand at times without a tool pose.
class Poseless {
 public:
  EndEffectorSample& At(const std::string& hand, double time_s) {
    EndEffectorSample& sample = samples_[{hand, time_s}];
    sample.hand = hand;
    sample.has_pose = false;
    sample.has_orientation = false;
    return sample;
  }
  template <class Stamps>
  void MoveTo(std::vector<TrialSample>& out, const Stamps& stamp) {
    for (auto& [where, sample] : samples_) {
      sample.header.stamp = stamp(where.second);
      out.emplace_back(std::move(sample));
    }
  }

 private:
  std::map<std::pair<std::string, double>, EndEffectorSample> samples_;
};

void SetOpening(const ScalarSeries& hands, Eigen::Index row, Eigen::Index channel,
                EndEffectorSample& sample) {
  sample.has_hand_open = true;
  sample.hand_open = hands.values(row, channel);
}

void SetWrench(const ScalarSeries& wrench, Eigen::Index row, EndEffectorSample& sample) {
  sample.has_wrench = true;
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(6, wrench.values.cols()); ++k) {
    sample.wrench[static_cast<std::size_t>(k)] = wrench.values(row, k);
  }
}

void SetLabel(const ScalarSeries& label, Eigen::Index row, EndEffectorSample& sample) {
  sample.has_label = true;
  sample.label = static_cast<std::int32_t>(std::lround(label.values(row, 0)));
}

}  // namespace

TrialSamples SamplesOf(const demonstration::Trial& trial, Stamp start,
                       const std::string& base_frame) {
  TrialSamples out;
  const auto stamp = [&](double time_s) { return start + FromSeconds(time_s); };

  for (std::size_t i = 0; i < trial.joints.size(); ++i) {
    SuitSample sample;
    sample.header.stamp = stamp(trial.joints.time_s[i]);
    sample.names = trial.joints.names;
    sample.positions = RowOf(trial.joints, static_cast<Eigen::Index>(i));
    out.samples.emplace_back(std::move(sample));
  }
  for (std::size_t i = 0; i < trial.tactile.size(); ++i) {
    TactileSample sample;
    sample.header.stamp = stamp(trial.tactile.time_s[i]);
    sample.sensors = trial.tactile.names;
    sample.forces_n = RowOf(trial.tactile, static_cast<Eigen::Index>(i));
    out.samples.emplace_back(std::move(sample));
  }
  for (const PoseSeries& object : trial.objects) {
    for (std::size_t i = 0; i < object.size(); ++i) {
      ObjectSample sample;
      sample.header.stamp = stamp(object.time_s[i]);
      sample.name = object.name;
      sample.frame = base_frame;
      sample.base_T_object = object.base_T_frame[i];
      sample.has_orientation = object.has_orientation;
      out.samples.emplace_back(std::move(sample));
    }
  }

  Poseless poseless;
  RowsByTime wrench(trial.wrench);
  RowsByTime label(trial.label);
  std::vector<RowsByTime> openings(trial.hands.names.size(), RowsByTime(trial.hands));
  for (std::size_t h = 0; h < trial.end_effectors.size(); ++h) {
    const PoseSeries& hand = trial.end_effectors[h];
    const std::optional<Eigen::Index> channel = ChannelOf(trial.hands, hand.name);
    for (std::size_t i = 0; i < hand.size(); ++i) {
      EndEffectorSample sample;
      sample.header.stamp = stamp(hand.time_s[i]);
      sample.hand = hand.name;
      sample.base_T_tool = hand.base_T_frame[i];
      sample.has_orientation = hand.has_orientation;
      if (channel) {
        const auto row = openings[static_cast<std::size_t>(*channel)].At(hand.time_s[i]);
        if (row) SetOpening(trial.hands, *row, *channel, sample);
      }
      if (h == 0) {
        if (const auto row = wrench.At(hand.time_s[i])) SetWrench(trial.wrench, *row, sample);
        if (const auto row = label.At(hand.time_s[i])) SetLabel(trial.label, *row, sample);
      }
      out.samples.emplace_back(std::move(sample));
    }
  }
  const std::string first_hand = trial.end_effectors.empty() ? "" : trial.end_effectors[0].name;
  for (const std::size_t row : wrench.TakeUnused()) {
    SetWrench(trial.wrench, static_cast<Eigen::Index>(row),
              poseless.At(first_hand, trial.wrench.time_s[row]));
  }
  for (const std::size_t row : label.TakeUnused()) {
    SetLabel(trial.label, static_cast<Eigen::Index>(row),
             poseless.At(first_hand, trial.label.time_s[row]));
  }
  for (std::size_t c = 0; c < openings.size(); ++c) {
    for (const std::size_t row : openings[c].TakeUnused()) {
      SetOpening(trial.hands, static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(c),
                 poseless.At(trial.hands.names[c], trial.hands.time_s[row]));
    }
  }
  poseless.MoveTo(out.samples, stamp);

  std::stable_sort(
      out.samples.begin(), out.samples.end(),
      [](const TrialSample& a, const TrialSample& b) { return StampOf(a) < StampOf(b); });
  return out;
}

Stamp StampOf(const TrialSample& sample) {
  return std::visit([](const auto& s) { return s.header.stamp; }, sample);
}

}  // namespace exemplar::ircp
