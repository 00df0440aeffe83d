#include <algorithm>
#include <cmath>
#include <limits>

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/motion/path_ik.hpp"
#include "path_errors.hpp"

namespace exemplar::motion {
namespace {

constexpr int kRandomSeeds = 8;
constexpr int kMostLanes = 14;
constexpr double kSamePosture_rad = 0.25;
/// Lanes are followed at about so many frames; those between are interpolated.
constexpr int kSamples = 100;
/// Of the best way, in units of squared ordinary distances to the style.
constexpr double kMissCost = 1e6;
constexpr double kJumpCost = 1e5;
constexpr double kStartWeight = 1.0;

class BranchSearch {
 public:
  BranchSearch(const kinematics::Chain& chain, const PathProblem& problem,
               const Eigen::Ref<const Eigen::VectorXd>& start)
      : chain_(chain),
        problem_(problem),
        start_(start),
        bounds_(PathBounds(chain)),
        style_weight_(problem.style_deviation_rad.array().square().inverse()) {
    const int frames = static_cast<int>(problem.base_T_tool.size());
    stride_ = std::max(1, frames / kSamples);
    for (int k = 0; k < frames - 1; k += stride_) sampled_.push_back(k);
    sampled_.push_back(frames - 1);
  }

  std::vector<Branch> Run(int hard_frame) {
    const int samples = static_cast<int>(sampled_.size());
    std::vector<int> keys = {0};
    if (hard_frame >= 0) keys.push_back(std::min(samples - 1, hard_frame / stride_));
    for (const int quarter : {2, 4, 1, 3}) keys.push_back(quarter * (samples - 1) / 4);
    for (const int key : keys) AddLanesAt(key);

    std::vector<Branch> branches;
    branches.push_back(BestWay());
    std::vector<Branch> whole;
    for (const Lane& lane : lanes_) {
      if (lane.first == 0) whole.push_back(Alone(lane));
    }
    std::stable_sort(whole.begin(), whole.end(),
                     [](const Branch& a, const Branch& b) { return a.score < b.score; });
    for (Branch& branch : whole) branches.push_back(std::move(branch));
    return branches;
  }

 private:
  /// Postures at samples first to last, each near the one before.
  struct Lane {
    int first = 0;
    int last = -1;
    Eigen::MatrixXd postures;  ///< samples x n; rows outside first to last mean nothing

    bool Covers(int sample) const { return sample >= first && sample <= last; }
  };

  kinematics::IkOptions IkAt(int sample) const {
    const Tracking& tracking = problem_.tracking(static_cast<std::size_t>(sampled_[sample]));
    kinematics::IkOptions options;
    options.position_tolerance_m = 0.5 * tracking.position_tolerance_m;
    options.rotation_tolerance_rad = 0.5 * tracking.rotation_tolerance_rad;
    options.use_rotation = problem_.use_rotation;
    options.max_restarts = 0;
    options.max_iterations = 60;
    return options;
  }

  Result<kinematics::IkSolution> SolveAt(int sample, const Eigen::VectorXd& seed,
                                         const kinematics::IkOptions& options) const {
    return kinematics::SolveIk(chain_, problem_.base_T_tool[sampled_[sample]], seed, options);
  }

  Eigen::VectorXd StyleAt(int sample) const {
    return problem_.style.row(sampled_[sample]).transpose();
  }

