#include <algorithm>
#include <cmath>

#include "exemplar/base/text.hpp"
#include "exemplar/learning/skill.hpp"
#include "hull.hpp"
#include "skill_data.hpp"

namespace exemplar::learning {
namespace {

// An object further outside the trials' hull than this part of the hull's extent (or of the
// motion's extent, where all trials had one place) is far.
constexpr double kFarPart = 0.5;

// Nothing that a robot reaches for is further (m), nor turned so often (rad): sums of squares stay
// finite and small numbers beside them are kept.
constexpr double kFarthest_m = 1e4;
constexpr double kFurthestTurn_rad = 1e4;

Status CheckPosition(const Eigen::Vector3d& position, const std::string& what,
                     const std::string& field) {
  if (!position.allFinite()) return InvalidArgument(what + " is not finite", field);
  for (const double value : position) {
    if (std::abs(value) > kFarthest_m) {
      return InvalidArgument(what + " has coordinate " + FormatDouble(value) + " m, beyond " +
                                 FormatDouble(kFarthest_m) + " m",
                             field);
    }
  }
  return {};
}

std::string Metres(double value) { return FormatFixed(value, 3) + " m"; }

std::string Place(std::size_t index) { return "objects[" + std::to_string(index) + "]"; }

Status CheckQuery(const Exemplars& exemplars, const demonstration::SkillQuery& query) {
  for (std::size_t i = 0; i < query.objects.size(); ++i) {
    const geometry::NamedPose& object = query.objects[i];
    const auto at =
        std::find(exemplars.object_names.begin(), exemplars.object_names.end(), object.name);
    if (at == exemplars.object_names.end()) {
      std::string message = "the skill knows no object \"" + object.name + "\"";
      if (exemplars.object_names.empty()) {
        message += "; its trials held none";
      } else if (const auto near = NearestName(object.name, exemplars.object_names)) {
        message += "; did you mean \"" + *near + "\"?";
      } else {
        message += "; it knows \"" + Join(exemplars.object_names, "\", \"") + "\"";
      }
      return NotFound(message, Place(i) + ".name");
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (query.objects[k].name == object.name) {
        return InvalidArgument("object \"" + object.name + "\" is given twice", Place(i) + ".name");
      }
    }
    if (Status good =
            CheckPosition(object.base_T_object.translation,
                          "object \"" + object.name + "\": its position", Place(i) + ".position");
        !good.ok()) {
      return good;
    }
    const double norm = object.base_T_object.rotation.norm();
    if (object.has_orientation && !(std::abs(norm - 1) < 1e-3)) {
      return InvalidArgument("object \"" + object.name + "\": its quaternion has length " +
                                 FormatDouble(norm) + ", must be 1",
                             Place(i) + ".orientation");
    }
  }
  if (query.start.has_value()) {
    if (Status good = CheckPosition(query.start->translation, "the start position", "start");
        !good.ok()) {
      return good;
    }
    if (query.start_has_orientation && !(std::abs(query.start->rotation.norm() - 1) < 1e-3)) {
      return InvalidArgument("the start's quaternion has length " +
                                 FormatDouble(query.start->rotation.norm()) + ", must be 1",
                             "start");
    }
  }
  return {};
}

// Extent of the tool's motion over all trials, for a sense of scale.
double MotionExtent(const Exemplars& exemplars) {
  if (!exemplars.has_tool) return 1;
  const Eigen::MatrixXd path = exemplars.BasePath(0);
  return (path.colwise().maxCoeff() - path.colwise().minCoeff()).norm();
}

Eigen::MatrixXd ObjectPositions(const Exemplars& exemplars, std::size_t object) {
  Eigen::MatrixXd positions(exemplars.size(), 3);
  for (int j = 0; j < exemplars.size(); ++j) {
    positions.row(j) = exemplars.trials[static_cast<std::size_t>(j)]
                           .situation.base_T_object[object]
                           .translation.transpose();
  }
  return positions;
}

void WarnWhenFar(const Exemplars& exemplars, std::size_t object, const Eigen::Vector3d& position,
                 std::vector<std::string>& warnings) {
  const Eigen::MatrixXd positions = ObjectPositions(exemplars, object);
  double extent = (positions.colwise().maxCoeff() - positions.colwise().minCoeff()).norm();
  // The hull is no further than the nearest trial.
  const double nearest = (positions.rowwise() - position.transpose()).rowwise().norm().minCoeff();
  if (nearest <= kFarPart * extent) return;
  const double distance = DistanceFromHull(positions, position);
  if (distance <= kFarPart * extent) return;
  const bool one_place = extent < 0.05 * MotionExtent(exemplars);
  if (one_place) extent = 0.5 * MotionExtent(exemplars);
  if (distance <= kFarPart * extent) return;
  warnings.push_back("object \"" + exemplars.object_names[object] + "\" is " + Metres(distance) +
                     " outside " +
                     (one_place ? std::string("the one place where the trials had it")
                                : "the trials' places, which span " + Metres(extent)) +
                     ": the answer is far extrapolation");
}

// Joint values in the skill's order, or an error.
Result<std::optional<Eigen::VectorXd>> JointStart(const Exemplars& exemplars,
                                                  const demonstration::SkillQuery& query) {
  if (!query.joint_start.has_value() || exemplars.joints() == 0) {
    return std::optional<Eigen::VectorXd>();
  }
  const Eigen::VectorXd& given = *query.joint_start;
  if (!given.allFinite()) return InvalidArgument("joint_start is not finite", "joint_start");
  for (const double value : given) {
    if (std::abs(value) > kFurthestTurn_rad) {
      return InvalidArgument("joint_start holds " + FormatDouble(value) + ", beyond " +
                                 FormatDouble(kFurthestTurn_rad),
                             "joint_start");
    }
  }
  if (query.joint_start_names.empty()) {
    if (given.size() != exemplars.joints()) {
      return InvalidArgument("joint_start has " + std::to_string(given.size()) +
                                 " values, the skill has " + std::to_string(exemplars.joints()) +
                                 " joints",
                             "joint_start");
    }
    return std::optional<Eigen::VectorXd>(given);
  }
  if (static_cast<Eigen::Index>(query.joint_start_names.size()) != given.size()) {
    return InvalidArgument("joint_start has " + std::to_string(given.size()) + " values for " +
                               std::to_string(query.joint_start_names.size()) + " names",
                           "joint_start");
  }
  Eigen::VectorXd ordered(exemplars.joints());
  for (int k = 0; k < exemplars.joints(); ++k) {
    const std::string& name = exemplars.joint_names[static_cast<std::size_t>(k)];
    const auto at = std::find(query.joint_start_names.begin(), query.joint_start_names.end(), name);
    if (at == query.joint_start_names.end()) {
      return InvalidArgument("joint_start lacks joint \"" + name + "\"", "joint_start");
    }
    ordered[k] = given[at - query.joint_start_names.begin()];
  }
  return std::optional<Eigen::VectorXd>(ordered);
}

}  // namespace

Result<demonstration::SkillMotion> Answer(const Skill& skill,
                                          const demonstration::SkillQuery& query) {
  const Skill::Data& data = skill.data();
  const Exemplars& exemplars = *data.exemplars;
  if (const Status good = CheckQuery(exemplars, query); !good.ok()) return good.error();
  Result<std::optional<Eigen::VectorXd>> joint_start = JointStart(exemplars, query);
  if (!joint_start.ok()) return joint_start.error();

  demonstration::SkillMotion motion;
  motion.skill = data.report.skill;
  motion.version = data.report.version;
  Situation situation;
  for (std::size_t o = 0; o < exemplars.object_names.size(); ++o) {
    const std::string& name = exemplars.object_names[o];
    const auto asked =
        std::find_if(query.objects.begin(), query.objects.end(),
                     [&](const geometry::NamedPose& object) { return object.name == name; });
    geometry::NamedPose object{.name = name, .base_T_object = {}, .has_orientation = true};
    if (asked == query.objects.end()) {
      if (static_cast<int>(o) == exemplars.target) {
        return InvalidArgument("the query lacks object \"" + name + "\", which the skill is about",
                               "objects");
      }
      object.base_T_object.translation = ObjectPositions(exemplars, o).colwise().mean().transpose();
      object.base_T_object.rotation = data.mean_object_rotation[o];
      motion.warnings.push_back("object \"" + name +
                                "\" was not given: the trials' mean pose is assumed");
    } else {
      object.base_T_object = asked->base_T_object;
      if (!asked->has_orientation || !exemplars.object_has_orientation[o]) {
        object.base_T_object.rotation = data.mean_object_rotation[o];
        if (exemplars.object_has_orientation[o]) {
          motion.warnings.push_back("object \"" + name +
                                    "\" was given without orientation: the trials' mean "
                                    "orientation is assumed");
        }
      } else {
        object.base_T_object.rotation.normalize();
      }
      WarnWhenFar(exemplars, o, object.base_T_object.translation, motion.warnings);
    }
    situation.base_T_object.push_back(object.base_T_object);
    motion.objects.push_back(std::move(object));
  }
  if (query.start.has_value() && exemplars.has_tool) {
    situation.base_T_start = query.start;
    situation.start_has_orientation = query.start_has_orientation;
  }
  situation.joint_start = std::move(*joint_start);
  // Beside where the tool starts it says the same once more, as executors do for any skill.
  if (query.joint_start.has_value() && exemplars.joints() == 0 &&
      !situation.base_T_start.has_value()) {
    motion.warnings.push_back("joint_start is not used: the skill has no joints");
  }
  if (situation.joint_start.has_value() && !situation.base_T_start.has_value() &&
      data.tool != nullptr && exemplars.has_tool) {
    situation.base_T_start = data.tool->ToolPose(*situation.joint_start);
  }

  Prediction prediction = data.model->Predict(situation);
  motion.time_s = data.alignment->time_s;
  motion.joint_names = exemplars.joint_names;
  motion.joints = std::move(prediction.joints);
  motion.base_T_tool = std::move(prediction.tool);
  motion.has_orientation = exemplars.has_orientation;
  motion.hand_open.assign(prediction.hand.begin(), prediction.hand.end());
  motion.object_names = exemplars.object_names;
  motion.objectivity = std::move(prediction.objectivity);
  motion.sigma_m.assign(prediction.sigma_m.begin(), prediction.sigma_m.end());
  motion.markers_s = data.alignment->markers_s;
  motion.warnings.insert(motion.warnings.end(), prediction.warnings.begin(),
                         prediction.warnings.end());
  for (std::size_t k = 0; k < exemplars.contacts.size(); ++k) {
    const ContactSpan& span = exemplars.contacts[k];
    const geometry::Pose& base_T_object =
        situation.base_T_object[static_cast<std::size_t>(span.object)];
    const ContactPoint& point = data.contact_points[k];
    motion.contacts.push_back(
        {.object = exemplars.object_names[static_cast<std::size_t>(span.object)],
         .first = span.first,
         .last = span.last,
         .base_p_contact = prediction.contact_points.size() > k ? prediction.contact_points[k]
                                                                : point.At(base_T_object),
         .touch_measured = span.touch_measured});
  }
  return motion;
}

}  // namespace exemplar::learning
