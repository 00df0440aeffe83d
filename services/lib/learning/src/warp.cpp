#include "exemplar/learning/warp.hpp"

#include <cmath>

#include "exemplar/learning/hermite.hpp"
#include "exemplar/signal/resample.hpp"

namespace exemplar::learning {
namespace {

// Where each frame of the common time lies among the trial's own frames.
using Places = std::vector<signal::Place>;

Eigen::MatrixXd Resample(const Eigen::Ref<const Eigen::MatrixXd>& own, const Places& places) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(places.size()), own.cols());
  for (Eigen::Index c = 0; c < own.cols(); ++c) {
    for (std::size_t k = 0; k < places.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(places[k].index);
      out(static_cast<Eigen::Index>(k), c) =
          (1 - places[k].part) * own(at, c) + places[k].part * own(at + 1, c);
    }
  }
  return out;
}

template <typename Poses>
std::vector<geometry::Pose> ResamplePoses(const Poses& own, const Places& places) {
  std::vector<geometry::Pose> out;
  out.reserve(places.size());
  for (const signal::Place& place : places) {
    out.push_back(geometry::Interpolate(own[place.index], own[place.index + 1], place.part));
  }
  return out;
}

std::vector<double> Resample(const std::vector<double>& own, const Places& places) {
  std::vector<double> out;
  out.reserve(places.size());
  for (const signal::Place& place : places) {
    out.push_back((1 - place.part) * own[place.index] + place.part * own[place.index + 1]);
  }
  return out;
}

}  // namespace

UniformTrial WarpTrial(const UniformTrial& trial, std::span<const double> own_knots_s,
                       std::span<const double> common_knots_s,
                       const std::vector<double>& common_s) {
  const MonotoneHermite own_from_common({common_knots_s.begin(), common_knots_s.end()},
                                        {own_knots_s.begin(), own_knots_s.end()});
  Places places;
  places.reserve(common_s.size());
  for (const double t : common_s)
    places.push_back(signal::Locate(trial.time_s, own_from_common(t)));

  UniformTrial warped;
  warped.id = trial.id;
  warped.time_s = common_s;
  warped.joint_names = trial.joint_names;
  warped.joints = Resample(trial.joints, places);
  warped.has_orientation = trial.has_orientation;
  if (!trial.base_T_tool.empty()) warped.base_T_tool = ResamplePoses(trial.base_T_tool, places);
  if (!trial.hand_open.empty()) warped.hand_open = Resample(trial.hand_open, places);
  if (trial.touch_n.size() > 0) warped.touch_n = Resample(trial.touch_n, places);
  warped.object_names = trial.object_names;
  warped.object_has_orientation = trial.object_has_orientation;
  for (const PosePath& base_T_object : trial.base_T_object) {
    // A static object stays static to the last bit.
    warped.base_T_object.push_back(base_T_object.still()
                                       ? PosePath(common_s.size(), base_T_object.front())
                                       : PosePath(ResamplePoses(base_T_object, places)));
  }
  warped.cutoff_hz = trial.cutoff_hz;
  warped.notes = trial.notes;
  return warped;
}

UniformTrial Warped(const Alignment& alignment, std::size_t trial) {
  const AlignedTrial& aligned = alignment.trials[trial];
  return WarpTrial(aligned.own, aligned.own_knots_s, alignment.knots_s, alignment.time_s);
}

}  // namespace exemplar::learning
