#include "exemplar/demonstration/trial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "exemplar/base/text.hpp"

namespace exemplar::demonstration {
namespace {

constexpr double kUnitTolerance = 1e-6;

Error At(const std::string& stream, std::size_t index, const std::string& what) {
  const std::string field = stream + "[" + std::to_string(index) + "]";
  return InvalidArgument(field + ": " + what, field);
}

Status CheckTimes(const std::string& stream, const std::vector<double>& time_s) {
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    if (!std::isfinite(time_s[i])) {
      return At(stream, i, "time is " + FormatDouble(time_s[i]) + " s, must be finite");
    }
    if (i > 0 && time_s[i] <= time_s[i - 1]) {
      return At(stream, i,
                "time is " + FormatDouble(time_s[i]) + " s after " + FormatDouble(time_s[i - 1]) +
                    " s, must increase");
    }
  }
  return {};
}

Status CheckScalars(const std::string& stream, const ScalarSeries& series) {
  if (series.names.empty() && series.time_s.empty() && series.values.size() == 0) return {};
  if (series.values.rows() != static_cast<Eigen::Index>(series.time_s.size()) ||
      series.values.cols() != static_cast<Eigen::Index>(series.names.size())) {
    return InvalidArgument(stream + ": " + std::to_string(series.values.rows()) + " x " +
                               std::to_string(series.values.cols()) + " values for " +
                               std::to_string(series.time_s.size()) + " times and " +
                               std::to_string(series.names.size()) + " names",
                           stream);
  }
  std::set<std::string> names;
  for (const std::string& name : series.names) {
    if (!names.insert(name).second) {
      return InvalidArgument(stream + ": channel \"" + name + "\" stands twice", stream);
    }
  }
  for (Eigen::Index c = 0; c < series.values.cols(); ++c) {
    for (Eigen::Index r = 0; r < series.values.rows(); ++r) {
      if (std::isfinite(series.values(r, c))) continue;
      return At(stream, static_cast<std::size_t>(r),
                series.names[static_cast<std::size_t>(c)] + " is " +
                    FormatDouble(series.values(r, c)) + ", must be finite");
    }
  }
  return CheckTimes(stream, series.time_s);
}

Status CheckPoses(const std::string& stream, const PoseSeries& series) {
  if (series.base_T_frame.size() != series.time_s.size()) {
    return InvalidArgument(stream + ": " + std::to_string(series.base_T_frame.size()) +
                               " poses for " + std::to_string(series.time_s.size()) + " times",
                           stream);
  }
  for (std::size_t i = 0; i < series.size(); ++i) {
    const geometry::Pose& pose = series.base_T_frame[i];
    if (!pose.translation.allFinite() || !pose.rotation.coeffs().allFinite()) {
      return At(stream, i, "the pose is not finite");
    }
    const double norm = pose.rotation.norm();
    if (std::abs(norm - 1) > kUnitTolerance) {
      return At(stream, i, "the quaternion has length " + FormatDouble(norm) + ", must be 1");
    }
    if (i > 0 && series.base_T_frame[i - 1].rotation.dot(pose.rotation) < 0) {
      return At(stream, i, "the quaternion flips its sign");
    }
  }
  return CheckTimes(stream, series.time_s);
}

Status CheckGroup(const std::string& kind, const std::vector<PoseSeries>& group) {
  std::set<std::string> names;
  for (const PoseSeries& series : group) {
    const std::string stream = series.name.empty() ? kind : kind + " " + series.name;
    if (!names.insert(series.name).second) {
      return InvalidArgument(stream + ": stands twice", stream);
    }
    if (const Status poses = CheckPoses(stream, series); !poses.ok()) return poses;
  }
  return {};
}

bool Same(const ScalarSeries& a, const ScalarSeries& b) {
  if (a.empty() && b.empty()) return true;
  return a.names == b.names && a.time_s == b.time_s && a.values.rows() == b.values.rows() &&
         a.values.cols() == b.values.cols() && a.values == b.values;
}

bool Same(const PoseSeries& a, const PoseSeries& b) {
  if (a.name != b.name || a.has_orientation != b.has_orientation || a.time_s != b.time_s ||
      a.base_T_frame.size() != b.base_T_frame.size()) {
    return false;
  }
  for (std::size_t i = 0; i < a.base_T_frame.size(); ++i) {
    const geometry::Pose& p = a.base_T_frame[i];
    const geometry::Pose& q = b.base_T_frame[i];
    if (p.translation != q.translation || p.rotation.coeffs() != q.rotation.coeffs()) return false;
  }
  return true;
}

bool Same(const std::vector<PoseSeries>& a, const std::vector<PoseSeries>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const PoseSeries& x, const PoseSeries& y) { return Same(x, y); });
}

}  // namespace

double Trial::duration_s() const {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  const auto extend = [&](const std::vector<double>& time_s) {
    if (time_s.empty()) return;
    first = std::min(first, time_s.front());
    last = std::max(last, time_s.back());
  };
  extend(joints.time_s);
  for (const PoseSeries& hand : end_effectors) extend(hand.time_s);
  return last >= first ? last - first : 0;
}

const PoseSeries* Trial::FindObject(std::string_view name) const {
  const auto found = std::find_if(objects.begin(), objects.end(),
                                  [&](const PoseSeries& object) { return object.name == name; });
  return found == objects.end() ? nullptr : &*found;
}

Status Validate(const Trial& trial) {
  const std::pair<const char*, const ScalarSeries*> scalars[] = {
      {"joints", &trial.joints}, {"measured joints", &trial.measured_joints},
      {"hands", &trial.hands},   {"tactile", &trial.tactile},
      {"wrench", &trial.wrench}, {"label", &trial.label}};
  for (const auto& [stream, series] : scalars) {
    if (const Status checked = CheckScalars(stream, *series); !checked.ok()) return checked;
  }
  if (const Status hands = CheckGroup("end effector", trial.end_effectors); !hands.ok()) {
    return hands;
  }
  if (const Status objects = CheckGroup("object", trial.objects); !objects.ok()) return objects;
  for (const PoseSeries& object : trial.objects) {
    if (object.name.empty()) return InvalidArgument("object: has no name", "object");
  }
  for (const std::string& joint : trial.prismatic_joints) {
    if (std::find(trial.joints.names.begin(), trial.joints.names.end(), joint) ==
        trial.joints.names.end()) {
      return InvalidArgument("prismatic_joints: \"" + joint + "\" is no joint of the trial",
                             "prismatic_joints");
    }
  }
  if (trial.joints.empty() && std::all_of(trial.end_effectors.begin(), trial.end_effectors.end(),
                                          [](const PoseSeries& hand) { return hand.empty(); })) {
    return InvalidArgument("the trial has neither joints nor an end effector", "joints");
  }
  return {};
}

bool SameContent(const Trial& a, const Trial& b) {
  return Same(a.joints, b.joints) && a.prismatic_joints == b.prismatic_joints &&
         Same(a.measured_joints, b.measured_joints) && Same(a.end_effectors, b.end_effectors) &&
         Same(a.objects, b.objects) && Same(a.hands, b.hands) && Same(a.tactile, b.tactile) &&
         Same(a.wrench, b.wrench) && Same(a.label, b.label);
}

}  // namespace exemplar::demonstration
