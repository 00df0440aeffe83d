#include "path_frames.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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
// Many trials leave less to choose.
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
  Eigen::MatrixXd values(3 * n, exemplars.frames);  // x - O
  double squared = 0;
  double extent = 0;
  for (int j = 0; j < n; ++j) {
    const ExemplarTrial& trial = exemplars.trials[static_cast<std::size_t>(j)];
    FrameSituation situation = From(trial.situation);
    situation.start = trial.tool.front().translation;
    const Eigen::MatrixXd path =
        target_ >= 0 ? exemplars.ShiftedPath(j, target_) : exemplars.BasePath(j);
    values.middleRows<3>(3 * j) = path.transpose();
    if (target_ < 0) values.middleRows<3>(3 * j).colwise() -= mean_start_;
    squared += (situation.start - situation.object).squaredNorm() / n;
    extent = std::max(extent, (path.rowwise() - path.row(0)).rowwise().norm().maxCoeff());
    situations_.push_back(situation);
  }
  length_m_ = std::max({std::sqrt(squared), 0.05 * extent, 1e-9});
  Fit(Grid(turns_), std::move(values));
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

double PathFrames::Similarity(const Likeness& likeness, const FrameGains& gains) {
  return gains.residual * (gains.by_orientation ? likeness.by_place_and_turn : likeness.by_place);
}

Eigen::Matrix3d PathFrames::Covariance(const Likeness& likeness, const FrameGains& gains) {
  Eigen::Matrix3d block = likeness.always;
  if (gains.start_axes > 0) block += gains.start_axes * likeness.along_axes;
  if (gains.world > 0) block.diagonal().array() += gains.world;
  if (gains.residual > 0) {
    const double similarity = Similarity(likeness, gains);
    if (gains.residual_turns) {
      block += similarity * likeness.turn;
    } else {
      block.diagonal().array() += similarity;
    }
  }
  return block;
}

PartedCovariance PathFrames::Parted(const std::vector<int>& chosen, const FrameGains& gains) const {
  PartedCovariance covariance;
  const auto m = static_cast<Eigen::Index>(chosen.size());
  const Eigen::Index columns = 4 + (gains.start_axes > 0 ? 3 : 0) + (gains.world > 0 ? 3 : 0);
  covariance.parts.resize(3 * m, columns);
  const auto situation = [&](Eigen::Index i) -> const FrameSituation& {
    return situations_[static_cast<std::size_t>(chosen[static_cast<std::size_t>(i)])];
  };
  for (Eigen::Index i = 0; i < m; ++i) {
    const FrameSituation& s = situation(i);
    const Eigen::Vector3d from = (s.start - s.object) / length_m_;
    auto rows = covariance.parts.middleRows<3>(3 * i);
    rows.col(0) = std::sqrt(kStartGain) * from;
    rows.middleCols<3>(1) = std::sqrt(kObjectGain) * s.turn;
    Eigen::Index next = 4;
    if (gains.start_axes > 0) {
      const Eigen::Vector3d along = s.turn.transpose() * from;
      rows.middleCols<3>(next) = std::sqrt(gains.start_axes) * s.turn * along.asDiagonal();
      next += 3;
    }
    if (gains.world > 0) {
      rows.middleCols<3>(next) = std::sqrt(gains.world) * Eigen::Matrix3d::Identity();
    }
    if (gains.residual > 0 && gains.residual_turns) covariance.turns.push_back(s.turn);
  }
  if (gains.residual > 0) {
    covariance.similarity.resize(m, m);
    for (Eigen::Index i = 0; i < m; ++i) {
      for (Eigen::Index j = i; j < m; ++j) {
        covariance.similarity(i, j) = covariance.similarity(j, i) =
            Similarity(Compare(situation(i), situation(j)), gains);
      }
    }
  }
  return covariance;
}

void PathFrames::Fit(const std::vector<FrameGains>& grid, Eigen::MatrixXd values) {
  const int n = static_cast<int>(situations_.size());
  const std::vector<int> all = EvenChoice(n, n);
  const std::vector<int> few = EvenChoice(n, kMostForChoice);
  const Eigen::MatrixXd few_values = FramesForChoice(values, few);
  struct Candidate {
    double score = 0;
    const FrameGains* gains = nullptr;
  };
  std::vector<Candidate> candidates;
  for (const FrameGains& gains : grid) {
    // One trial predicts nothing about itself: the plainest gains.
    double score = 1;
    if (n > 1) {
      Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(few_values.rows(), few_values.cols());
      BlockKriging(Parted(few, gains)).AddLeftOutErrors(few_values, 1, errors);
      score = LeftOutScore(errors);
    }
    candidates.push_back({score, &gains});
    if (n == 1) break;
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  const std::size_t members = n > kManyTrials ? kMembersOfMany : kMembers;
  if (candidates.size() > members) candidates.resize(members);
  std::vector<double> shares;
  double total = 0;
  for (const Candidate& candidate : candidates) {
    const double ratio = candidate.score > 0 ? candidates.front().score / candidate.score : 1.0;
    shares.push_back(std::pow(ratio, kSharpness));
    total += shares.back();
  }
  Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(values.rows(), values.cols());
  Eigen::MatrixXd noise(values.cols(), static_cast<Eigen::Index>(candidates.size()));
  left_out_spread_ = Eigen::VectorXd::Zero(n);
  start_share_ = Eigen::VectorXd::Zero(values.cols());
  Eigen::VectorXd from(3 * static_cast<Eigen::Index>(n));
  for (int j = 0; j < n; ++j) {
    const FrameSituation& s = situations_[static_cast<std::size_t>(j)];
    from.segment<3>(3 * j) = (s.start - s.object) / length_m_;
  }
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const FrameGains& gains = *candidates[k].gains;
    Member member{.gains = gains,
                  .share = shares[k] / total,
                  .kriging = BlockKriging(Parted(all, gains)),
                  .inverse = {}};
    noise.col(static_cast<Eigen::Index>(k)) =
        member.kriging.AddLeftOutErrors(values, member.share, errors);
    for (int j = 0; j < n; ++j) {
      left_out_spread_[j] += member.share * member.kriging.LeftOutSpread(j);
    }
    member.inverse = Streams(member.kriging.inverse());
    // Posterior means of a, and of A's trace over 3.
    start_share_ += member.share * (kStartGain + gains.start_axes / 3) *
                    (values.transpose() * member.kriging.Duals(from));
    members_.push_back(std::move(member));
  }
  noise_ = Streams(noise);
  left_out_distance_m_.resize(n);
  for (int j = 0; j < n; ++j) {
    left_out_distance_m_[j] =
        std::sqrt(errors.middleRows<3>(3 * j).colwise().squaredNorm().maxCoeff());
  }
  left_out_ = values - errors;
  errors.resize(0, 0);
  values.transposeInPlace();
  paths_ = Streams(values);
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
    const Eigen::MatrixX3d own = member.inverse.count() > 0
                                     ? member.inverse.Sum3(cross)
                                     : Eigen::MatrixX3d(member.kriging.Duals(cross));
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
  Eigen::Matrix3Xd path = left_out_.middleRows<3>(3 * trial);
  path.colwise() += situations_[static_cast<std::size_t>(trial)].object;
  return path;
}

Eigen::Vector3d PathFrames::LeftOut(int trial, int frame) const {
  return left_out_.block<3, 1>(3 * trial, frame) +
         situations_[static_cast<std::size_t>(trial)].object;
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
