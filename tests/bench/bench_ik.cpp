// Inverse kinematics beside KDL's: the same random reachable poses, from the middle of the limits,
// to 1e-5 m and rad. A pose counts as solved when our forward kinematics says so and every joint is
// within its limits.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#ifdef EXEMPLAR_WITH_KDL
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <kdl/chainiksolverpos_nr_jl.hpp>
#include <kdl/chainiksolvervel_pinv.hpp>

#include "support/kdl_peer.hpp"
#endif

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"

namespace exemplar {
namespace {

constexpr double kTolerance = 1e-5;

using SteadyClock = std::chrono::steady_clock;
using Solve = std::function<Eigen::VectorXd(const geometry::Pose&)>;

double Microseconds(SteadyClock::time_point from) {
  return std::chrono::duration<double, std::micro>(SteadyClock::now() - from).count();
}

class Bench {
 public:
  Bench(const kinematics::RobotModel& model, const kinematics::Chain& chain, int poses, int seed)
      : model_(model),
        chain_(chain),
        middle_(chain.dof()),
        lower_(chain.dof()),
        upper_(chain.dof()) {
    for (int i = 0; i < chain.dof(); ++i) {
      const kinematics::JointLimits& limits = chain.limits()[static_cast<std::size_t>(i)];
      const bool endless = !std::isfinite(limits.lower);
      lower_[i] = endless ? -std::numbers::pi : limits.lower;
      upper_[i] = endless ? std::numbers::pi : limits.upper;
      middle_[i] = 0.5 * (lower_[i] + upper_[i]);
    }
    Rng rng(static_cast<std::uint64_t>(seed));
    for (int i = 0; i < poses; ++i) goals_.push_back(chain.ToolPose(Random(rng)));
  }

  nlohmann::json Run() {
    nlohmann::json rows = nlohmann::json::array();
    rows.push_back(Measure("exemplar", [this](const geometry::Pose& goal) {
      const Result<kinematics::IkSolution> solution = kinematics::SolveIk(
          chain_, goal, middle_,
          {.position_tolerance_m = kTolerance, .rotation_tolerance_rad = kTolerance});
      return solution ? solution->q : middle_;
    }));
#ifdef EXEMPLAR_WITH_KDL
    if (const std::optional<KDL::Chain> peer = testing::ToKdl(model_, chain_)) AddKdl(*peer, rows);
#endif
    return rows;
  }

 private:
  Eigen::VectorXd Random(Rng& rng) const {
    Eigen::VectorXd q(chain_.dof());
    for (int i = 0; i < chain_.dof(); ++i) q[i] = rng.Uniform(lower_[i], upper_[i]);
    return q;
  }

  bool Solved(const geometry::Pose& goal, const Eigen::VectorXd& q) const {
    const geometry::Pose reached = chain_.ToolPose(q);
    for (int i = 0; i < chain_.dof(); ++i) {
      const kinematics::JointLimits& limits = chain_.limits()[static_cast<std::size_t>(i)];
      if (q[i] < limits.lower - 1e-9 || q[i] > limits.upper + 1e-9) return false;
    }
    return (reached.translation - goal.translation).norm() <= 1.01 * kTolerance &&
           geometry::AngleBetween(reached.rotation, goal.rotation) <= 1.01 * kTolerance;
  }

