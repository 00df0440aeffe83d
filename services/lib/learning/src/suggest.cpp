#include "exemplar/learning/suggest.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "exemplar/base/text.hpp"
#include "exemplar/signal/statistics.hpp"
#include "hull.hpp"
#include "skill_data.hpp"

namespace exemplar::learning {
namespace {

constexpr int kMostPlaces = 20;
// Of the grid over the box around the trials' places, along its widest side.
constexpr int kGrid = 13;
constexpr int kLayers = 3;  // along the narrowest
// A side below this part of the widest is none.
constexpr double kFlat = 0.05;
// How far beside a line or a point of places a new one is looked for, as a part of the line, or of
// the tool's motion.
constexpr double kBesideLine = 0.5;
constexpr double kBesidePoint = 0.25;
// Two suggestions are at least this part of the extent apart.
constexpr double kApart = 0.3;
// A place nearer to a trial than this part of the extent is the trial's own.
constexpr double kAnother = 0.1;
// The distance from the hull is known to about this part of the extent.
constexpr double kInside = 2e-3;
// Trials turned the target if by more than this.
constexpr double kTurned_rad = 0.1;
constexpr double kOutlierFactor = 2;

struct Candidate {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  bool beside = false;  // of a line or a point
  double sigma_m = 0;
  double nearest_m = 0;
};

class Suggester {
 public:
  explicit Suggester(const Skill& skill) : skill_(skill), exemplars_(*skill.data().exemplars) {
    const auto target = static_cast<std::size_t>(exemplars_.target);
    places_.resize(exemplars_.size(), 3);
    for (int j = 0; j < exemplars_.size(); ++j) {
      const geometry::Pose& pose =
          exemplars_.trials[static_cast<std::size_t>(j)].situation.base_T_object[target];
      places_.row(j) = pose.translation.transpose();
    }
    centre_ = places_.colwise().mean().transpose();
    extent_m_ = (places_.colwise().maxCoeff() - places_.colwise().minCoeff()).norm();
    const Eigen::MatrixXd path = exemplars_.BasePath(0);
    motion_m_ = (path.colwise().maxCoeff() - path.colwise().minCoeff()).norm();
  }

  Result<Suggestions> Best(int count) {
    Suggestions found;
    std::vector<double> at_trials;
    for (int j = 0; j < exemplars_.size(); ++j) {
      const Result<double> sigma = SigmaAt(places_.row(j).transpose());
      if (!sigma.ok()) return sigma.error();
      at_trials.push_back(*sigma);
    }
    found.typical_sigma_m = signal::Quantile(at_trials, 0.5);

    std::vector<Candidate> candidates = Candidates();
    for (Candidate& candidate : candidates) {
      const Result<double> sigma = SigmaAt(candidate.place);
      if (!sigma.ok()) return sigma.error();
      candidate.sigma_m = *sigma;
      candidate.nearest_m =
          (places_.rowwise() - candidate.place.transpose()).rowwise().norm().minCoeff();
    }
    // Where the predicted error does not tell, the place furthest from all trials.
    std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
      if (a.beside != b.beside) return a.beside;
      if (std::abs(a.sigma_m - b.sigma_m) > 1e-3 * a.sigma_m + 1e-9) return a.sigma_m > b.sigma_m;
      return a.nearest_m > b.nearest_m;
    });
    std::vector<Eigen::Vector3d> taken;
    const double apart_m = kApart * Scale();
    for (const Candidate& candidate : candidates) {
      if (static_cast<int>(taken.size()) == count) break;
      if (candidate.nearest_m < kAnother * Scale()) continue;
      const bool apart = std::all_of(taken.begin(), taken.end(), [&](const Eigen::Vector3d& other) {
        return (other - candidate.place).norm() > apart_m;
      });
      if (!apart) continue;
      taken.push_back(candidate.place);
      found.places.push_back({.target = TargetAt(candidate.place),
                              .sigma_m = candidate.sigma_m,
                              .nearest_trial_m = candidate.nearest_m,
                              .reason = Reason(candidate, found.typical_sigma_m)});
    }
    AddNotes(found.notes);
    return found;
  }

 private:
  double Scale() const {
    return extent_m_ > kFlat * motion_m_ ? extent_m_ : 2 * kBesidePoint * motion_m_;
  }

  geometry::NamedPose TargetAt(const Eigen::Vector3d& place) const {
    const auto target = static_cast<std::size_t>(exemplars_.target);
    return {.name = exemplars_.object_names[target],
            .base_T_object = {place, skill_.data().mean_object_rotation[target]},
            .has_orientation = exemplars_.object_has_orientation[target]};
  }

  Result<double> SigmaAt(const Eigen::Vector3d& place) const {
    demonstration::SkillQuery query;
    query.objects.push_back(TargetAt(place));
    const Result<demonstration::SkillMotion> answer = Answer(skill_, query);
    if (!answer.ok()) return answer.error();
    double squared = 0;
    for (const double sigma : answer->sigma_m) squared += sigma * sigma;
    return answer->sigma_m.empty()
               ? 0.0
               : std::sqrt(squared / static_cast<double>(answer->sigma_m.size()));
  }

