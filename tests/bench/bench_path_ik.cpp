// Inverse kinematics of whole paths: ours beside the paper's variants, beside pose inverse
// kinematics frame by frame, and beside KDL's. A path is right when every frame is within 1e-4 m
// and rad of what is asked and every joint within its limits, by our forward kinematics. Times are
// of the processor.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#ifdef EXEMPLAR_WITH_KDL
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <kdl/chainiksolverpos_nr_jl.hpp>
#include <kdl/chainiksolvervel_pinv.hpp>

#include "support/kdl_peer.hpp"
#endif

#include "blended_paths.hpp"
#include "exemplar/kinematics/inverse_kinematics.hpp"
#include "exemplar/motion/path_ik.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"

namespace exemplar {
namespace {

constexpr double kTolerance = 1e-4;
constexpr double kLargeStep_rad = 0.2;
constexpr double kInterval_s = 1 / bench::BlendedPaths::kRate_hz;

/// The processor time of this program, which other programs on the machine do not add to.
double ProcessorMilliseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

struct Answer {
  Eigen::MatrixXd joints;
  std::vector<int> reported;  ///< frames said to be reached by a large step
};
using Solve = std::function<Answer(const bench::BlendedPath&)>;

/// What one solver made of one path.
struct Outcome {
  bool right = false;
  bool tracked = false;  ///< right, limits aside
  int frames_right = 0;
  int frames_outside = 0;  ///< a joint out of its limits
  int large_steps = 0;
  int unreported = 0;
  double style_rad = 0;   ///< root mean square
  double jerk = 0;        ///< root mean square, rad/s^3
  double travel_rad = 0;  ///< mean over the joints
  double energy_j = 0;    ///< mean kinetic energy
  double contact_m = 0;   ///< largest position error in contact
  double ms = 0;
};

class Bench {
 public:
  Bench(const kinematics::RobotModel& model, const kinematics::Chain& chain, int count, int seed)
      : model_(model), chain_(chain) {
    bench::BlendedPaths maker(chain, static_cast<std::uint64_t>(seed));
    for (int i = 0; i < count; ++i)
      paths_.push_back(maker.Make(static_cast<bench::PathKind>(i % 4)));
    Result<kinematics::ChainInertia> inertia = kinematics::ChainInertia::Create(model, chain);
    if (inertia.ok()) inertia_ = *std::move(inertia);
  }

  nlohmann::json Run() {
    for (const motion::PathIkVariant variant :
         {motion::PathIkVariant::kExemplar, motion::PathIkVariant::kPlain,
          motion::PathIkVariant::kEnergy, motion::PathIkVariant::kPath}) {
      if (variant == motion::PathIkVariant::kEnergy && !inertia_) continue;
      Measure(std::string(ToString(variant)), [&](const bench::BlendedPath& path) {
        const Eigen::VectorXd start = path.problem.style.row(0).transpose();
        const Result<motion::PathSolution> solution = motion::SolvePath(
            chain_, path.problem, start, variant, inertia_ ? &*inertia_ : nullptr);
        return Answer{solution->joints, solution->large_steps};
      });
    }
    Measure("pose_ik_per_frame", [&](const bench::BlendedPath& path) { return ByPoses(path); });
#ifdef EXEMPLAR_WITH_KDL
    if (const std::optional<KDL::Chain> peer = testing::ToKdl(model_, chain_)) AddKdl(*peer);
#endif
    return Rows();
  }

 private:
  template <class Frame>
  Answer FrameByFrame(const bench::BlendedPath& path, bool from_style, Frame&& frame) const {
    Answer answer{path.problem.style, {}};
    Eigen::VectorXd q = path.problem.style.row(0).transpose();
    for (int k = 0; k < answer.joints.rows(); ++k) {
      if (from_style) q = path.problem.style.row(k).transpose();
      q = frame(q, path.problem.base_T_tool[static_cast<std::size_t>(k)]);
      answer.joints.row(k) = q.transpose();
    }
    return answer;
  }

