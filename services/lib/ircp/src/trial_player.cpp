#include "exemplar/ircp/trial_player.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace exemplar::ircp {
namespace {

using demonstration::PoseSeries;
using demonstration::ScalarSeries;

/// Finds the rows of a series by time, and remembers which were used.
class RowsByTime {
 public:
  explicit RowsByTime(const ScalarSeries& series) : series_(series) {}

  std::optional<Eigen::Index> At(double time_s) {
    while (next_ < series_.time_s.size() && series_.time_s[next_] < time_s) ++next_;
    if (next_ == series_.time_s.size() || series_.time_s[next_] != time_s) return std::nullopt;
    ++used_;
    return static_cast<Eigen::Index>(next_++);
  }
  std::size_t unused() const { return series_.time_s.size() - used_; }

 private:
  const ScalarSeries& series_;
  std::size_t next_ = 0;
  std::size_t used_ = 0;
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

void NoticeUnused(const RowsByTime& rows, const std::string& what, TrialSamples& out) {
  if (rows.unused() == 0) return;
  out.notices.push_back(what + ": " + std::to_string(rows.unused()) +
                        " samples at times without a tool pose are not sent");
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

  RowsByTime wrench(trial.wrench);
  RowsByTime label(trial.label);
  for (std::size_t h = 0; h < trial.end_effectors.size(); ++h) {
    const PoseSeries& hand = trial.end_effectors[h];
    RowsByTime opening(trial.hands);
    const std::optional<Eigen::Index> channel = ChannelOf(trial.hands, hand.name);
    for (std::size_t i = 0; i < hand.size(); ++i) {
      EndEffectorSample sample;
      sample.header.stamp = stamp(hand.time_s[i]);
      sample.hand = hand.name;
      sample.base_T_tool = hand.base_T_frame[i];
      sample.has_orientation = hand.has_orientation;
      if (channel) {
        if (const auto row = opening.At(hand.time_s[i])) {
          sample.has_hand_open = true;
          sample.hand_open = trial.hands.values(*row, *channel);
        }
      }
      if (h == 0) {
        if (const auto row = wrench.At(hand.time_s[i])) {
          sample.has_wrench = true;
          for (Eigen::Index k = 0; k < std::min<Eigen::Index>(6, trial.wrench.values.cols()); ++k) {
            sample.wrench[static_cast<std::size_t>(k)] = trial.wrench.values(*row, k);
          }
        }
        if (const auto row = label.At(hand.time_s[i])) {
          sample.has_label = true;
          sample.label = static_cast<std::int32_t>(std::lround(trial.label.values(*row, 0)));
        }
      }
      out.samples.emplace_back(std::move(sample));
    }
    if (channel) NoticeUnused(opening, "hand opening", out);
  }
  NoticeUnused(wrench, "wrench", out);
  NoticeUnused(label, "label", out);

  std::stable_sort(
      out.samples.begin(), out.samples.end(),
      [](const TrialSample& a, const TrialSample& b) { return StampOf(a) < StampOf(b); });
  return out;
}

Stamp StampOf(const TrialSample& sample) {
  return std::visit([](const auto& s) { return s.header.stamp; }, sample);
}

}  // namespace exemplar::ircp
