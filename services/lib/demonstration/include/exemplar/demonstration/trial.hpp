#pragma once
// One demonstration of a task, as values. Each stream keeps the time stamps of its own source: the
// learner alone brings them onto one base (PAPER.md section 2).

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/geometry/pose.hpp"

namespace exemplar::demonstration {

/// Named scalar channels sampled together.
/// Invariant (checked once, by Validate): time strictly increasing, all finite.
struct ScalarSeries {
  std::vector<std::string> names;  ///< one a channel
  std::vector<double> time_s;      ///< since the trial's start
  Eigen::MatrixXd values;          ///< samples x channels, SI units

  bool empty() const { return time_s.empty() || names.empty(); }
  std::size_t size() const { return time_s.size(); }
};

/// Poses of one named frame in the robot's base frame.
/// Invariant: as ScalarSeries; unit quaternions of continuous sign.
struct PoseSeries {
  std::string name;            ///< "" for the only (or main) hand
  std::vector<double> time_s;  ///< since the trial's start
  std::vector<geometry::Pose> base_T_frame;
  bool has_orientation = true;

  bool empty() const { return time_s.empty(); }
  std::size_t size() const { return time_s.size(); }
};

/// A demonstration. Every group may be absent but one of joints and end effectors.
struct Trial {
  std::string source;   ///< file or recording it came from
  Stamp start;          ///< wall time of time_s = 0; zero when unknown
  ScalarSeries joints;  ///< rad (revolute) or m (prismatic): the demonstrator's own
  std::vector<std::string> prismatic_joints;  ///< those of `joints` that are in m
  /// The same joints as the robot measured them while it followed the demonstrator; empty where no
  /// robot did.
  ScalarSeries measured_joints;
  std::vector<PoseSeries> end_effectors;
  std::vector<PoseSeries> objects;
  ScalarSeries hands;    ///< opening, 0 closed to 1 open; channel "" for the main hand
  ScalarSeries tactile;  ///< N, one channel a sensor
  ScalarSeries wrench;   ///< fx fy fz (N) tx ty tz (N m) at the tool, or empty
  ScalarSeries label;    ///< one channel of whole numbers, or empty: a person's phase labels
  std::vector<std::string> notices;  ///< what was mended or ignored, with its place

  /// From the first to the last sample of joints and end effectors, in seconds.
  double duration_s() const;
  const PoseSeries* FindObject(std::string_view name) const;
};

/// Checks every invariant of a Trial; the error names stream, field and index.
Status Validate(const Trial& trial);

/// Equal in every sample (names, times and values), whatever the source and notices say.
bool SameContent(const Trial& a, const Trial& b);

}  // namespace exemplar::demonstration