  Answer ByPoses(const bench::BlendedPath& path) const {
    kinematics::IkOptions options;
    options.position_tolerance_m = options.rotation_tolerance_rad = 0.5 * kTolerance;
    options.max_restarts = 20;
    return FrameByFrame(path, false, [&](const Eigen::VectorXd& seed, const geometry::Pose& goal) {
      const Result<kinematics::IkSolution> found = kinematics::SolveIk(chain_, goal, seed, options);
      return found ? found->q : seed;
    });
  }

#ifdef EXEMPLAR_WITH_KDL
  void AddKdl(const KDL::Chain& peer) {
    const unsigned n = peer.getNrOfJoints();
    KDL::JntArray lower(n), upper(n), seed(n), found(n);
    for (unsigned j = 0; j < n; ++j) {
      const kinematics::JointLimits& limits = chain_.limits()[j];
      const bool endless = !std::isfinite(limits.lower);
      lower(j) = endless ? -1e3 : limits.lower;
      upper(j) = endless ? 1e3 : limits.upper;
    }
    KDL::ChainFkSolverPos_recursive forward(peer);
    KDL::ChainIkSolverVel_pinv velocity(peer);
    KDL::ChainIkSolverPos_NR_JL newton(peer, lower, upper, forward, velocity, 100,
                                       0.3 * kTolerance);
    const auto by_newton = [&](const Eigen::VectorXd& from,
                               const geometry::Pose& goal) -> Eigen::VectorXd {
      seed.data = from;
      return newton.CartToJnt(seed, testing::ToKdl(goal), found) >= 0 ? found.data : from;
    };
    Measure("kdl_nr_jl_from_previous",
            [&](const bench::BlendedPath& path) { return FrameByFrame(path, false, by_newton); });
    Measure("kdl_nr_jl_from_style",
            [&](const bench::BlendedPath& path) { return FrameByFrame(path, true, by_newton); });
    const Eigen::Matrix<double, 6, 1> alike = Eigen::Matrix<double, 6, 1>::Ones();
    KDL::ChainIkSolverPos_LMA marquardt(peer, alike, 0.3 * kTolerance, 100);
    Measure("kdl_lma_from_previous", [&](const bench::BlendedPath& path) {
      return FrameByFrame(
          path, false,
          [&](const Eigen::VectorXd& from, const geometry::Pose& goal) -> Eigen::VectorXd {
            seed.data = from;
            return marquardt.CartToJnt(seed, testing::ToKdl(goal), found) >= 0 ? found.data : from;
          });
    });
  }
#endif

  void Measure(const std::string& name, const Solve& solve) {
    solvers_.push_back(name);
    std::vector<Outcome>& outcomes = outcomes_[name];
    for (const bench::BlendedPath& path : paths_) {
      const double start = ProcessorMilliseconds();
      const Answer answer = solve(path);
      const double ms = ProcessorMilliseconds() - start;
      outcomes.push_back(Judge(path, answer));
      outcomes.back().ms = ms;
    }
  }

  Outcome Judge(const bench::BlendedPath& path, const Answer& answer) const {
    Outcome out;
    out.tracked = true;
    const Eigen::MatrixXd& q = answer.joints;
    const int frames = static_cast<int>(q.rows());
    for (int k = 0; k < frames; ++k) {
      const geometry::Pose at = chain_.ToolPose(q.row(k).transpose());
      const geometry::Pose& goal = path.problem.base_T_tool[static_cast<std::size_t>(k)];
      const double position = (at.translation - goal.translation).norm();
      bool inside = true;
      for (int j = 0; j < chain_.dof(); ++j) {
        const kinematics::JointLimits& limits = chain_.limits()[static_cast<std::size_t>(j)];
        inside = inside && q(k, j) >= limits.lower - 1e-9 && q(k, j) <= limits.upper + 1e-9;
      }
      out.frames_outside += inside ? 0 : 1;
      const bool met = position <= kTolerance &&
                       geometry::AngleBetween(at.rotation, goal.rotation) <= kTolerance;
      out.frames_right += met && inside ? 1 : 0;
      out.tracked = out.tracked && met;
      if (k >= path.contact_first) out.contact_m = std::max(out.contact_m, position);
      if (k == 0) continue;
      if ((q.row(k) - q.row(k - 1)).cwiseAbs().maxCoeff() > kLargeStep_rad) {
        ++out.large_steps;
        const bool said =
            std::find(answer.reported.begin(), answer.reported.end(), k) != answer.reported.end();
        out.unreported += said ? 0 : 1;
      }
    }
    out.right = out.frames_right == frames;
    out.style_rad =
        std::sqrt((q - path.problem.style).squaredNorm() / static_cast<double>(q.size()));
    const Eigen::Index n = frames;
    const Eigen::MatrixXd third = q.bottomRows(n - 3) - 3 * q.middleRows(2, n - 3) +
                                  3 * q.middleRows(1, n - 3) - q.topRows(n - 3);
    out.jerk = std::sqrt(third.squaredNorm() / static_cast<double>(third.size())) /
               std::pow(kInterval_s, 3);
    const Eigen::MatrixXd rate = (q.bottomRows(n - 1) - q.topRows(n - 1)) / kInterval_s;
    out.travel_rad = kInterval_s * rate.cwiseAbs().sum() / chain_.dof();
    constexpr int kEnergyStride = 4;
    if (inertia_) {
      int terms = 0;
      for (Eigen::Index k = 0; k < rate.rows(); k += kEnergyStride, ++terms) {
        const Eigen::VectorXd v = rate.row(k).transpose();
        out.energy_j += 0.5 * v.dot(inertia_->MassMatrix(q.row(k).transpose()) * v);
      }
      out.energy_j /= terms;
    }
    return out;
  }

