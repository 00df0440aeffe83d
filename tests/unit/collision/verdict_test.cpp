// Verdicts judged by FCL on meshes, and proofs judged by fine sampling. The long forms (all of
// 10,000 states a robot, 10,000 scenes) run with tests/run --all.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "pairs.hpp"
#include "support/fcl_judge.hpp"

namespace exemplar::collision {
namespace {

namespace fs = std::filesystem;
using testing::FclJudge;

constexpr double kRequired_m = 2e-3;
/// Distances are lower bounds, at most 1e-5 m too small.
constexpr double kPrecision_m = 2e-5;

int CountFrom(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::atoi(text) : otherwise;
}

fs::path DataFolder() {
  const char* data = std::getenv("EXEMPLAR_DATA");
  return data != nullptr ? fs::path(data) : fs::path(EXEMPLAR_SOURCE_DIR) / "../shared/data";
}

struct Robot {
  std::string name;
  kinematics::RobotModel model;
  CheckerOptions options;
};

std::vector<Robot> OurRobots() {
  std::vector<Robot> robots;
  for (const char* name : {"arm7", "leonardo", "ur5e_like"}) {
    const auto robot =
        *kinematics::ReadRobotDescription(fs::path(EXEMPLAR_SOURCE_DIR) / "deploy/models" / name);
    robots.push_back({name, robot.model, OptionsOf(robot)});
  }
  return robots;
}

/// Panda with its meshes and SRDF; UR5e and iCub, whose meshes are not at hand, with bones.
std::vector<Robot> RealRobots(const fs::path& bones) {
  std::vector<Robot> robots;
  const fs::path folder = DataFolder() / "robots";
  if (!fs::exists(folder)) return robots;
  fs::create_directories(bones);
  Robot panda{
      "panda", *kinematics::ReadUrdf(folder / "panda/panda_description/urdf/panda.urdf"), {}};
  panda.options.allowed_pairs = *kinematics::ReadSrdf(folder / "panda/panda.srdf", panda.model);
  panda.options.sampled_allowed_states = 0;
  robots.push_back(panda);
  for (const char* name : {"ur5e", "icub"}) {
    Robot robot{name, *kinematics::ReadUrdf(folder / (std::string(name) + ".urdf")), {}};
    EXPECT_GT(testing::GiveBones(robot.model, bones), 0);
    robot.options.sampled_allowed_states = 0;
    robot.options.allowed_pairs = testing::AlmostAlwaysTouching(
        robot.model, *CheckedLinkPairs(robot.model, *MakeRobotParts(robot.model), {}));
    robots.push_back(robot);
  }
  return robots;
}

/// All pairs worth checking, but for those that FCL finds in each other in every state.
FclJudge::LinkPairs PairsToWatch(const Robot& robot, const std::vector<Eigen::VectorXd>& states) {
  FclJudge::LinkPairs pairs =
      *CheckedLinkPairs(robot.model, *MakeRobotParts(robot.model), robot.options.allowed_pairs);
  if (robot.options.sampled_allowed_states == 0) return pairs;
  FclJudge judge(robot.model, {});
  std::set<std::pair<int, int>> always(pairs.begin(), pairs.end());
  for (const Eigen::VectorXd& q : states) {
    const auto touching = judge.TouchingLinks(q, {always.begin(), always.end()});
    std::erase_if(always, [&](const auto& pair) { return !touching.contains(pair); });
    if (always.empty()) break;
  }
  std::erase_if(pairs, [&](const auto& pair) { return always.contains(pair); });
  return pairs;
}

void Judge(const Robot& robot, int count) {
  SCOPED_TRACE(robot.name);
  Rng rng(11);
  std::vector<Eigen::VectorXd> states;
  for (int i = 0; i < count; ++i) states.push_back(testing::RandomState(robot.model, rng));
  const FclJudge::LinkPairs pairs = PairsToWatch(robot, states);
  const fs::path bone = fs::path(::testing::TempDir()) / "exemplar_verdict_bone.stl";
  testing::WriteStl(bone, testing::Bone({0, 0, 0.15}, 0.05));
  CollisionChecker checker = *CollisionChecker::Create(robot.model, {}, robot.options);
  for (const int obstacles : {0, 10}) {
    const Scene scene = testing::RandomScene(rng, obstacles, {0.2, 0, 0.4}, 0.9, bone.string());
    ASSERT_TRUE(checker.SetScene(scene).ok());
    FclJudge judge(robot.model, scene);
    int hits = 0;
    int clear = 0;
    int accepted = 0;
    for (const Eigen::VectorXd& q : states) {
      const double ours = checker.SmallestClearance(q).distance_m;
      if (judge.Collides(q, pairs)) {
        ++hits;
        EXPECT_LE(ours, 0);
      } else if (judge.Distance(q, pairs, 5e-3) >= 5e-3) {
        ++clear;
        accepted += ours >= kRequired_m;
      }
    }
    EXPECT_GT(hits + clear, count / 2);
    EXPECT_GE(accepted, 0.99 * clear) << clear << " clear";
  }
}

TEST(Verdict, MissesNothingAndAcceptsWhatIsClearOnOurRobots) {
  for (const Robot& robot : OurRobots()) Judge(robot, CountFrom("EXEMPLAR_COLLISION_STATES", 150));
}

TEST(Verdict, MissesNothingAndAcceptsWhatIsClearOnRealRobots) {
  const fs::path bones = fs::path(::testing::TempDir()) / "exemplar_verdict_bones";
  const std::vector<Robot> robots = RealRobots(bones);
  if (robots.empty()) GTEST_SKIP() << "EXEMPLAR_DATA has no robots";
  for (const Robot& robot : robots) Judge(robot, CountFrom("EXEMPLAR_COLLISION_STATES", 40));
  fs::remove_all(bones);
}

TEST(Proof, AgreesWithFineSamplingOfRandomScenes) {
  constexpr int kSamples = 300;
  const int scenes = CountFrom("EXEMPLAR_COLLISION_SCENES", 120);
  const fs::path bone = fs::path(::testing::TempDir()) / "exemplar_proof_bone.stl";
  testing::WriteStl(bone, testing::Bone({0, 0, 0.15}, 0.05));
  const std::vector<Robot> robots = OurRobots();
  std::vector<CollisionChecker> checkers;
  for (const Robot& robot : robots) {
    checkers.push_back(*CollisionChecker::Create(robot.model, {}, robot.options));
  }
  Rng rng(13);
  int free = 0;
  int violating = 0;
  for (int i = 0; i < scenes; ++i) {
    const std::size_t which = static_cast<std::size_t>(i) % robots.size();
    const kinematics::RobotModel& model = robots[which].model;
    CollisionChecker& checker = checkers[which];
    ASSERT_TRUE(
        checker.SetScene(testing::RandomScene(rng, 5, {0.2, 0, 0.4}, 0.9, bone.string())).ok());
    const Eigen::VectorXd from = testing::RandomState(model, rng);
    const testing::SampledPath path(
        {from, from + 0.15 * (testing::RandomState(model, rng) - from)});
    Eigen::VectorXd q(from.size());
    double smallest = 1e9;
    double first_s = 2;
    for (int k = 0; k <= kSamples; ++k) {
      const double s = static_cast<double>(k) / kSamples;
      path.Position(s, q);
      const double clearance = checker.SmallestClearance(q).distance_m;
      smallest = std::min(smallest, clearance);
      if (clearance < kRequired_m - kPrecision_m) {
        first_s = s;
        break;
      }
    }
    const std::optional<Violation> found = checker.FirstViolation(path, 0, 1, kRequired_m);
    if (first_s <= 1) {
      ++violating;
      ASSERT_TRUE(found.has_value()) << i << ": " << smallest;
      EXPECT_LE(found->s, first_s + 1e-3) << i;  // 0.1 mm of motion
      EXPECT_LT(found->clearance.distance_m, kRequired_m + 1e-4) << i;
    } else if (smallest >= 5e-3) {
      ++free;
      EXPECT_FALSE(found.has_value()) << i << ": " << smallest;
    }
  }
  EXPECT_GT(free, scenes / 10);
  EXPECT_GT(violating, scenes / 10);
}

/// Sheets at the edge of what a quick motion sweeps, which its frames at 60 Hz do not meet.
TEST(Proof, CatchesTheThinSheetsThatFramesPassBy) {
  Rng rng(14);
  const Robot robot = OurRobots().front();
  CollisionChecker checker = *CollisionChecker::Create(robot.model, {}, robot.options);
  const Eigen::VectorXd middle =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(robot.model.joints.size()));
  int passed_by = 0;
  for (int i = 0; i < 200; ++i) {
    const testing::SampledPath path = testing::RandomMotion(robot.model, middle, rng, 1, 12, 0.6);
    Eigen::VectorXd q(middle.size());
    path.Position(rng.Uniform(4, 8), q);
    std::vector<geometry::Pose> poses;
    kinematics::LinkPoses(robot.model, q, poses);
    const Scene scene{{{"sheet", testing::RandomPlace(rng, poses.back().translation, 0.03),
                        kinematics::Box{{0.02, 0.02, 1e-5}}}}};
    ASSERT_TRUE(checker.SetScene(scene).ok());
    const auto hits = [&](double s) {
      path.Position(s, q);
      return checker.SmallestClearance(q).distance_m <= 0;
    };
    bool at_frames = false;
    bool between = false;
    for (int k = 0; k <= 12; ++k) at_frames = at_frames || hits(k);
    for (int k = 0; k <= 600 && !at_frames && !between; ++k) between = hits(0.02 * k);
    if (at_frames || !between) continue;
    ++passed_by;
    EXPECT_TRUE(checker.FirstViolation(path, 0, 12, 0).has_value()) << i;
  }
  EXPECT_GT(passed_by, 3);
}

}  // namespace
}  // namespace exemplar::collision
