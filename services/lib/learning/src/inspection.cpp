#include "exemplar/learning/inspection.hpp"

#include <algorithm>
#include <cmath>

#include "paper_model.hpp"
#include "skill_data.hpp"

namespace exemplar::learning {
namespace {

std::string ObstacleOf(const Exemplars& exemplars) {
  if (!exemplars.has_tool) {
    return "the trials have joints but no end-effector poses, and the learning service was started "
           "without the robot model that would give them";
  }
  if (exemplars.target < 0) return "the trials hold no object";
  return {};
}

// The paper's method on the skill's trials, whatever method the skill itself uses.
class PaperView {
 public:
  explicit PaperView(const Skill& skill)
      : skill_(skill),
        exemplars_(
            BuildExemplars(skill.alignment(), skill.report().target, skill.data().tool.get())),
        obstacle_(ObstacleOf(exemplars_)) {
    if (!obstacle_.empty()) return;
    model_.emplace(exemplars_, skill.data().tool);
    const auto target = static_cast<std::size_t>(exemplars_.target);
    Eigen::MatrixXd positions(exemplars_.size(), 3);
    for (int j = 0; j < exemplars_.size(); ++j) {
      const ExemplarTrial& trial = exemplars_.trials[static_cast<std::size_t>(j)];
      base_T_target_.push_back(trial.situation.base_T_object[target]);
      positions.row(j) = base_T_target_.back().translation.transpose();
      base_paths_.push_back(exemplars_.BasePath(j));
      object_paths_.push_back(exemplars_.ShiftedPath(j, exemplars_.target));
    }
    rbf_.emplace(positions, RbfOptions{.trend = Trend::kAffine, .ridge = 0});
    objectivity_ =
        ComputeObjectivity(base_paths_, object_paths_, exemplars_.FirstContact(exemplars_.target));
    FindContact();
  }

  const Exemplars& exemplars() const { return exemplars_; }
  const std::string& obstacle() const { return obstacle_; }
  const PaperModel& model() const { return *model_; }
  const std::vector<Eigen::MatrixXd>& base_paths() const { return base_paths_; }
  const std::vector<Eigen::MatrixXd>& object_paths() const { return object_paths_; }
  const std::vector<geometry::Pose>& base_T_target() const { return base_T_target_; }
  const Objectivity& objectivity() const { return objectivity_; }
  int contact_frame() const { return contact_frame_; }
  bool contact_found() const { return contact_found_; }

  Eigen::VectorXd Weights(const Eigen::Vector3d& position) const { return rbf_->Weights(position); }

  // The target at `position`, turned as in the trials' mean; other objects at their mean places.
  demonstration::SkillQuery QueryAt(const Eigen::Vector3d& position) const {
    demonstration::SkillQuery query;
    for (std::size_t o = 0; o < exemplars_.object_names.size(); ++o) {
      geometry::NamedPose object{.name = exemplars_.object_names[o], .base_T_object = {}};
      object.base_T_object.rotation = skill_.data().mean_object_rotation[o];
      for (const ExemplarTrial& trial : exemplars_.trials) {
        object.base_T_object.translation +=
            trial.situation.base_T_object[o].translation / exemplars_.size();
      }
      if (static_cast<int>(o) == exemplars_.target) object.base_T_object.translation = position;
      query.objects.push_back(std::move(object));
    }
    return query;
  }

  Eigen::Vector3d ContactPointAt(const geometry::Pose& base_T_target) const {
    return contact_.At(base_T_target);
  }

  Situation SituationOf(const demonstration::SkillQuery& query) const {
    Situation situation;
    for (const geometry::NamedPose& object : query.objects) {
      situation.base_T_object.push_back(object.base_T_object);
    }
    return situation;
  }

  Eigen::MatrixXd Objective(const Eigen::Vector3d& position) const {
    const Eigen::VectorXd weights = Weights(position);
    Eigen::MatrixXd path = position.transpose().replicate(exemplars_.frames, 1);
    for (std::size_t j = 0; j < object_paths_.size(); ++j) {
      path += weights[static_cast<Eigen::Index>(j)] * object_paths_[j];
    }
    return path;
  }