  static double Mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
  }

  static double Quantile(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(part * (static_cast<double>(values.size()) - 1))];
  }

  /// Paths that all variants, and KDL's from the style where it is there, follow in every frame,
  /// limits aside: only on these their manners can be compared.
  std::vector<std::size_t> Common() const {
    std::vector<std::size_t> common;
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      bool all = true;
      for (const std::string& solver : solvers_) {
        const bool compared = solver == "exemplar" || solver == "plain" || solver == "energy" ||
                              solver == "path" || solver == "kdl_nr_jl_from_style";
        all = all && (!compared || outcomes_.at(solver)[i].tracked);
      }
      if (all) common.push_back(i);
    }
    return common;
  }

  nlohmann::json Rows() const {
    nlohmann::json rows = nlohmann::json::array();
    const std::vector<std::size_t> common = Common();
    for (const std::string& solver : solvers_) {
      const std::vector<Outcome>& outcomes = outcomes_.at(solver);
      std::array<int, 4> right{};
      std::array<int, 4> of{};
      std::vector<double> ms, ms_of_right, style, jerk, travel, energy, contact, style_of_right;
      int all_right = 0, frames_right = 0, outside = 0, large = 0, unreported = 0;
      for (std::size_t i = 0; i < outcomes.size(); ++i) {
        const Outcome& out = outcomes[i];
        const auto kind = static_cast<std::size_t>(paths_[i].kind);
        ++of[kind];
        right[kind] += out.right ? 1 : 0;
        all_right += out.right ? 1 : 0;
        frames_right += out.frames_right;
        outside += out.frames_outside;
        large += out.large_steps;
        unreported += out.unreported;
        ms.push_back(out.ms);
        if (out.right) style_of_right.push_back(out.style_rad);
        if (out.right) ms_of_right.push_back(out.ms);
      }
      for (const std::size_t i : common) {
        style.push_back(outcomes[i].style_rad);
        jerk.push_back(outcomes[i].jerk);
        travel.push_back(outcomes[i].travel_rad);
        energy.push_back(outcomes[i].energy_j);
        contact.push_back(outcomes[i].contact_m);
      }
      const double paths = static_cast<double>(paths_.size());
      nlohmann::json row = {
          {"solver", solver},
          {"paths", paths_.size()},
          {"paths_right", all_right / paths},
          {"frames_right", frames_right / (paths * bench::BlendedPaths::kFrames)},
          {"limit_violating_frames", outside / (paths * bench::BlendedPaths::kFrames)},
          {"large_steps", large},
          {"unreported_large_steps", unreported},
          {"style_error_rad_of_right_paths", Mean(style_of_right)},
          {"compared_paths", common.size()},
          {"style_error_rad", Mean(style)},
          {"rms_jerk_rad_s3", Mean(jerk)},
          {"median_jerk_rad_s3", Quantile(jerk, 0.5)},
          {"travel_rad", Mean(travel)},
          {"contact_error_m", Quantile(contact, 1.0)},
          {"mean_ms", Mean(ms)},
          {"mean_ms_of_right_paths", Mean(ms_of_right)},
          {"p95_ms", Quantile(ms, 0.95)},
          {"max_ms", Quantile(ms, 1.0)}};
      if (inertia_) row["kinetic_energy_j"] = Mean(energy);
      for (std::size_t kind = 0; kind < of.size(); ++kind) {
        const double share = of[kind] == 0 ? 0.0 : static_cast<double>(right[kind]) / of[kind];
        row["paths_right_by_kind"][bench::kPathKindNames[kind]] = share;
      }
      rows.push_back(row);
    }
    return rows;
  }

  const kinematics::RobotModel& model_;
  const kinematics::Chain& chain_;
  std::optional<kinematics::ChainInertia> inertia_;
  std::vector<bench::BlendedPath> paths_;
  std::vector<std::string> solvers_;
  std::map<std::string, std::vector<Outcome>> outcomes_;
};

