// Verdicts on random states beside FCL's on meshes, and proofs that motions are free beside plain
// sampling.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "pairs.hpp"
#include "support/fcl_judge.hpp"

namespace exemplar {
namespace {

using collision::CheckerOptions;
using collision::CollisionChecker;
using testing::FclJudge;

constexpr double kRequired_m = 2e-3;  // what plans ask for
constexpr double kClear_m = 5e-3;     // what must be accepted
constexpr int kScenes = 20;           // of the states with obstacles
constexpr int kObstacles = 20;
constexpr int kBlock = 20;        // states timed at once: the clock itself takes time
constexpr int kFramesALeg = 150;  // four legs: 10 s at 60 Hz

using SteadyClock = std::chrono::steady_clock;

double Microseconds(SteadyClock::time_point from) {
  return std::chrono::duration<double, std::micro>(SteadyClock::now() - from).count();
}

double Median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

struct Robot {
  std::string name;
  kinematics::RobotModel model;
  CheckerOptions options;
  std::string bone;  ///< a mesh that is not convex, for the scenes
};

Eigen::Vector3d Middle(const kinematics::RobotModel& model) {
  std::vector<geometry::Pose> poses;
  kinematics::LinkPoses(
      model, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size())), poses);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const geometry::Pose& pose : poses) {
    middle += pose.translation / static_cast<double>(poses.size());
  }
  return middle;
}

/// The pairs that a checker with these options must watch: all, but for those that FCL finds in
/// each other in every state.
FclJudge::LinkPairs PairsToWatch(const Robot& robot, FclJudge& judge,
                                 const std::vector<Eigen::VectorXd>& states) {
  const auto parts = collision::MakeRobotParts(robot.model);
  FclJudge::LinkPairs pairs =
      *collision::CheckedLinkPairs(robot.model, *parts, robot.options.allowed_pairs);
  if (robot.options.sampled_allowed_states == 0) return pairs;
  std::set<std::pair<int, int>> always(pairs.begin(), pairs.end());
  for (const Eigen::VectorXd& q : states) {
    if (always.empty()) break;
    const FclJudge::LinkPairs asked(always.begin(), always.end());
    const auto touching = judge.TouchingLinks(q, asked);
    std::erase_if(always, [&](const auto& pair) { return !touching.contains(pair); });
  }
  std::erase_if(pairs, [&](const auto& pair) { return always.contains(pair); });
  return pairs;
}

nlohmann::json Verdicts(const Robot& robot, int count, bool obstacles) {
  Rng rng(11);
  std::vector<Eigen::VectorXd> states;
  for (int i = 0; i < count; ++i) states.push_back(testing::RandomState(robot.model, rng));
  CollisionChecker checker = *CollisionChecker::Create(robot.model, {}, robot.options);
  FclJudge alone(robot.model, {});
  const FclJudge::LinkPairs pairs = PairsToWatch(robot, alone, states);
  int hits = 0, missed = 0, clear = 0, accepted = 0;
  std::vector<double> ours_us, fcl_us;
  const int scenes = obstacles ? kScenes : 1;
  for (int scene_index = 0; scene_index < scenes; ++scene_index) {
    collision::Scene scene;
    if (obstacles) {
      scene = testing::RandomScene(rng, kObstacles, Middle(robot.model), 0.9, robot.bone);
    }
    if (const Status set = checker.SetScene(scene); !set.ok()) {
      std::fprintf(stderr, "%s\n", set.error().message.c_str());
      std::exit(1);
    }
    FclJudge judge(robot.model, scene);
    for (int i = scene_index; i < count; i += scenes) {
      const Eigen::VectorXd& q = states[static_cast<std::size_t>(i)];
      auto start = SteadyClock::now();
      const double ours = checker.SmallestClearance(q).distance_m;
      ours_us.push_back(Microseconds(start));
      start = SteadyClock::now();
      const bool hit = judge.Collides(q, pairs);
      fcl_us.push_back(Microseconds(start));
      hits += hit;
      missed += hit && ours > 0;
      if (hit) continue;
      const double truth = judge.Distance(q, pairs, kClear_m);
      if (truth < kClear_m) continue;
      ++clear;
      accepted += ours >= kRequired_m;
    }
  }
  std::vector<double> capsules_us;
  double sum = 0;
  for (int begin = 0; begin + kBlock <= count; begin += kBlock) {
    const auto start = SteadyClock::now();
    for (int i = begin; i < begin + kBlock; ++i) {
      sum += checker.CapsuleSelfClearance(states[static_cast<std::size_t>(i)]);
    }
    capsules_us.push_back(Microseconds(start) / kBlock);
  }
  if (std::isnan(sum)) std::abort();
  return {{"robot", robot.name},
          {"obstacles", obstacles ? kObstacles : 0},
          {"states", count},
          {"pairs", pairs.size()},
          {"fcl_hits", hits},
          {"missed", missed},
          {"clear", clear},
          {"accepted", clear > 0 ? double(accepted) / clear : 1.0},
          {"capsules_us", Median(capsules_us)},
          {"verdict_us", Median(ours_us)},
          {"fcl_us", Median(fcl_us)}};
}