  nlohmann::json Measure(const std::string& name, const Solve& solve) const {
    std::vector<double> times;
    int solved = 0;
    for (const geometry::Pose& goal : goals_) {
      const SteadyClock::time_point start = SteadyClock::now();
      const Eigen::VectorXd q = solve(goal);
      times.push_back(Microseconds(start));
      solved += Solved(goal, q) ? 1 : 0;
    }
    std::sort(times.begin(), times.end());
    double sum = 0;
    for (const double time : times) sum += time;
    const double count = static_cast<double>(times.size());
    return {{"solver", name},
            {"solve_rate", solved / count},
            {"mean_us", sum / count},
            {"p99_us", times[static_cast<std::size_t>(0.99 * (count - 1))]}};
  }

#ifdef EXEMPLAR_WITH_KDL
  /// NR_JL as it comes: one descent within the limits. LMA knows no limits: it starts again from
  /// random postures until its answer happens to lie within them or 5 ms have gone.
  void AddKdl(const KDL::Chain& peer, nlohmann::json& rows) {
    const unsigned n = peer.getNrOfJoints();
    KDL::JntArray lower(n), upper(n), seed(n), answer(n);
    lower.data = lower_;
    upper.data = upper_;
    KDL::ChainFkSolverPos_recursive forward(peer);
    KDL::ChainIkSolverVel_pinv velocity(peer);
    // Its tolerance is each component's, ours the vector's: half of it leaves room for all three.
    KDL::ChainIkSolverPos_NR_JL newton(peer, lower, upper, forward, velocity, 500, kTolerance / 2);
    rows.push_back(Measure("kdl_nr_jl", [&](const geometry::Pose& goal) -> Eigen::VectorXd {
      seed.data = middle_;
      newton.CartToJnt(seed, testing::ToKdl(goal), answer);
      return answer.data;
    }));
    const Eigen::Matrix<double, 6, 1> alike = Eigen::Matrix<double, 6, 1>::Ones();
    KDL::ChainIkSolverPos_LMA marquardt(peer, alike, kTolerance / 2);
    Rng rng(3);
    rows.push_back(Measure("kdl_lma_restarts", [&](const geometry::Pose& goal) -> Eigen::VectorXd {
      const SteadyClock::time_point start = SteadyClock::now();
      seed.data = middle_;
      for (;;) {
        marquardt.CartToJnt(seed, testing::ToKdl(goal), answer);
        for (unsigned i = 0; i < n; ++i) {
          answer(i) = std::remainder(answer(i), 2 * std::numbers::pi);
        }
        if (Solved(goal, answer.data) || Microseconds(start) > 5000) return answer.data;
        seed.data = Random(rng);
      }
    }));
  }
#endif

  const kinematics::RobotModel& model_;
  const kinematics::Chain& chain_;
  Eigen::VectorXd middle_, lower_, upper_;
  std::vector<geometry::Pose> goals_;
};

}  // namespace
}  // namespace exemplar

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "bench_ik";
  std::string urdf, base, tip;
  int poses = 10000;
  int seed = 7;
  bool json = false;
  program::Options options(kName, "Measures inverse kinematics on random reachable poses",
                           "bench_ik --urdf arm.urdf --base base --tip tool --poses 10000 --json",
                           {});
  options.Add("--urdf", urdf, "the robot").Required();
  options.Add("--base", base, "link where the chain starts; the root when not given");
  options.Add("--tip", tip, "link where it ends; \"tool\" or the only leaf when not given");
  options.Add("--poses", poses, "how many").MinMax(1, 1e7);
  options.Add("--seed", seed, "of the poses");
  options.Add("--json", json, "print a JSON list instead of a table");
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  const Result<kinematics::RobotModel> model = kinematics::ReadUrdf(urdf);
  if (!model) return program::Fail(kName, model.error());
  const Result<kinematics::Chain> chain = kinematics::Chain::Create(*model, base, tip);
  if (!chain) return program::Fail(kName, chain.error());
  const nlohmann::json rows = Bench(*model, *chain, poses, seed).Run();
  if (json) {
    std::printf("%s\n", rows.dump(2).c_str());
    return 0;
  }
  std::printf("%-18s %11s %10s %10s\n", "solver", "solved", "mean us", "p99 us");
  for (const nlohmann::json& row : rows) {
    std::printf("%-18s %9.3f %% %10.1f %10.1f\n", row["solver"].get<std::string>().c_str(),
                100 * row["solve_rate"].get<double>(), row["mean_us"].get<double>(),
                row["p99_us"].get<double>());
  }
  return 0;
}