  void AddLanesAt(int sample) {
    std::vector<Eigen::VectorXd> seeds = {StyleAt(sample), start_};
    if (sample == 0 && problem_.first.size() == chain_.dof()) {
      seeds.insert(seeds.begin(), problem_.first);
    }
    Rng rng(static_cast<std::uint64_t>(sample) + 1);
    for (int i = 0; i < kRandomSeeds; ++i) {
      Eigen::VectorXd seed(chain_.dof());
      for (int j = 0; j < chain_.dof(); ++j) {
        const double lower = std::isfinite(bounds_.lower[j]) ? bounds_.lower[j] : -M_PI;
        const double upper = std::isfinite(bounds_.upper[j]) ? bounds_.upper[j] : M_PI;
        seed[j] = rng.Uniform(lower, upper);
      }
      seeds.push_back(seed);
    }
    for (const Eigen::VectorXd& seed : seeds) {
      if (static_cast<int>(lanes_.size()) == kMostLanes) return;
      // Without the pull of the style, which would lead all seeds to the same posture.
      const Result<kinematics::IkSolution> found = SolveAt(sample, seed, IkAt(sample));
      if (!found.ok()) continue;
      const bool known = std::any_of(lanes_.begin(), lanes_.end(), [&](const Lane& lane) {
        return lane.Covers(sample) &&
               (lane.postures.row(sample).transpose() - found->q).cwiseAbs().maxCoeff() <
                   kSamePosture_rad;
      });
      if (!known) lanes_.push_back(Follow(sample, found->q));
    }
  }

  /// From one posture along the path, both ways, drawn to the style.
  Lane Follow(int sample, const Eigen::VectorXd& from) const {
    const int samples = static_cast<int>(sampled_.size());
    Lane lane;
    lane.postures.resize(samples, chain_.dof());
    lane.postures.row(sample) = from.transpose();
    lane.first = lane.last = sample;
    for (const int direction : {1, -1}) {
      Eigen::VectorXd q = from;
      for (int s = sample + direction; s >= 0 && s < samples; s += direction) {
        kinematics::IkOptions options = IkAt(s);
        options.max_null_space_iterations = 1;
        options.preferred = StyleAt(s);
        options.preferred_weights = style_weight_.matrix();
        const Result<kinematics::IkSolution> found = SolveAt(s, q, options);
        if (!found.ok() || IsJump(found->q, q, sampled_[s] - sampled_[s - direction])) break;
        q = found->q;
        lane.postures.row(s) = q.transpose();
        (direction > 0 ? lane.last : lane.first) = s;
      }
    }
    return lane;
  }

  bool IsJump(const Eigen::Ref<const Eigen::VectorXd>& a,
              const Eigen::Ref<const Eigen::VectorXd>& b, int frames_apart) const {
    return (a - b).cwiseAbs().maxCoeff() > kLargeJointStep_rad * std::abs(frames_apart) + 0.1;
  }

  double StyleCost(const Eigen::Ref<const Eigen::VectorXd>& q, int sample) const {
    return (style_weight_ * (q - StyleAt(sample)).array().square()).sum();
  }

  double StartCost(const Eigen::Ref<const Eigen::VectorXd>& q) const {
    return kStartWeight * (q - start_).squaredNorm();
  }

  /// The cheapest lane at every sample, kNone where there is none.
  static constexpr int kNone = -1;
  std::vector<int> CheapestLanes() const {
    const int samples = static_cast<int>(sampled_.size());
    const int states = static_cast<int>(lanes_.size()) + 1;  // the last one: no lane
    const double never = std::numeric_limits<double>::infinity();
    Eigen::MatrixXd cost(samples, states);
    Eigen::MatrixXi from(samples, states);
    const auto own = [&](int s, int state) {
      if (state == states - 1) return kMissCost;
      if (!lanes_[state].Covers(s)) return never;
      const Eigen::VectorXd q = lanes_[state].postures.row(s).transpose();
      return StyleCost(q, s) + (s == 0 ? StartCost(q) : 0.0);
    };
    for (int s = 0; s < samples; ++s) {
      for (int state = 0; state < states; ++state) {
        const double here = own(s, state);
        from(s, state) = state;
        cost(s, state) = s == 0 ? here : never;
        if (s == 0 || here == never) continue;
        for (int before = 0; before < states; ++before) {
          if (cost(s - 1, before) == never) continue;
          const double total = cost(s - 1, before) + here + ChangeCost(s, before, state);
          if (total >= cost(s, state)) continue;
          cost(s, state) = total;
          from(s, state) = before;
        }
      }
    }
    std::vector<int> way(sampled_.size());
    int state = 0;
    cost.row(samples - 1).minCoeff(&state);
    for (int s = samples - 1; s >= 0; --s) {
      way[s] = state == states - 1 ? kNone : state;
      state = from(s, state);
    }
    return way;
  }