/// The smallest clearance at places along a path.
double Sampled(const CollisionChecker& checker, const testing::SampledPath& path, int a_frame) {
  Eigen::VectorXd q(path[0].size());
  double smallest = 1e300;
  const int places = (static_cast<int>(path.frames()) - 1) * a_frame;
  for (int k = 0; k <= places; ++k) {
    path.Position(static_cast<double>(k) / a_frame, q);
    smallest = std::min(smallest, checker.SmallestClearance(q).distance_m);
  }
  return smallest;
}

nlohmann::json Motions(const Robot& robot, const Eigen::VectorXd& home, int count) {
  Rng rng(12);
  CollisionChecker checker = *CollisionChecker::Create(robot.model, {}, robot.options);
  std::vector<double> proof_ms, sampling_ms;
  int free = 0, accepted = 0;
  for (int tried = 0; free < count && tried < 40 * count; ++tried) {
    if (!checker.SetScene(testing::RandomScene(rng, kObstacles, Middle(robot.model), 1.1)).ok()) {
      continue;
    }
    const testing::SampledPath path =
        testing::RandomMotion(robot.model, home, rng, 4, kFramesALeg, 0.25);
    if (checker.SmallestClearance(path[0]).distance_m < kClear_m) continue;
    auto start = SteadyClock::now();
    const double clearance = Sampled(checker, path, 1);
    const double sampling = Microseconds(start) / 1000;
    if (clearance < kClear_m) continue;
    const double last = static_cast<double>(path.frames() - 1);
    start = SteadyClock::now();
    const auto found = checker.FirstViolation(path, 0, last, kRequired_m);
    proof_ms.push_back(Microseconds(start) / 1000);
    sampling_ms.push_back(sampling);
    ++free;
    accepted += !found;
  }
  // Thin sheets at the edge of what quick motions sweep.
  int passed_by_sampling = 0, caught = 0, sheets = 0;
  for (int i = 0; i < 100 * count; ++i) {
    const testing::SampledPath path = testing::RandomMotion(robot.model, home, rng, 1, 12, 0.6);
    std::vector<geometry::Pose> poses;
    Eigen::VectorXd q(path[0].size());
    path.Position(rng.Uniform(4, 8), q);
    kinematics::LinkPoses(robot.model, q, poses);
    collision::Scene scene;
    geometry::Pose at = testing::RandomPlace(rng, poses.back().translation, 0.03);
    scene.objects.push_back({"sheet", at, kinematics::Box{{0.02, 0.02, 1e-5}}});
    if (!checker.SetScene(scene).ok() || Sampled(checker, path, 1) <= 0) continue;
    if (Sampled(checker, path, 50) > 0) continue;
    ++sheets;
    ++passed_by_sampling;
    caught +=
        checker.FirstViolation(path, 0, static_cast<double>(path.frames() - 1), 0).has_value();
  }
  return {{"robot", robot.name},
          {"motions", free},
          {"accepted", accepted},
          {"proof_ms", Median(proof_ms)},
          {"proof_ms_worst",
           proof_ms.empty() ? 0 : *std::max_element(proof_ms.begin(), proof_ms.end())},
          {"sampling_60_hz_ms", Median(sampling_ms)},
          {"sheets_that_sampling_passes", passed_by_sampling},
          {"sheets_caught", caught}};
}

std::filesystem::path DataFolder() {
  const char* data = std::getenv("EXEMPLAR_DATA");
  return data != nullptr ? std::filesystem::path(data)
                         : std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "../shared/data";
}

}  // namespace
}  // namespace exemplar

