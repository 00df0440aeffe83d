#include "exemplars.hpp"

#include <algorithm>
#include <cmath>

#include "contact.hpp"
#include "exemplar/learning/hermite.hpp"
#include "exemplar/learning/objectivity.hpp"
#include "rewarp.hpp"

namespace exemplar::learning {
namespace {

// An object that stays within this part of the tool's extent rests.
constexpr double kRestingPart = 0.01;
constexpr double kRestingAngle = 0.05;  // rad

double ToolExtent(const UniformTrial& trial) {
  if (trial.base_T_tool.empty()) return 1;
  Eigen::Vector3d low = trial.base_T_tool[0].translation;
  Eigen::Vector3d high = low;
  for (const geometry::Pose& pose : trial.base_T_tool) {
    low = low.cwiseMin(pose.translation);
    high = high.cwiseMax(pose.translation);
  }
  return (high - low).norm();
}

bool Rests(const PosePath& path, double extent) {
  if (path.still()) return true;
  for (const geometry::Pose& pose : path) {
    if ((pose.translation - path[0].translation).norm() > kRestingPart * extent) return false;
    if (geometry::AngleBetween(pose.rotation, path[0].rotation) > kRestingAngle) return false;
  }
  return true;
}

geometry::Pose MeanPose(const PosePath& path) {
  if (path.still()) return path.front();
  geometry::Pose mean;
  std::vector<Eigen::Quaterniond> rotations;
  for (const geometry::Pose& pose : path) {
    mean.translation += pose.translation / static_cast<double>(path.size());
    rotations.push_back(pose.rotation);
  }
  mean.rotation = geometry::MeanRotation(rotations);
  return mean;
}

// From a contact's onset an object is carried or pushed by the tool: the tool's reference is where
// the object was at the onset. It moves on to the next contact's between the two.
std::vector<geometry::Pose> HoldDuringContacts(const std::vector<geometry::Pose>& path,
                                               const std::vector<ContactSpan>& contacts,
                                               int object) {
  std::vector<geometry::Pose> reference = path;
  const ContactSpan* before = nullptr;
  const int n = static_cast<int>(path.size());
  for (const ContactSpan& contact : contacts) {
    if (contact.object != object) continue;
    const geometry::Pose& onset = path[static_cast<std::size_t>(contact.first)];
    if (before != nullptr) {
      const geometry::Pose& held = reference[static_cast<std::size_t>(before->last)];
      const int gap = contact.first - before->last;
      for (int i = before->last + 1; i < contact.first; ++i) {
        const double s = static_cast<double>(i - before->last) / gap;
        reference[static_cast<std::size_t>(i)] =
            geometry::Interpolate(held, onset, s * s * (3 - 2 * s));
      }
    }
    for (int i = contact.first; i < n; ++i) reference[static_cast<std::size_t>(i)] = onset;
    before = &contact;
  }
  return reference;
}

// The object towards which the paths converge most, by the least ratio of variances.
int ChooseTarget(const Exemplars& exemplars) {
  if (exemplars.objects() <= 1 || !exemplars.has_tool || exemplars.size() < 2) {
    return exemplars.objects() > 0 ? 0 : -1;
  }
  std::vector<Eigen::MatrixXd> base;
  for (int j = 0; j < exemplars.size(); ++j) base.push_back(exemplars.BasePath(j));
  int best = 0;
  double best_gain = -1;
  for (int o = 0; o < exemplars.objects(); ++o) {
    std::vector<Eigen::MatrixXd> shifted;
    for (int j = 0; j < exemplars.size(); ++j) shifted.push_back(exemplars.ShiftedPath(j, o));
    const Objectivity objectivity = ComputeObjectivity(base, shifted, std::nullopt);
    const double gain = (objectivity.absolute_variance - objectivity.object_variance).maxCoeff();
    if (gain > best_gain) {
      best_gain = gain;
      best = o;
    }
  }
  return best;
}

std::vector<int> JointColumns(const UniformTrial& trial, const std::vector<std::string>& names) {
  std::vector<int> columns;
  for (const std::string& name : names) {
    const auto at = std::find(trial.joint_names.begin(), trial.joint_names.end(), name);
    columns.push_back(static_cast<int>(at - trial.joint_names.begin()));
  }
  return columns;
}

}  // namespace

Eigen::MatrixXd Exemplars::BasePath(int trial) const {
  Eigen::MatrixXd path(frames, 3);
  const std::vector<geometry::Pose>& poses = trials[static_cast<std::size_t>(trial)].tool;
  for (int i = 0; i < frames; ++i) {
    path.row(i) = poses[static_cast<std::size_t>(i)].translation.transpose();
  }
  return path;
}

Eigen::MatrixXd Exemplars::ShiftedPath(int trial, int object) const {
  Eigen::MatrixXd path = BasePath(trial);
  const ExemplarTrial& exemplar = trials[static_cast<std::size_t>(trial)];
  for (int i = 0; i < frames; ++i) {
    path.row(i) -= exemplar.ObjectAt(object, i).translation.transpose();
  }
  return path;
}

std::optional<int> Exemplars::FirstContact(int object) const {
  for (const ContactSpan& contact : contacts) {
    if (contact.object == object) return contact.first;
  }
  return std::nullopt;
}

Exemplars Exemplars::Without(int trial) const {
  Exemplars others = *this;
  others.trials.Remove(static_cast<std::size_t>(trial));
  return others;
}

Exemplars Exemplars::Only(std::span<const int> chosen) const {
  Exemplars few = *this;
  few.trials = {};
  for (const int trial : chosen) few.trials.Share(trials, static_cast<std::size_t>(trial));
  return few;
}

void Exemplars::KeepPathsOnly() {
  joint_names.clear();
  has_orientation = false;
  for (std::size_t j = 0; j < trials.size(); ++j) {
    ExemplarTrial& trial = trials.Edit(j);
    trial.joints.resize(frames, 0);
    trial.hand.resize(0);
    trial.touch_n.resize(0);
  }
}

void Exemplars::DropTimes() {
  for (std::size_t j = 0; j < trials.size(); ++j) {
    ExemplarTrial& trial = trials.Edit(j);
    trial.touch_n.resize(0);
    trial.own_time.resize(0);
  }
}

Exemplars Exemplars::SituationsOnly() const {
  Exemplars situations = *this;
  for (std::size_t j = 0; j < trials.size(); ++j) {
    ExemplarTrial situation;
    situation.situation = trials[j].situation;
    situation.own_contacts = trials[j].own_contacts;
    situation.moving.resize(object_names.size());
    if (j == 0) situation.tool = trials[j].tool;
    situations.trials.Replace(j, std::move(situation));
  }
  return situations;
}

Exemplars BuildExemplars(const Alignment& alignment, const std::string& target,
                         const demonstration::ToolKinematics* tool) {
  const UniformTrial& first = alignment.trials.front().own;
  Exemplars exemplars;
  exemplars.frames = static_cast<int>(alignment.time_s.size());
  exemplars.object_names = first.object_names;
  exemplars.object_has_orientation.assign(first.object_names.size(), true);
  exemplars.joint_names =
      tool != nullptr && !first.joint_names.empty() ? tool->joint_names() : first.joint_names;
  exemplars.has_tool = !first.base_T_tool.empty();
  for (std::size_t j = 0; j < alignment.trials.size(); ++j) {
    const AlignedTrial& aligned = alignment.trials[j];
    UniformTrial warped = Warped(alignment, j);
    exemplars.has_orientation = exemplars.has_orientation && warped.has_orientation;
    ExemplarTrial trial;
    const double extent = ToolExtent(warped);
    const std::vector<int> columns = JointColumns(warped, exemplars.joint_names);
    if (warped.joint_names == exemplars.joint_names) {
      trial.joints = std::move(warped.joints);
    } else {
      trial.joints.resize(exemplars.frames, exemplars.joints());
      for (int k = 0; k < exemplars.joints(); ++k) {
        trial.joints.col(k) = warped.joints.col(columns[static_cast<std::size_t>(k)]);
      }
    }
    trial.hand = Eigen::Map<const Eigen::VectorXd>(
        warped.hand_open.data(), static_cast<Eigen::Index>(warped.hand_open.size()));
    trial.touch_n = std::move(warped.touch_n);
    const MonotoneHermite own_at(alignment.knots_s, aligned.own_knots_s);
    trial.own_time.resize(exemplars.frames);
    for (int i = 0; i < exemplars.frames; ++i) {
      trial.own_time[i] =
          own_at(alignment.time_s[static_cast<std::size_t>(i)]) / aligned.own_knots_s.back();
    }
    if (exemplars.has_tool) trial.situation.base_T_start = warped.base_T_tool.front();
    trial.tool = std::move(warped.base_T_tool);
    for (std::size_t o = 0; o < exemplars.object_names.size(); ++o) {
      const auto at =
          static_cast<std::size_t>(std::find(warped.object_names.begin(), warped.object_names.end(),
                                             exemplars.object_names[o]) -
                                   warped.object_names.begin());
      const PosePath& path = warped.base_T_object[at];
      if (!warped.object_has_orientation[at]) exemplars.object_has_orientation[o] = false;
      const bool rests = Rests(path, extent);
      trial.situation.base_T_object.push_back(rests ? MeanPose(path) : path.front());
      trial.moving.push_back(rests ? std::vector<geometry::Pose>{}
                                   : static_cast<std::vector<geometry::Pose>>(path));
    }
    exemplars.trials.Add(std::move(trial));
  }
  exemplars.target = ChooseTarget(exemplars);
  for (int o = 0; o < exemplars.objects(); ++o) {
    if (exemplars.object_names[static_cast<std::size_t>(o)] == target) exemplars.target = o;
  }
  AlignTouches(exemplars);
  FindContacts(alignment, exemplars);
  for (std::size_t j = 0; j < exemplars.trials.size(); ++j) {
    ExemplarTrial& trial = exemplars.trials.Edit(j);
    for (int o = 0; o < exemplars.objects(); ++o) {
      std::vector<geometry::Pose>& path = trial.moving[static_cast<std::size_t>(o)];
      if (path.empty()) continue;
      const std::optional<int> contact = exemplars.FirstContact(o);
      trial.situation.base_T_object[static_cast<std::size_t>(o)] =
          contact.has_value() ? path[static_cast<std::size_t>(*contact)] : path.back();
      path = HoldDuringContacts(path, exemplars.contacts, o);
    }
  }
  return exemplars;
}

}  // namespace exemplar::learning
