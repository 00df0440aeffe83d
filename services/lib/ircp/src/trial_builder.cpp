#include "exemplar/ircp/trial_builder.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>

namespace exemplar::ircp {
namespace {

using demonstration::PoseSeries;
using demonstration::ScalarSeries;
using demonstration::Trial;

/// The double nearest to the decimal number of seconds: what was read from a file comes out alike.
double Seconds(Duration since_start) { return static_cast<double>(since_start.count()) / 1e9; }

/// Sorts by stamp and drops repeated ones; returns how many were dropped.
template <class Value>
std::size_t SortUnique(std::vector<std::pair<Stamp, Value>>& rows) {
  std::stable_sort(rows.begin(), rows.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto end = std::unique(rows.begin(), rows.end(),
                               [](const auto& a, const auto& b) { return a.first == b.first; });
  const auto dropped = static_cast<std::size_t>(rows.end() - end);
  rows.erase(end, rows.end());
  return dropped;
}

void NoticeDropped(std::size_t dropped, const std::string& stream, Trial& trial) {
  if (dropped == 0) return;
  trial.notices.push_back(stream + ": " + std::to_string(dropped) +
                          " samples with a repeated time stamp dropped");
}

std::string Named(const std::string& stream, const std::string& name) {
  return name.empty() ? stream : stream + " \"" + name + "\"";
}

}  // namespace

TrialBuilder::Poses& TrialBuilder::FindOrAdd(std::map<std::string, Poses>& named,
                                             const std::string& name) {
  const std::size_t order = named.size();
  const auto [entry, added] = named.try_emplace(name);
  if (added) entry->second.order = order;
  return entry->second;
}

void TrialBuilder::Gather(std::map<std::string, Rows>& senders, const Header& header,
                          const std::vector<std::string>& names, const Row& values) {
  Rows& sender = senders[header.source];
  if (sender.rows.empty()) sender.names = names;
  if (names != sender.names || values.size() != names.size()) {
    ++sender.other_names;
    return;
  }
  sender.rows.emplace_back(header.stamp, values);
}

void TrialBuilder::Add(const SuitSample& sample) {
  Gather(suits_, sample.header, sample.names, sample.positions);
}

void TrialBuilder::Add(const TactileSample& sample) {
  Gather(tactile_, sample.header, sample.sensors, sample.forces_n);
}

void TrialBuilder::Add(const JointStateSample& sample) {
  Gather(states_, sample.header, sample.names, sample.positions);
  if (!sample.touch_sensors.empty()) {
    Gather(touches_, sample.header, sample.touch_sensors, sample.touch_n);
  }
}

void TrialBuilder::Add(const EndEffectorSample& sample) {
  if (sample.has_pose) {
    Poses& hand = FindOrAdd(hands_, sample.hand);
    hand.has_orientation = hand.has_orientation && sample.has_orientation;
    hand.poses.emplace_back(sample.header.stamp, sample.base_T_tool);
  }
  if (sample.has_hand_open) {
    Rows& opening = openings_[sample.hand];
    opening.names = {sample.hand};
    opening.rows.emplace_back(sample.header.stamp, Row{sample.hand_open});
  }
  if (sample.has_wrench) {
    wrench_.names = {"fx", "fy", "fz", "tx", "ty", "tz"};
    wrench_.rows.emplace_back(sample.header.stamp, Row(sample.wrench.begin(), sample.wrench.end()));
  }
  if (sample.has_label) {
    label_.names = {"label"};
    label_.rows.emplace_back(sample.header.stamp, Row{static_cast<double>(sample.label)});
  }
}

void TrialBuilder::Add(const ObjectSample& sample) {
  Poses& object = FindOrAdd(objects_, sample.name);
  object.has_orientation = object.has_orientation && sample.has_orientation;
  object.poses.emplace_back(sample.header.stamp, sample.base_T_object);
}

Result<Trial> TrialBuilder::Build(std::string source) const {
  Trial trial;
  trial.source = std::move(source);
  const bool from_robot = suits_.empty() && hands_.empty();
  const std::map<std::string, Rows>& joints = from_robot ? states_ : suits_;
  const std::map<std::string, Rows>& touch = from_robot && tactile_.empty() ? touches_ : tactile_;
  if (joints.empty() && hands_.empty()) {
    return InvalidArgument(trial.source +
                           ": holds neither joints (ircp/suit) nor tool poses (ircp/end_effector)");
  }
  if (from_robot && !joints.empty()) {
    trial.notices.emplace_back(
        "joints are the robot's own (ircp/joint_state): neither suit nor tool was recorded");
  }

  Stamp start = Stamp::FromNanoseconds(std::numeric_limits<std::int64_t>::max());
  const auto earliest = [&start](const auto& rows) {
    for (const auto& row : rows) start = std::min(start, row.first);
  };
  for (const auto* senders : {&joints, &touch}) {
    for (const auto& [name, sender] : *senders) earliest(sender.rows);
  }
  for (const auto* named : {&hands_, &objects_}) {
    for (const auto& [name, series] : *named) earliest(series.poses);
  }
  for (const auto& [name, opening] : openings_) earliest(opening.rows);
  earliest(wrench_.rows);
  earliest(label_.rows);
  trial.start = start;

  const auto scalars = [&](const Rows& rows, const std::string& stream) {
    std::vector<std::pair<Stamp, Row>> sorted = rows.rows;
    NoticeDropped(SortUnique(sorted), stream, trial);
    if (rows.other_names > 0) {
      trial.notices.push_back(stream + ": " + std::to_string(rows.other_names) +
                              " samples with other channel names left out");
    }
    ScalarSeries series;
    series.names = rows.names;
    series.values.resize(static_cast<Eigen::Index>(sorted.size()),
                         static_cast<Eigen::Index>(rows.names.size()));
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      series.time_s.push_back(Seconds(sorted[i].first - start));
      for (std::size_t k = 0; k < rows.names.size(); ++k) {
        series.values(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
            sorted[i].second[k];
      }
    }
    return series;
  };
  const auto poses = [&](const Poses& from, const std::string& name, const std::string& stream) {
    auto sorted = from.poses;
    NoticeDropped(SortUnique(sorted), Named(stream, name), trial);
    PoseSeries series;
    series.name = name;
    series.has_orientation = from.has_orientation;
    for (const auto& [stamp, pose] : sorted) {
      series.time_s.push_back(Seconds(stamp - start));
      series.base_T_frame.push_back(pose);
    }
    geometry::MakeSignsContinuous(series.base_T_frame);
    return series;
  };
  // Of several senders of one kind the one with most samples counts; the others are named.
  const auto only = [&](const std::map<std::string, Rows>& senders, const std::string& stream) {
    if (senders.empty()) return ScalarSeries{};
    const auto most = std::max_element(
        senders.begin(), senders.end(),
        [](const auto& a, const auto& b) { return a.second.rows.size() < b.second.rows.size(); });
    for (const auto& [name, sender] : senders) {
      if (name == most->first) continue;
      trial.notices.push_back(stream + ": \"" + name + "\" left out, \"" + most->first + "\" used");
    }
    return scalars(most->second, stream);
  };

  trial.joints = only(joints, "joints");
  // Beside a suit, the robot is the one that follows it.
  if (!suits_.empty()) trial.measured_joints = only(states_, "measured joints");
  trial.tactile = only(touch, "tactile");
  trial.end_effectors.resize(hands_.size());
  for (const auto& [name, hand] : hands_) {
    trial.end_effectors[hand.order] = poses(hand, name, "end effector");
  }
  trial.objects.resize(objects_.size());
  for (const auto& [name, object] : objects_) {
    trial.objects[object.order] = poses(object, name, "object");
  }
  if (!wrench_.rows.empty()) trial.wrench = scalars(wrench_, "wrench");
  if (!label_.rows.empty()) trial.label = scalars(label_, "label");
  if (!openings_.empty()) {
    // One series holds all hands, so it has the stamps that all of them share.
    std::map<Stamp, Row> shared;
    std::size_t hands = 0;
    for (const auto& [name, opening] : openings_) {
      for (const auto& [stamp, value] : opening.rows) {
        Row& row = shared[stamp];
        if (row.size() == hands) row.push_back(value.front());
      }
      ++hands;
    }
    Rows all;
    for (auto& [stamp, row] : shared) {
      if (row.size() == hands) {
        all.rows.emplace_back(stamp, std::move(row));
      } else {
        ++all.other_names;
      }
    }
    for (const auto& [name, opening] : openings_) all.names.push_back(name);
    trial.hands = scalars(all, "hand opening");
  }

  if (Status valid = demonstration::Validate(trial); !valid) {
    return WithPlace(valid.error(), trial.source);
  }
  return trial;
}

}  // namespace exemplar::ircp