int main(int argc, char** argv) {
  using namespace exemplar;
  constexpr const char* kName = "bench_collision";
  int states = 10000;
  int motions = 20;
  bool json = false;
  std::string only;
  program::Options options(
      kName, "Judges collision verdicts by FCL on meshes, and times proofs of motions",
      "bench_collision --states 10000 --motions 20", {});
  options.Add("--states", states, "a robot").MinMax(1, 1e7);
  options.Add("--motions", motions, "a robot").MinMax(1, 1e5);
  options.Add("--only", only, "one robot by name; all when not given");
  options.Add("--json", json, "print a JSON object instead of tables");
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  const std::filesystem::path folder = std::filesystem::temp_directory_path() / kName;
  std::filesystem::create_directories(folder);
  const std::string bone = (folder / "bone.stl").string();
  testing::WriteStl(bone, testing::Bone({0, 0, 0.15}, 0.05));
  struct Entry {
    Robot robot;
    Eigen::VectorXd home;
  };
  std::vector<Entry> robots;
  for (const char* name : {"arm7", "leonardo", "ur5e_like"}) {
    if (!only.empty() && only != name) continue;
    const auto robot = kinematics::ReadRobotDescription(std::filesystem::path(EXEMPLAR_SOURCE_DIR) /
                                                        "deploy/models" / name);
    if (!robot) return program::Fail(kName, robot.error());
    robots.push_back({{name, robot->model, collision::OptionsOf(*robot), bone},
                      kinematics::FullJointVector(robot->model, robot->chain, robot->home)});
  }
  const std::filesystem::path data = DataFolder() / "robots";
  for (const char* name : {"panda/panda_description/urdf/panda", "ur5e", "icub"}) {
    const std::string short_name = std::filesystem::path(name).filename().string();
    if (!only.empty() && only != short_name) continue;
    Result<kinematics::RobotModel> model =
        kinematics::ReadUrdf(data / (std::string(name) + ".urdf"));
    if (!model) {
      std::fprintf(stderr, "%s: left out: %s\n", kName, model.error().message.c_str());
      continue;
    }
    CheckerOptions with;
    if (std::filesystem::exists(data / short_name / (short_name + ".srdf"))) {
      const auto pairs = kinematics::ReadSrdf(data / short_name / (short_name + ".srdf"), *model);
      if (!pairs) return program::Fail(kName, pairs.error());
      with.allowed_pairs = *pairs;
      with.sampled_allowed_states = 0;
    }
    std::string title = short_name;
    if (testing::GiveBones(*model, folder) > 0) {
      title += " (bones for its meshes)";
      with.sampled_allowed_states = 0;
      with.allowed_pairs = testing::AlmostAlwaysTouching(
          *model, *collision::CheckedLinkPairs(*model, *collision::MakeRobotParts(*model), {}));
    }
    const Eigen::VectorXd zero =
        Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model->joints.size()));
    Eigen::VectorXd home = zero;
    for (std::size_t j = 0; j < model->joints.size(); ++j) {
      const kinematics::JointLimits& limits = model->joints[j].limits;
      if (model->joints[j].type == kinematics::JointType::kFixed) continue;
      if (std::isfinite(limits.lower + limits.upper)) {
        home[static_cast<Eigen::Index>(j)] = 0.5 * (limits.lower + limits.upper);
      }
    }
    robots.push_back({{title, *std::move(model), with, bone}, home});
  }

  nlohmann::json out = {{"verdicts", nlohmann::json::array()},
                        {"motions", nlohmann::json::array()}};
  if (!json) {
    std::printf("%-30s %9s %7s %7s %7s %9s %9s %11s %10s %8s\n", "robot", "obstacles", "states",
                "hits", "missed", ">= 5 mm", "accepted", "capsules us", "verdict us", "FCL us");
  }
  for (const Entry& entry : robots) {
    for (const bool obstacles : {false, true}) {
      const nlohmann::json row = Verdicts(entry.robot, states, obstacles);
      out["verdicts"].push_back(row);
      if (json) continue;
      std::printf("%-30s %9d %7d %7d %7d %9d %7.2f %% %11.2f %10.1f %8.1f\n",
                  entry.robot.name.c_str(), row["obstacles"].get<int>(), states,
                  row["fcl_hits"].get<int>(), row["missed"].get<int>(), row["clear"].get<int>(),
                  100 * row["accepted"].get<double>(), row["capsules_us"].get<double>(),
                  row["verdict_us"].get<double>(), row["fcl_us"].get<double>());
      std::fflush(stdout);
    }
  }
  if (!json) {
    std::printf("\n%-30s %8s %9s %9s %9s %12s %14s %7s\n", "10 s at 60 Hz, 20 obstacles", "motions",
                "accepted", "proof ms", "worst ms", "sampling ms", "sheets passed", "caught");
  }
  for (const Entry& entry : robots) {
    const nlohmann::json row = Motions(entry.robot, entry.home, motions);
    out["motions"].push_back(row);
    if (json) continue;
    std::printf("%-30s %8d %9d %9.1f %9.1f %12.1f %14d %7d\n", entry.robot.name.c_str(),
                row["motions"].get<int>(), row["accepted"].get<int>(),
                row["proof_ms"].get<double>(), row["proof_ms_worst"].get<double>(),
                row["sampling_60_hz_ms"].get<double>(),
                row["sheets_that_sampling_passes"].get<int>(), row["sheets_caught"].get<int>());
    std::fflush(stdout);
  }
  if (json) std::printf("%s\n", out.dump(2).c_str());
  return 0;
}