  // Of the joint-wise solution at the contact frame alone.
  Eigen::Vector3d AbsoluteAtContact(const Eigen::VectorXd& weights) const {
    Eigen::VectorXd joints = Eigen::VectorXd::Zero(exemplars_.joints());
    Eigen::Vector3d tool = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < base_paths_.size(); ++j) {
      const double weight = weights[static_cast<Eigen::Index>(j)];
      tool += weight * base_paths_[j].row(contact_frame_).transpose();
      joints += weight * exemplars_.trials[j].joints.row(contact_frame_).transpose();
    }
    return model_->through_joints() ? skill_.data().tool->ToolPose(joints).translation : tool;
  }
  Eigen::Vector3d BlendedAtContact(const Eigen::VectorXd& weights, const Eigen::Vector3d& position,
                                   const Eigen::Vector3d& absolute) const {
    Eigen::Vector3d objective = position;
    for (std::size_t j = 0; j < object_paths_.size(); ++j) {
      objective +=
          weights[static_cast<Eigen::Index>(j)] * object_paths_[j].row(contact_frame_).transpose();
    }
    return absolute + objectivity_.upsilon[contact_frame_] * (objective - absolute);
  }

 private:
  void FindContact() {
    ContactSpan span{.object = exemplars_.target, .first = 0, .last = 0, .touch_measured = false};
    for (const ContactSpan& found : exemplars_.contacts) {
      if (found.object != exemplars_.target) continue;
      span = found;
      contact_found_ = true;
      break;
    }
    if (!contact_found_) {
      Eigen::Index frame = 0;
      objectivity_.upsilon.maxCoeff(&frame);
      span.first = span.last = span.meets = static_cast<int>(frame);
    }
    contact_frame_ = span.meets;
    contact_ = MeanContactPoint(exemplars_, span);
  }

  const Skill& skill_;
  Exemplars exemplars_;
  std::string obstacle_;
  std::optional<PaperModel> model_;
  std::optional<CardinalRbf> rbf_;
  std::vector<Eigen::MatrixXd> base_paths_, object_paths_;
  std::vector<geometry::Pose> base_T_target_;
  Objectivity objectivity_;
  ContactPoint contact_;
  int contact_frame_ = 0;
  bool contact_found_ = false;
};

Eigen::MatrixXd Positions(const std::vector<geometry::Pose>& poses) {
  Eigen::MatrixXd positions(static_cast<Eigen::Index>(poses.size()), 3);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    positions.row(static_cast<Eigen::Index>(i)) = poses[i].translation.transpose();
  }
  return positions;
}

InspectedQuery QueryPaths(const Skill& skill, const PaperView& view,
                          const Eigen::Vector3d& position) {
  const demonstration::SkillQuery query = view.QueryAt(position);
  const Situation situation = view.SituationOf(query);
  InspectedQuery result;
  result.base_T_target =
      query.objects[static_cast<std::size_t>(view.exemplars().target)].base_T_object;
  result.base_p_contact = view.ContactPointAt(result.base_T_target);
  result.absolute = Positions(view.model().AbsolutePath(situation));
  result.objective = view.Objective(position);
  result.blended = Positions(view.model().Predict(situation).tool);
  if (const auto motion = Answer(skill, query)) result.answer = Positions(motion->base_T_tool);
  return result;
}

struct Box {
  Eigen::Vector3d low, high;
  double extent() const { return std::max(high.x() - low.x(), high.y() - low.y()); }
};

// Around the trials' places of the target; around the motion where they are (nearly) one.
Box PlacesBox(const PaperView& view) {
  const Eigen::MatrixXd places = Positions(view.base_T_target());
  Box box{places.colwise().minCoeff().transpose(), places.colwise().maxCoeff().transpose()};
  const Eigen::MatrixXd& path = view.base_paths()[0];
  const double motion = (path.colwise().maxCoeff() - path.colwise().minCoeff()).norm();
  const double least = std::max(0.1 * motion, 1e-3);
  for (int axis = 0; axis < 2; ++axis) {
    const double lack = least - (box.high[axis] - box.low[axis]);
    if (lack > 0) {
      box.low[axis] -= lack / 2;
      box.high[axis] += lack / 2;
    }
  }
  return box;
}

// The corner of the places' box, at their mean height, that is farthest from every trial: there the
// methods differ most while the place is still an ordinary one.
Eigen::Vector3d PlaceOfNoTrial(const PaperView& view) {
  const Eigen::MatrixXd places = Positions(view.base_T_target());
  const Box box = PlacesBox(view);
  Eigen::Vector3d best = box.low;
  double best_distance = -1;
  for (const double x : {box.low.x(), box.high.x()}) {
    for (const double y : {box.low.y(), box.high.y()}) {
      const Eigen::Vector3d corner(x, y, places.col(2).mean());
      const double distance = (places.rowwise() - corner.transpose()).rowwise().norm().minCoeff();
      if (distance > best_distance) {
        best_distance = distance;
        best = corner;
      }
    }
  }
  return best;
}

