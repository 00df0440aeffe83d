#include "trial_checks.hpp"

#include <algorithm>

#include "exemplar/base/text.hpp"

namespace exemplar::learning {
namespace {

std::string NameOf(const NamedTrial& named) {
  return named.id.empty() ? named.trial.source : named.id;
}

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string Quoted(const std::vector<std::string>& names) {
  if (names.empty()) return "none";
  return "\"" + Join(names, "\", \"") + "\"";
}

// Joints in the order of `names`. Precondition: the trial has them all.
void OrderJoints(UniformTrial& trial, const std::vector<std::string>& names) {
  if (trial.joint_names == names) return;
  Eigen::MatrixXd ordered(trial.joints.rows(), static_cast<Eigen::Index>(names.size()));
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto at = std::find(trial.joint_names.begin(), trial.joint_names.end(), names[k]);
    ordered.col(static_cast<Eigen::Index>(k)) = trial.joints.col(at - trial.joint_names.begin());
  }
  trial.joints = std::move(ordered);
  trial.joint_names = names;
}

void KeepObjects(UniformTrial& trial, const std::vector<std::string>& names) {
  std::vector<PosePath> paths;
  std::vector<bool> has_orientation;
  for (const std::string& name : names) {
    const auto at = static_cast<std::size_t>(
        std::find(trial.object_names.begin(), trial.object_names.end(), name) -
        trial.object_names.begin());
    paths.push_back(std::move(trial.base_T_object[at]));
    has_orientation.push_back(trial.object_has_orientation[at]);
  }
  trial.object_names = names;
  trial.base_T_object = std::move(paths);
  trial.object_has_orientation = std::move(has_orientation);
}

Status CheckJoints(std::vector<UniformTrial>& trials, const demonstration::ToolKinematics* tool) {
  const UniformTrial& first = trials.front();
  for (UniformTrial& trial : trials) {
    for (const std::string& name : first.joint_names) {
      if (!Contains(trial.joint_names, name)) {
        return InvalidArgument("trial \"" + trial.id + "\" has no joint \"" + name +
                                   "\", which trial \"" + first.id + "\" has",
                               "trials");
      }
    }
    for (const std::string& name : trial.joint_names) {
      if (!Contains(first.joint_names, name)) {
        return InvalidArgument("trial \"" + trial.id + "\" has a joint \"" + name +
                                   "\", which trial \"" + first.id + "\" has not",
                               "trials");
      }
    }
    OrderJoints(trial, first.joint_names);
  }
  if (tool != nullptr && !first.joint_names.empty()) {
    for (const std::string& name : tool->joint_names()) {
      if (!Contains(first.joint_names, name)) {
        return InvalidArgument("the robot model's joint \"" + name +
                                   "\" is in no trial; the trials have " +
                                   Quoted(first.joint_names),
                               "trials");
      }
    }
  }
  return {};
}

Status CheckObjects(std::vector<UniformTrial>& trials, const LearnOptions& options,
                    std::vector<std::string>& warnings) {
  std::vector<std::string> all;
  for (const UniformTrial& trial : trials) {
    for (const std::string& name : trial.object_names) {
      if (!Contains(all, name)) all.push_back(name);
    }
  }
  if (!options.target.empty() && !Contains(all, options.target)) {
    std::string message =
        "no trial has object \"" + options.target + "\"; the trials have " + Quoted(all);
    if (const auto near = NearestName(options.target, all)) {
      message += "; did you mean \"" + *near + "\"?";
    }
    return InvalidArgument(message, "target");
  }
  std::vector<std::string> common;
  for (const std::string& name : all) {
    const auto lacks = std::find_if(trials.begin(), trials.end(), [&](const UniformTrial& t) {
      return !Contains(t.object_names, name);
    });
    if (lacks == trials.end()) {
      common.push_back(name);
    } else if (name == options.target || all.size() == 1) {
      return InvalidArgument(
          "trial \"" + lacks->id + "\" has no object \"" + name + "\", which others have",
          "trials");
    } else {
      warnings.push_back("object \"" + name + "\" is ignored: trial \"" + lacks->id +
                         "\" does not have it");
    }
  }
  if (common.empty() && !all.empty()) {
    return InvalidArgument("no object is in every trial; the trials have " + Quoted(all), "trials");
  }
  for (UniformTrial& trial : trials) KeepObjects(trial, common);
  return {};
}

}  // namespace

Result<std::vector<const NamedTrial*>> ChooseTrials(std::span<const NamedTrial> trials,
                                                    const LearnOptions& options,
                                                    std::vector<std::string>& warnings) {
  std::vector<std::string> names;
  for (const NamedTrial& named : trials) {
    names.push_back(named.id);
    names.push_back(named.trial.source);
  }
  for (const std::string& left_out : options.leave_out) {
    if (Contains(names, left_out)) continue;
    std::string message = "leave_out: no trial is called \"" + left_out + "\"";
    if (const auto near = NearestName(left_out, names)) {
      message += "; did you mean \"" + *near + "\"?";
    }
    return NotFound(message, "leave_out");
  }
  std::vector<const NamedTrial*> used;
  for (const NamedTrial& named : trials) {
    if (Contains(options.leave_out, named.id) || Contains(options.leave_out, named.trial.source)) {
      warnings.push_back("trial \"" + NameOf(named) + "\" was left out as asked");
      continue;
    }
    if (const Status valid = demonstration::Validate(named.trial); !valid.ok()) {
      return WithPlace(valid.error(), NameOf(named));
    }
    const auto same = std::find_if(used.begin(), used.end(), [&](const NamedTrial* other) {
      return demonstration::SameContent(other->trial, named.trial);
    });
    if (same != used.end()) {
      warnings.push_back("trial \"" + NameOf(named) + "\" is the same as \"" + NameOf(**same) +
                         "\" and counts once");
      continue;
    }
    used.push_back(&named);
  }
  if (used.empty()) return InvalidArgument("there is no trial to learn from", "trials");
  return used;
}

Status MakeUniform(std::vector<UniformTrial>& trials, const LearnOptions& options,
                   const demonstration::ToolKinematics* tool, std::vector<std::string>& warnings) {
  if (Status joints = CheckJoints(trials, tool); !joints.ok()) return joints;
  for (const UniformTrial& trial : trials) {
    if (trial.base_T_tool.empty() != trials.front().base_T_tool.empty()) {
      const bool lacks = trial.base_T_tool.empty();
      return InvalidArgument("trial \"" + (lacks ? trial.id : trials.front().id) +
                                 "\" has no end-effector poses, trial \"" +
                                 (lacks ? trials.front().id : trial.id) + "\" has",
                             "trials");
    }
  }
  if (Status objects = CheckObjects(trials, options, warnings); !objects.ok()) return objects;

  const auto hands = std::count_if(trials.begin(), trials.end(),
                                   [](const UniformTrial& t) { return !t.hand_open.empty(); });
  if (hands != 0 && hands != static_cast<std::ptrdiff_t>(trials.size())) {
    warnings.push_back("the hand's opening is ignored: only " + std::to_string(hands) + " of " +
                       std::to_string(trials.size()) + " trials have it");
    for (UniformTrial& trial : trials) trial.hand_open.clear();
  }
  return {};
}

}  // namespace exemplar::learning