void PrintTable(const nlohmann::json& rows) {
  std::printf("%-24s %6s %5s %5s %5s %5s %7s %7s %6s %6s %7s %6s %7s\n", "solver", "paths%", "easy",
              "sing", "edge", "past", "frames%", "limits%", "jumps", "unsaid", "mean ms", "p95",
              "right's");
  for (const nlohmann::json& row : rows) {
    const nlohmann::json& kinds = row["paths_right_by_kind"];
    const auto percent = [](const nlohmann::json& share) { return 100 * share.get<double>(); };
    std::printf("%-24s %6.1f %5.0f %5.0f %5.0f %5.0f %7.2f %7.2f %6d %6d %7.2f %6.1f %7.2f\n",
                row["solver"].get<std::string>().c_str(), percent(row["paths_right"]),
                percent(kinds["easy"]), percent(kinds["near_singular"]), percent(kinds["edge"]),
                percent(kinds["beyond"]), percent(row["frames_right"]),
                percent(row["limit_violating_frames"]), row["large_steps"].get<int>(),
                row["unreported_large_steps"].get<int>(), row["mean_ms"].get<double>(),
                row["p95_ms"].get<double>(), row["mean_ms_of_right_paths"].get<double>());
  }
  std::printf(
      "\nOn the %d paths that all variants and kdl_nr_jl_from_style follow, limits aside:\n%-24s "
      "%9s %12s %12s %9s %9s %12s\n",
      rows.front()["compared_paths"].get<int>(), "solver", "style rad", "jerk rad/s3",
      "median jerk", "travel", "energy J", "contact um");
  for (const nlohmann::json& row : rows) {
    std::printf("%-24s %9.4f %12.2f %12.2f %9.3f %9.4f %12.2f\n",
                row["solver"].get<std::string>().c_str(), row["style_error_rad"].get<double>(),
                row["rms_jerk_rad_s3"].get<double>(), row["median_jerk_rad_s3"].get<double>(),
                row["travel_rad"].get<double>(), row.value("kinetic_energy_j", std::nan("")),
                1e6 * row["contact_error_m"].get<double>());
  }
}

}  // namespace
}  // namespace exemplar

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "bench_path_ik";
  std::string urdf, base, tip;
  int paths = 300;
  int seed = 5;
  bool json = false;
  program::Options options(
      kName, "Measures inverse kinematics of whole paths on random blended paths",
      "bench_path_ik --urdf arm.urdf --base base --tip tool --paths 300 --json", {});
  options.Add("--urdf", urdf, "the robot").Required();
  options.Add("--base", base, "link where the chain starts; the root when not given");
  options.Add("--tip", tip, "link where it ends; \"tool\" or the only leaf when not given");
  options.Add("--paths", paths, "how many, of 300 frames each").MinMax(1, 1e6);
  options.Add("--seed", seed, "of the paths");
  options.Add("--json", json, "print a JSON list instead of a table");
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  const Result<kinematics::RobotModel> model = kinematics::ReadUrdf(urdf);
  if (!model) return program::Fail(kName, model.error());
  const Result<kinematics::Chain> chain = kinematics::Chain::Create(*model, base, tip);
  if (!chain) return program::Fail(kName, chain.error());
  const nlohmann::json rows = Bench(*model, *chain, paths, seed).Run();
  if (json) {
    std::printf("%s\n", rows.dump(2).c_str());
  } else {
    PrintTable(rows);
  }
  return 0;
}