std::vector<double> Spread(double low, double high, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(low + (high - low) * i / std::max(count - 1, 1));
  return values;
}

// Where the skill's own answer meets the target first: its alignment is not the paper's.
struct AnswerContact {
  std::size_t frame = 0;
  std::optional<ContactPoint> point;  // nullopt: as the paper's
};

AnswerContact FindAnswerContact(const Skill& skill, const PaperView& view) {
  const Skill::Data& data = skill.data();
  for (std::size_t k = 0; k < data.exemplars->contacts.size(); ++k) {
    const ContactSpan& contact = data.exemplars->contacts[k];
    if (contact.object != data.exemplars->target) continue;
    return {static_cast<std::size_t>(contact.first), data.contact_points[k]};
  }
  return {static_cast<std::size_t>(view.contact_frame()), std::nullopt};
}

ContactErrorMap MapErrors(const Skill& skill, const PaperView& view,
                          const InspectOptions& options) {
  const Box box = PlacesBox(view);
  const double margin = options.map_margin * box.extent();
  ContactErrorMap map;
  map.x_m = Spread(box.low.x() - margin, box.high.x() + margin, options.map_columns);
  map.y_m = Spread(box.low.y() - margin, box.high.y() + margin, options.map_rows);
  map.z_m = Positions(view.base_T_target()).col(2).mean();
  const auto rows = static_cast<Eigen::Index>(map.y_m.size());
  const auto columns = static_cast<Eigen::Index>(map.x_m.size());
  map.absolute = map.blended = map.answer = Eigen::MatrixXd::Zero(rows, columns);
  const bool paper = skill.report().method == "paper";
  const AnswerContact answer = FindAnswerContact(skill, view);
  for (Eigen::Index r = 0; r < rows; ++r) {
    for (Eigen::Index c = 0; c < columns; ++c) {
      const Eigen::Vector3d position(map.x_m[static_cast<std::size_t>(c)],
                                     map.y_m[static_cast<std::size_t>(r)], map.z_m);
      const demonstration::SkillQuery query = view.QueryAt(position);
      const geometry::Pose& target =
          query.objects[static_cast<std::size_t>(view.exemplars().target)].base_T_object;
      const Eigen::Vector3d contact = view.ContactPointAt(target);
      const Eigen::VectorXd weights = view.Weights(position);
      const Eigen::Vector3d absolute = view.AbsoluteAtContact(weights);
      const Eigen::Vector3d blended = view.BlendedAtContact(weights, position, absolute);
      map.absolute(r, c) = (absolute - contact).norm();
      map.blended(r, c) = (blended - contact).norm();
      map.answer(r, c) = map.blended(r, c);
      if (paper) continue;
      if (const auto motion = Answer(skill, query)) {
        const Eigen::Vector3d tool = motion->base_T_tool[answer.frame].translation;
        map.answer(r, c) = (tool - (answer.point ? answer.point->At(target) : contact)).norm();
      }
    }
  }
  return map;
}

}  // namespace

std::optional<InspectedQuery> InspectAt(const Skill& skill, const Eigen::Vector3d& position) {
  const PaperView view(skill);
  if (!view.obstacle().empty()) return std::nullopt;
  return QueryPaths(skill, view, position);
}

Inspection Inspect(const Skill& skill, const InspectOptions& options) {
  const PaperView view(skill);
  Inspection inspection;
  inspection.obstacle = view.obstacle();
  if (!inspection.obstacle.empty()) {
    for (int j = 0; view.exemplars().has_tool && j < view.exemplars().size(); ++j) {
      inspection.base_paths.push_back(view.exemplars().BasePath(j));
    }
    return inspection;
  }
  inspection.through_joints = view.model().through_joints();
  inspection.base_paths = view.base_paths();
  inspection.object_paths = view.object_paths();
  inspection.base_T_target = view.base_T_target();
  inspection.objectivity = view.objectivity();
  for (const ContactSpan& contact : view.exemplars().contacts) {
    if (contact.object != view.exemplars().target) continue;
    inspection.contacts.push_back({contact.first, contact.last});
  }
  inspection.contact_frame = view.contact_frame();
  inspection.contact_found = view.contact_found();
  inspection.query = QueryPaths(skill, view, PlaceOfNoTrial(view));
  inspection.map = MapErrors(skill, view, options);
  return inspection;
}

}  // namespace exemplar::learning
