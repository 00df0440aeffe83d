#include "frames_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "block_kriging.hpp"
#include "exemplar/learning/objectivity.hpp"
#include "freed_memory.hpp"
#include "rotations.hpp"

namespace exemplar::learning {
namespace {

// Contacts found without touch are an equality where the trials rest and the mean contact point
// predicts left-out trials clearly better than the path does: by this part, to this length. Where
// it is not, drawing the path to the point spoils the way there.
constexpr double kClearlyCloser = 0.8;
constexpr double kExact_m = 1e-4;

double Smoothstep(double s) {
  const double x = std::clamp(s, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

// Trend and ridge of the joints' interpolation by closed-form leave-one-out error.
CardinalRbf ChooseStyle(const Exemplars& exemplars) {
  const int width = exemplars.target < 0 ? 0 : 3;
  Eigen::MatrixXd positions(exemplars.size(), width);
  for (int j = 0; j < exemplars.size() && width > 0; ++j) {
    positions.row(j) = exemplars.trials[static_cast<std::size_t>(j)]
                           .situation.base_T_object[static_cast<std::size_t>(exemplars.target)]
                           .translation.transpose();
  }
  // One row a trial; every tenth frame tells enough.
  const std::vector<int> chosen = EvenChoice(exemplars.size(), kMostForChoice);
  const int step = std::max(1, exemplars.frames / 60);
  const int rows = (exemplars.frames + step - 1) / step;
  Eigen::MatrixXd samples(static_cast<Eigen::Index>(chosen.size()), rows * exemplars.joints());
  Eigen::MatrixXd places(samples.rows(), width);
  for (Eigen::Index j = 0; j < samples.rows(); ++j) {
    const int at = chosen[static_cast<std::size_t>(j)];
    const ExemplarTrial& trial = exemplars.trials[static_cast<std::size_t>(at)];
    places.row(j) = positions.row(at);
    for (int k = 0; k < exemplars.joints(); ++k) {
      for (int r = 0; r < rows; ++r) samples(j, k * rows + r) = trial.joints(r * step, k);
    }
  }
  RbfOptions best{.trend = Trend::kConstant, .ridge = 0.1};
  double least = std::numeric_limits<double>::infinity();
  if (samples.cols() > 0 && exemplars.size() > 2) {
    for (const Trend trend : {Trend::kConstant, Trend::kAffine}) {
      for (const double ridge : {0.0, 0.1, 1.0}) {
        const RbfOptions options{.trend = trend, .ridge = ridge};
        const double error = CardinalRbf(places, options).LeaveOneOut(samples).squaredNorm();
        if (error < least * (1 - 1e-6)) {
          least = error;
          best = options;
        }
      }
    }
  }
  return CardinalRbf(positions, best);
}

Eigen::VectorXd Upsilon(const Exemplars& exemplars, int object) {
  std::vector<Eigen::MatrixXd> base;
  std::vector<Eigen::MatrixXd> shifted;
  for (int j = 0; j < exemplars.size(); ++j) {
    base.push_back(exemplars.BasePath(j));
    shifted.push_back(exemplars.ShiftedPath(j, object));
  }
  return ComputeObjectivity(base, shifted, exemplars.FirstContact(object)).upsilon;
}

}  // namespace

FramesModel::FramesModel(Exemplars exemplars)
    : frames_(exemplars.frames),
      target_(exemplars.target),
      joints_count_(exemplars.joints()),
      contacts_(exemplars.contacts) {
  const int n = exemplars.size();
  style_ = ChooseStyle(exemplars);
  const bool has_hand = exemplars.trials[0].hand.size() > 0;
  Eigen::MatrixXd joints(frames_ * joints_count_, n);
  Eigen::MatrixXd hand(has_hand ? frames_ : 0, n);
  for (int j = 0; j < n; ++j) {
    const ExemplarTrial& trial = exemplars.trials[static_cast<std::size_t>(j)];
    joints.col(j) = trial.joints.reshaped();
    if (has_hand) hand.col(j) = trial.hand;
    exemplars.trials.DropJoints(static_cast<std::size_t>(j));
  }
  ReturnFreedMemory();
  joints_ = RoundedStreams(joints);
  hand_ = Streams(hand);
  joints.resize(0, 0);
  objectivity_ = Eigen::MatrixXd::Zero(frames_, exemplars.objects());
  if (!exemplars.has_tool) return;

  path_.emplace(exemplars);
  for (const ContactSpan& contact : contacts_) {
    contact_points_.push_back(MeanContactPoint(exemplars, contact));
    double squared = 0;
    for (int j = 0; j < n; ++j) {
      const Eigen::Vector3d place = exemplars.trials[static_cast<std::size_t>(j)]
                                        .tool[static_cast<std::size_t>(contact.meets)]
                                        .translation;
      squared += (path_->LeftOut(j, contact.meets) - place).squaredNorm() / n;
    }
    const double path_error_m = std::sqrt(squared);
    equality_.push_back(contact.touch_measured || n == 1 ||
                        contact_points_.back().left_out_m <=
                            (contact.last > contact.first ? kClearlyCloser * path_error_m : 0) +
                                kExact_m);
  }
  path_->ForgetLeftOut();
  for (int o = 0; o < exemplars.objects(); ++o) {
    objectivity_.col(o) =
        o == target_ ? Eigen::VectorXd(1.0 - path_->start_share().array()) : Upsilon(exemplars, o);
  }
  ReturnFreedMemory();
  if (exemplars.has_orientation) rotation_.emplace(exemplars, *path_);
}

Eigen::VectorXd FramesModel::StyleWeights(const Situation& situation) const {
  if (target_ < 0) return style_->Weights(Eigen::VectorXd());
  return style_->Weights(situation.base_T_object[static_cast<std::size_t>(target_)].translation);
}

void FramesModel::MeetContacts(const Situation& situation, Prediction& prediction) const {
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    const ContactSpan& span = contacts_[k];
    Eigen::Vector3d& reached = prediction.tool[static_cast<std::size_t>(span.meets)].translation;
    if (equality_[k]) {
      const geometry::Pose& base_T_object =
          situation.base_T_object[static_cast<std::size_t>(span.object)];
      const Eigen::Vector3d wanted = contact_points_[k].At(base_T_object);
      const Eigen::Vector3d shift = wanted - reached;
      const int before = k > 0 ? contacts_[k - 1].last : 0;
      const int after = k + 1 < contacts_.size() ? contacts_[k + 1].first : frames_ - 1;
      for (int i = before + 1; i < std::max(after, span.last + 1); ++i) {
        double share = 1;
        if (i < span.first)
          share = Smoothstep(static_cast<double>(i - before) / (span.first - before));
        if (i > span.last) share = Smoothstep(static_cast<double>(after - i) / (after - span.last));
        prediction.tool[static_cast<std::size_t>(i)].translation += share * shift;
      }
      reached = wanted;
    }
    prediction.contact_points.push_back(reached);
  }
}

Prediction FramesModel::Predict(const Situation& situation) const {
  Prediction prediction;
  const Eigen::VectorXd weights = StyleWeights(situation);
  prediction.joints = joints_.Sum(weights, frames_, joints_count_);
  if (hand_.rows() > 0) prediction.hand = hand_.Sum(weights).cwiseMax(0.0).cwiseMin(1.0);
  prediction.objectivity = objectivity_;
  Eigen::VectorXd start_share = Eigen::VectorXd::Zero(frames_);
  if (path_.has_value()) {
    start_share = path_->start_share();
    const FrameSituation where = path_->From(situation);
    PathFrames::Answer answer = path_->Predict(where);
    // What the noise of the trials leaves between the answer's first frame and the start.
    const Eigen::RowVector3d missing = where.start.transpose() - answer.positions.row(0);
    answer.positions += start_share * missing;
    Eigen::MatrixX4d rotations;
    if (rotation_.has_value()) {
      rotations = rotation_->Predict(situation, where);
    } else {
      rotations = Eigen::RowVector4d(0, 0, 0, 1).replicate(frames_, 1);
    }
    prediction.tool = ToPoses(answer.positions, rotations);
    prediction.sigma_m = std::move(answer.sigma_m);
    MeetContacts(situation, prediction);
    if (situation.base_T_start.has_value()) {
      prediction.tool[0].translation = where.start;
      if (situation.start_has_orientation) {
        prediction.tool[0].rotation = situation.base_T_start->rotation;
      }
    } else {
      prediction.warnings.push_back(
          "no start was given: the motion begins where the trials began on average");
    }
    if (rotation_.has_value() && rotation_->assumed() && target_ >= 0) {
      const Eigen::Quaterniond shown(path_->shown_turn());
      const double angle = geometry::AngleBetween(
          shown, situation.base_T_object[static_cast<std::size_t>(target_)].rotation);
      if (angle > 0.1) {
        prediction.warnings.push_back(
            "the trials never turned the object: that the motion turns with it is assumed");
      }
    }
  }
  if (situation.joint_start.has_value() && joints_count_ > 0) {
    // Joints leave their start as the tool does; without a tool, over the first third.
    const Eigen::RowVectorXd missing =
        situation.joint_start->transpose() - prediction.joints.row(0);
    for (int i = 0; i < frames_; ++i) {
      const double share =
          path_.has_value() ? start_share[i] : 1 - Smoothstep(3.0 * i / std::max(1, frames_ - 1));
      prediction.joints.row(i) += share * missing;
    }
    prediction.joints.row(0) = situation.joint_start->transpose();
  }
  return prediction;
}

std::vector<LeftOutTrial> FramesModel::LeftOut() const {
  std::vector<LeftOutTrial> trials;
  for (int j = 0; path_.has_value() && j < path_->size(); ++j) {
    trials.push_back({path_->LeftOutDistance(j), path_->LeftOutSpread(j)});
  }
  return trials;
}

std::string FramesModel::Describe() const {
  if (!path_.has_value()) return "joints";
  std::string text = "position: " + path_->Describe();
  if (rotation_.has_value()) {
    text += std::string("; orientation: ") + (rotation_->turns_with_object() ? "object" : "world");
  }
  return text;
}

}  // namespace exemplar::learning