  // The two main horizontal directions of the places, and how far they spread along them.
  std::vector<Candidate> Candidates() const {
    std::vector<Candidate> candidates;
    if (extent_m_ <= kFlat * motion_m_) {
      for (const double angle : {0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75}) {
        const double turn = angle * std::acos(-1.0);
        candidates.push_back(
            {.place = centre_ +
                      kBesidePoint * motion_m_ * Eigen::Vector3d(std::cos(turn), std::sin(turn), 0),
             .beside = true});
      }
      return candidates;
    }
    const Eigen::MatrixXd about = places_.rowwise() - centre_.transpose();
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(about, Eigen::ComputeThinV);
    const Eigen::MatrixXd along = about * svd.matrixV();
    const Eigen::RowVectorXd low = along.colwise().minCoeff();
    const Eigen::RowVectorXd high = along.colwise().maxCoeff();
    const double widest = high[0] - low[0];
    std::array<int, 3> steps = {kGrid, 1, 1};
    for (Eigen::Index axis = 1; axis < along.cols(); ++axis) {
      if (high[axis] - low[axis] <= kFlat * widest) continue;
      steps[static_cast<std::size_t>(axis)] = axis == 1 ? kGrid : kLayers;
    }
    if (steps[1] == 1) AddBesideLine(svd.matrixV().col(0), widest, candidates);
    const auto at = [&](int axis, int k) {
      if (axis >= along.cols() || steps[static_cast<std::size_t>(axis)] == 1) return 0.0;
      return low[axis] + (high[axis] - low[axis]) * k / (steps[static_cast<std::size_t>(axis)] - 1);
    };
    for (int a = 0; a < steps[0]; ++a) {
      for (int b = 0; b < steps[1]; ++b) {
        for (int c = 0; c < steps[2]; ++c) {
          Eigen::Vector3d place = centre_ + at(0, a) * svd.matrixV().col(0);
          if (along.cols() > 1) place += at(1, b) * svd.matrixV().col(1);
          if (along.cols() > 2) place += at(2, c) * svd.matrixV().col(2);
          if (DistanceFromHull(places_, place) > kInside * extent_m_) continue;
          candidates.push_back({.place = place});
        }
      }
    }
    // The grid misses the border; the middle of each pair of places is on it or inside.
    for (Eigen::Index i = 0; i < std::min<Eigen::Index>(places_.rows(), kGrid); ++i) {
      for (Eigen::Index j = 0; j < i; ++j) {
        candidates.push_back({.place = (places_.row(i) + places_.row(j)).transpose() / 2});
      }
    }
    return candidates;
  }

  static Eigen::Vector3d Beside(const Eigen::Vector3d& line) {
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(line);
    return across.norm() > 0.1 ? across.normalized() : Eigen::Vector3d::UnitX().eval();
  }

  void AddBesideLine(const Eigen::Vector3d& line, double length_m,
                     std::vector<Candidate>& candidates) const {
    for (const double side : {-1., 1.}) {
      candidates.push_back(
          {.place = centre_ + side * kBesideLine * length_m * Beside(line), .beside = true});
    }
  }

  std::string Reason(const Candidate& candidate, double typical_m) const {
    if (candidate.beside) {
      return extent_m_ <= kFlat * motion_m_
                 ? "all trials had the object at one place: nothing tells how the motion changes "
                   "with it"
                 : "the trials' places lie on one line: nothing tells what changes beside it";
    }
    std::string text = "predicted error " + FormatFixed(100 * candidate.sigma_m, 2) + " cm";
    if (typical_m > 0) text += ", " + FormatFixed(100 * typical_m, 2) + " cm where trials were";
    return text + "; the nearest trial is " + FormatFixed(100 * candidate.nearest_m, 1) +
           " cm away";
  }

  void AddNotes(std::vector<std::string>& notes) const {
    const auto target = static_cast<std::size_t>(exemplars_.target);
    double turned = 0;
    for (const ExemplarTrial& trial : exemplars_.trials) {
      turned = std::max(
          turned,
          geometry::AngleBetween(exemplars_.trials.front().situation.base_T_object[target].rotation,
                                 trial.situation.base_T_object[target].rotation));
    }
    if (exemplars_.object_has_orientation[target] && turned < kTurned_rad) {
      notes.push_back("no trial turned \"" + exemplars_.object_names[target] +
                      "\": turn it in the next one, if it will be turned later");
    }
    const SkillReport& report = skill_.report();
    for (const MethodScore& score : report.methods) {
      const std::size_t n = score.frechet_by_trial_m.size();
      if (!score.chosen || n < 3 || n != report.trials.size()) continue;
      const auto worst =
          std::max_element(score.frechet_by_trial_m.begin(), score.frechet_by_trial_m.end());
      if (*worst < kOutlierFactor * score.frechet_m) continue;
      const SkillReport::TrialPart& trial =
          report.trials[static_cast<std::size_t>(worst - score.frechet_by_trial_m.begin())];
      notes.push_back("the others predict trial " + trial.id + " worst (" +
                      FormatFixed(100 * *worst, 1) + " cm, median " +
                      FormatFixed(100 * score.frechet_m, 1) +
                      " cm): another one at its place tells whether it is the place or the trial");
    }
  }

  const Skill& skill_;
  const Exemplars& exemplars_;
  Eigen::MatrixXd places_;  // trials x 3
  Eigen::Vector3d centre_;
  double extent_m_ = 0;
  double motion_m_ = 0;
};

}  // namespace

Result<Suggestions> Suggest(const Skill& skill, const SuggestOptions& options) {
  if (options.count < 1 || options.count > kMostPlaces) {
    return InvalidArgument("count is " + std::to_string(options.count) + ", must be from 1 to " +
                               std::to_string(kMostPlaces),
                           "count");
  }
  const Exemplars& exemplars = *skill.data().exemplars;
  if (exemplars.target < 0) {
    return FailedPrecondition("the skill's trials hold no object: there is no place to suggest");
  }
  if (!exemplars.has_tool) {
    return FailedPrecondition("the skill answers with joints only: it has no robot model");
  }
  return Suggester(skill).Best(options.count);
}

}  // namespace exemplar::learning
