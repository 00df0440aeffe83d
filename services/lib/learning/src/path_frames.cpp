#include "path_frames.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/base/text.hpp"

namespace exemplar::learning {
namespace {

// The start and what turns with the object are always there: their gains are large enough to leave
// them to the data.
constexpr double kStartGain = 5e3;
constexpr double kObjectGain = 1e5;
// The best gains are averaged with shares that fall with this power of their left-out score.
constexpr std::size_t kMembers = 8;
constexpr double kSharpness = 16;
// Gains are chosen on at most this many trials and frames; the answer uses all. Many trials leave
// less to choose.
constexpr int kMostForChoice = 40;
constexpr Eigen::Index kFramesForChoice = 150;
constexpr int kManyTrials = 30;
constexpr std::size_t kMembersOfMany = 2;

std::vector<FrameGains> Grid(bool turns) {
  std::vector<FrameGains> grid;
  for (const double world : {0.0, 1.0, 10.0, 100.0}) {
    // Without orientation the object's part is the world's.
    if (!turns && world > 0) continue;
    for (const double start_axes : {0.0, 5.0, 100.0}) {
      grid.push_back({.start_axes = start_axes, .world = world, .residual = 0});
      grid.push_back({.start_axes = start_axes, .world = world, .residual = 1});
      grid.push_back({.start_axes = start_axes, .world = world, .residual = 5});
      grid.push_back({.start_axes = start_axes,
                      .world = world,
                      .residual = 5,
                      .residual_turns = true,
                      .by_orientation = false});
    }
  }
  return grid;
}

}  // namespace

PathFrames::PathFrames(const Exemplars& exemplars) : target_(exemplars.target) {
  const int n = exemplars.size();
  turns_ = target_ >= 0 && exemplars.object_has_orientation[static_cast<std::size_t>(target_)];
  for (const ExemplarTrial& trial : exemplars.trials) {
    mean_start_ += trial.tool.front().translation / n;
  }
  values_.resize(3 * n, exemplars.frames);
  double squared = 0;
  double extent = 0;
  for (int j = 0; j < n; ++j) {
    const ExemplarTrial& trial = exemplars.trials[static_cast<std::size_t>(j)];
    FrameSituation situation = From(trial.situation);
    situation.start = trial.tool.front().translation;
    const Eigen::MatrixXd path =
        target_ >= 0 ? exemplars.ShiftedPath(j, target_) : exemplars.BasePath(j);
    values_.middleRows<3>(3 * j) = path.transpose();
    if (target_ < 0) values_.middleRows<3>(3 * j).colwise() -= mean_start_;
    squared += (situation.start - situation.object).squaredNorm() / n;
    extent = std::max(extent, (path.rowwise() - path.row(0)).rowwise().norm().maxCoeff());
    situations_.push_back(situation);
  }
  length_m_ = std::max({std::sqrt(squared), 0.05 * extent, 1e-9});
  Fit(Grid(turns_));
}

FrameSituation PathFrames::From(const Situation& situation) const {
  FrameSituation result;
  result.start =
      situation.base_T_start.has_value() ? situation.base_T_start->translation : mean_start_;
  if (target_ < 0) {
    result.object = mean_start_;
    return result;
  }
  const geometry::Pose& object = situation.base_T_object[static_cast<std::size_t>(target_)];
  result.object = object.translation;
  if (turns_) result.turn = object.rotation.toRotationMatrix();
  return result;
}

PathFrames::Likeness PathFrames::Compare(const FrameSituation& a, const FrameSituation& b) const {
  const Eigen::Vector3d from_a = (a.start - a.object) / length_m_;
  const Eigen::Vector3d from_b = (b.start - b.object) / length_m_;
  Likeness likeness;
  likeness.turn.noalias() = a.turn * b.turn.transpose();
  likeness.always.noalias() = kStartGain * from_a * from_b.transpose();
  likeness.always += kObjectGain * likeness.turn;
  const Eigen::Vector3d along =
      (a.turn.transpose() * from_a).cwiseProduct(b.turn.transpose() * from_b);
  const Eigen::Matrix3d scaled = a.turn * along.asDiagonal();
  likeness.along_axes.noalias() = scaled * b.turn.transpose();
  const double squared = (from_a - from_b).squaredNorm();
  const double turned = 0.25 * (a.turn.leftCols<2>() - b.turn.leftCols<2>()).squaredNorm();
  likeness.by_place = std::exp(-std::sqrt(squared));
  likeness.by_place_and_turn = std::exp(-std::sqrt(squared + turned));
  return likeness;
}

Eigen::Matrix3d PathFrames::Covariance(const Likeness& likeness, const FrameGains& gains) {
  Eigen::Matrix3d block = likeness.always;
  if (gains.start_axes > 0) block += gains.start_axes * likeness.along_axes;
  if (gains.world > 0) block.diagonal().array() += gains.world;
  if (gains.residual > 0) {
    const double similarity =
        gains.residual * (gains.by_orientation ? likeness.by_place_and_turn : likeness.by_place);
    if (gains.residual_turns) {
      block += similarity * likeness.turn;
    } else {
      block.diagonal().array() += similarity;
    }
  }
  return block;
}

void PathFrames::Fit(const std::vector<FrameGains>& grid) {
  const int n = static_cast<int>(situations_.size());
  const auto covariance = [&](const std::vector<int>& chosen, const FrameGains& gains) {
    const auto m = static_cast<Eigen::Index>(chosen.size());
    Eigen::MatrixXd matrix(3 * m, 3 * m);
    for (Eigen::Index i = 0; i < m; ++i) {
      for (Eigen::Index j = i; j < m; ++j) {
        const Eigen::Matrix3d block = Covariance(
            Compare(situations_[static_cast<std::size_t>(chosen[static_cast<std::size_t>(i)])],
                    situations_[static_cast<std::size_t>(chosen[static_cast<std::size_t>(j)])]),
            gains);
        matrix.block<3, 3>(3 * i, 3 * j) = block;
        matrix.block<3, 3>(3 * j, 3 * i) = block.transpose();
      }
    }
    return matrix;
  };
  std::vector<int> all;
  for (int j = 0; j < n; ++j) all.push_back(j);
  std::vector<int> few = all;
  if (n > kMostForChoice) {
    few.clear();
    for (int k = 0; k < kMostForChoice; ++k) few.push_back(k * n / kMostForChoice);
  }
  const Eigen::Index columns = std::min(values_.cols(), kFramesForChoice);
  Eigen::MatrixXd few_values(3 * static_cast<Eigen::Index>(few.size()), columns);
  for (std::size_t k = 0; k < few.size(); ++k) {
    for (Eigen::Index c = 0; c < columns; ++c) {
      // The first and the last frame are among them.
      const Eigen::Index frame = columns > 1 ? c * (values_.cols() - 1) / (columns - 1) : 0;
      few_values.block<3, 1>(3 * static_cast<Eigen::Index>(k), c) =
          values_.block<3, 1>(3 * few[k], frame);
    }
  }

  struct Candidate {
    double score = 0;
    const FrameGains* gains = nullptr;
  };
  std::vector<Candidate> candidates;
  for (const FrameGains& gains : grid) {
    // One trial predicts nothing about itself: the plainest gains.
    const double score =
        n > 1 ? LeftOutScore(BlockKriging(covariance(few, gains), few_values).left_out_errors())
              : 1.0;
    candidates.push_back({score, &gains});
    if (n == 1) break;
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  const std::size_t members = n > kManyTrials ? kMembersOfMany : kMembers;
  if (candidates.size() > members) candidates.resize(members);
  double total = 0;
  for (const Candidate& candidate : candidates) {
    const double ratio = candidate.score > 0 ? candidates.front().score / candidate.score : 1.0;
    const double share = std::pow(ratio, kSharpness);
    total += share;
    members_.push_back({.gains = *candidate.gains,
                        .share = share,
                        .kriging = BlockKriging(covariance(all, *candidate.gains), values_),
                        .inverse = {}});
    members_.back().inverse = Streams(members_.back().kriging.inverse());
  }
  paths_ = Streams(values_.transpose());
  Eigen::MatrixXd noise(values_.cols(), static_cast<Eigen::Index>(members_.size()));
  for (std::size_t k = 0; k < members_.size(); ++k) {
    noise.col(static_cast<Eigen::Index>(k)) = members_[k].kriging.noise_variance();
  }
  noise_ = Streams(noise);
  start_share_ = Eigen::VectorXd::Zero(values_.cols());
  for (Member& member : members_) {
    member.share /= total;
    // Posterior means of a, and of A's trace over 3.
    const Eigen::MatrixXd duals = member.kriging.Duals(values_);
    for (int j = 0; j < n; ++j) {
      const FrameSituation& s = situations_[static_cast<std::size_t>(j)];
      const Eigen::Vector3d from = (s.start - s.object) / length_m_;
      start_share_ += member.share * (kStartGain + member.gains.start_axes / 3) *
                      (from.transpose() * duals.middleRows<3>(3 * j)).transpose();
    }
  }
  // Where starts and objects never varied apart, the parts share what they explain: relative to the
  // first frame, which is the start's altogether, the shape is still right.
  const double first = start_share_[0];
  if (first > 1e-6) start_share_ /= first;
  start_share_ = start_share_.cwiseMax(0.0).cwiseMin(1.0);
}

PathFrames::Answer PathFrames::Predict(const FrameSituation& situation) const {
  const auto n = static_cast<Eigen::Index>(situations_.size());
  std::vector<Likeness> likeness;
  likeness.reserve(situations_.size());
  for (const FrameSituation& trial : situations_) likeness.push_back(Compare(situation, trial));
  const Likeness self = Compare(situation, situation);

  Eigen::MatrixX3d weights = Eigen::MatrixX3d::Zero(3 * n, 3);
  Eigen::VectorXd noise(static_cast<Eigen::Index>(members_.size()));
  Eigen::MatrixX3d cross(3 * n, 3);
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const Member& member = members_[k];
    for (Eigen::Index j = 0; j < n; ++j) {
      cross.middleRows<3>(3 * j) =
          Covariance(likeness[static_cast<std::size_t>(j)], member.gains).transpose();
    }
    const Eigen::MatrixX3d own = member.inverse.Sum3(cross);
    weights += member.share * own;
    const double known = Covariance(self, member.gains).trace() - own.cwiseProduct(cross).sum();
    noise[static_cast<Eigen::Index>(k)] = member.share * (3 + std::max(0.0, known));
  }
  Answer answer;
  answer.positions = paths_.Sum3(weights);
  answer.positions.rowwise() += situation.object.transpose();
  answer.sigma_m = noise_.Sum(noise).cwiseSqrt();
  return answer;
}

Eigen::Matrix3Xd PathFrames::LeftOut(int trial) const {
  Eigen::Matrix3Xd path = values_.middleRows<3>(3 * trial);
  for (const Member& member : members_) {
    path -= member.share * member.kriging.left_out_errors().middleRows<3>(3 * trial);
  }
  path.colwise() += situations_[static_cast<std::size_t>(trial)].object;
  return path;
}

Eigen::Vector3d PathFrames::LeftOut(int trial, int frame) const {
  Eigen::Vector3d place = values_.block<3, 1>(3 * trial, frame);
  for (const Member& member : members_) {
    place -= member.share * member.kriging.left_out_errors().block<3, 1>(3 * trial, frame);
  }
  return place + situations_[static_cast<std::size_t>(trial)].object;
}

std::string PathFrames::Describe() const {
  const FrameGains& best = members_.front().gains;
  std::string text = turns_ ? "start, turned object" : "start, object";
  if (best.start_axes > 0) text += ", start along the object's axes";
  if (best.world > 0) text += ", world";
  if (best.residual > 0) text += ", smooth rest";
  return text;
}

}  // namespace exemplar::learning
