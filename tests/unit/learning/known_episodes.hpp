#pragma once
// Motions whose episodes are known, some with twitches that are none.

#include <string>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/learning/aligned.hpp"
#include "motions.hpp"

namespace exemplar::learning {

/// A demonstration of known episodes: each joint goes from one level to the next by minimum jerk,
/// with a rest between; a spurious twist of the last joint may lie in a rest.
struct Demonstration {
  UniformTrial trial;
  std::vector<double> begins_s;
};

inline const std::vector<std::vector<double>>& Levels() {
  static const std::vector<std::vector<double>> levels = {
      {0, 0, 0}, {0.9, -0.4, 0.2}, {0.6, 0.5, 0.3}, {0.05, 0.1, 0}};
  return levels;
}

inline Demonstration Demonstrate(Rng& rng, const std::string& id, int spurious) {
  Demonstration made;
  struct Move {
    double begin_s, duration_s;
    std::vector<double> by;
  };
  std::vector<Move> moves;
  double t = rng.Uniform(0.3, 0.6);
  const double pace = rng.Uniform(0.8, 1.3);
  for (std::size_t e = 1; e < Levels().size(); ++e) {
    Move move{t, pace * rng.Uniform(0.8, 1.2), {}};
    for (std::size_t j = 0; j < 3; ++j) {
      move.by.push_back((Levels()[e][j] - Levels()[e - 1][j]) * rng.Uniform(0.95, 1.05));
    }
    made.begins_s.push_back(t);
    t += move.duration_s;
    moves.push_back(move);
    const double rest_s = rng.Uniform(0.9, 1.4);
    if (spurious > 0) {
      --spurious;
      moves.push_back({t + 0.25, 0.25, {0, 0, 0.12}});
      moves.push_back({t + 0.5, 0.25, {0, 0, -0.12}});
    }
    t += rest_s;
  }
  made.trial = EvenTrial(t, 60);
  made.trial.id = id;
  made.trial.joint_names = {"a", "b", "c"};
  const auto n = static_cast<Eigen::Index>(made.trial.time_s.size());
  made.trial.joints = Eigen::MatrixXd::Zero(n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double now = made.trial.time_s[static_cast<std::size_t>(k)];
    for (const Move& move : moves) {
      for (Eigen::Index j = 0; j < 3; ++j) {
        made.trial.joints(k, j) += move.by[static_cast<std::size_t>(j)] *
                                   MinimumJerk((now - move.begin_s) / move.duration_s);
      }
    }
  }
  return made;
}

inline std::vector<Demonstration> DemonstrateAll(Rng& rng, int n) {
  std::vector<Demonstration> all;
  for (int i = 0; i < n; ++i) all.push_back(Demonstrate(rng, "t" + std::to_string(i), i % 3));
  return all;
}

/// Trials with a marker that misses: a marker is the rise through c, somewhat after its motion's
/// begin.
inline int CountWrongTrials(const Alignment& aligned, const std::vector<Demonstration>& all) {
  constexpr double kLatest_s = 0.45;
  int wrong = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    bool right = true;
    for (std::size_t e = 0; e < all[i].begins_s.size(); ++e) {
      const double late = aligned.trials[i].own_knots_s[e + 1] - all[i].begins_s[e];
      right = right && late > 0 && late < kLatest_s;
    }
    wrong += right ? 0 : 1;
  }
  return wrong;
}

}  // namespace exemplar::learning