  /// From lane `before` at sample s - 1 to lane `after` at s.
  double ChangeCost(int s, int before, int after) const {
    const int lanes = static_cast<int>(lanes_.size());
    if (before == lanes || after == lanes) return 0;
    const Eigen::VectorXd q0 = lanes_[before].postures.row(s - 1).transpose();
    const Eigen::VectorXd q1 = lanes_[after].postures.row(s).transpose();
    const double way = (style_weight_ * (q1 - q0).array().square()).sum();
    return way + (IsJump(q1, q0, sampled_[s] - sampled_[s - 1]) ? kJumpCost : 0.0);
  }

  Branch BestWay() const {
    const std::vector<int> way = CheapestLanes();
    std::vector<Eigen::VectorXd> postures(way.size());
    Branch branch;
    for (std::size_t s = 0; s < way.size(); ++s) {
      if (way[s] != kNone) {
        postures[s] = lanes_[way[s]].postures.row(static_cast<Eigen::Index>(s)).transpose();
      } else {
        ++branch.frames_missed;
      }
    }
    Fill(postures, branch);
    return branch;
  }

  Branch Alone(const Lane& lane) const {
    std::vector<Eigen::VectorXd> postures(sampled_.size());
    Branch branch;
    double style = 0;
    for (int s = lane.first; s <= lane.last; ++s) {
      postures[s] = lane.postures.row(s).transpose();
      style += StyleCost(postures[s], s);
    }
    branch.frames_missed = static_cast<int>(sampled_.size()) - (lane.last - lane.first + 1);
    branch.score =
        100.0 * branch.frames_missed + style / (lane.last + 1) + StartCost(postures.front());
    Fill(postures, branch);
    return branch;
  }

  /// Frames between the samples that have a posture; the nearest one's, moved along with the style,
  /// before the first and after the last.
  void Fill(const std::vector<Eigen::VectorXd>& postures, Branch& branch) const {
    const int frames = static_cast<int>(problem_.base_T_tool.size());
    branch.joints = problem_.style;
    int before = -1;
    for (std::size_t s = 0; s < postures.size(); ++s) {
      if (postures[s].size() == 0) continue;
      const int k = sampled_[s];
      const Eigen::RowVectorXd here = postures[s].transpose();
      if (before < 0) {
        for (int i = 0; i <= k; ++i) branch.joints.row(i) = here;
      } else {
        const Eigen::RowVectorXd from = branch.joints.row(before);
        const bool jump = IsJump(here.transpose(), from.transpose(), k - before);
        const int middle = (before + k + 1) / 2;
        if (jump) branch.cuts.push_back(middle);
        for (int i = before + 1; i <= k; ++i) {
          const double part = static_cast<double>(i - before) / (k - before);
          branch.joints.row(i) = jump ? (i < middle ? from : here) : from + part * (here - from);
        }
      }
      before = k;
    }
    for (int i = before + 1; before >= 0 && i < frames; ++i) {
      branch.joints.row(i) = branch.joints.row(before);
    }
  }

  const kinematics::Chain& chain_;
  const PathProblem& problem_;
  const Eigen::VectorXd start_;
  const JointBounds bounds_;
  const Eigen::ArrayXd style_weight_;
  int stride_ = 1;
  std::vector<int> sampled_;  ///< frames
  std::vector<Lane> lanes_;
};

}  // namespace

std::vector<Branch> FindBranches(const kinematics::Chain& chain, const PathProblem& problem,
                                 const Eigen::Ref<const Eigen::VectorXd>& start, int hard_frame) {
  return BranchSearch(chain, problem, start).Run(hard_frame);
}

}  // namespace exemplar::motion
