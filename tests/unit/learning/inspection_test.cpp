#include "exemplar/learning/inspection.hpp"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "pressing_arm.hpp"

namespace exemplar::learning {
namespace {

Skill Learned(std::size_t count, bool joints, LearnOptions options = {}) {
  const auto arm = joints ? std::make_shared<PressingArm>() : nullptr;
  PressOptions press;
  press.joints = joints;
  Result<Skill> skill = LearnSkill(MakePresses(count, press), options, arm);
  EXPECT_TRUE(skill.ok()) << skill.error().message;
  return *std::move(skill);
}

double Largest(const Eigen::MatrixXd& path) {
  return (path.colwise().maxCoeff() - path.colwise().minCoeff()).norm();
}

TEST(Inspection, JointWiseSolutionMissesTheButtonWhereTheBlendedOneMeetsIt) {
  const Skill skill = Learned(6, true, {.method = Method::kPaper});
  const Inspection inspection = Inspect(skill);
  ASSERT_TRUE(inspection.map.has_value());
  EXPECT_TRUE(inspection.through_joints);
  EXPECT_TRUE(inspection.contact_found);
  EXPECT_GT(inspection.map->absolute.maxCoeff(), 0.01);
  EXPECT_LT(inspection.map->blended.maxCoeff(), 1e-3);
  EXPECT_EQ(inspection.map->answer, inspection.map->blended);
}

TEST(Inspection, MapIsZeroAtTheTrialsForExactData) {
  const Skill skill = Learned(6, true);
  const Inspection inspection = Inspect(skill);
  for (const geometry::Pose& target : inspection.base_T_target) {
    const auto at = InspectAt(skill, target.translation);
    ASSERT_TRUE(at.has_value());
    const Eigen::Vector3d tool = at->absolute.row(inspection.contact_frame).transpose();
    EXPECT_LT((tool - at->base_p_contact).norm(), 2e-3);
  }
}

TEST(Inspection, ObjectiveSolutionMeetsTheButtonAndTheAbsoluteOneStartsRight) {
  const Inspection inspection = Inspect(Learned(6, true, {.method = Method::kPaper}));
  ASSERT_TRUE(inspection.query.has_value());
  const InspectedQuery& query = *inspection.query;
  const Eigen::RowVector3d start = inspection.base_paths[0].row(0);
  EXPECT_LT((query.absolute.row(0) - start).norm(), 1e-3);
  EXPECT_LT(
      (query.objective.row(inspection.contact_frame) - query.base_p_contact.transpose()).norm(),
      1e-3);
  EXPECT_EQ(query.blended, query.answer);
  for (const geometry::Pose& target : inspection.base_T_target) {
    EXPECT_GT((target.translation - query.base_T_target.translation).norm(), 0.02);
  }
}

TEST(Inspection, TrialsWithoutJointsHaveOnePathForBothSolutions) {
  const Inspection inspection = Inspect(Learned(6, false));
  ASSERT_TRUE(inspection.query.has_value());
  EXPECT_FALSE(inspection.through_joints);
  EXPECT_LT((inspection.query->absolute - inspection.query->objective).norm(), 1e-9);
}

TEST(Inspection, SaysWhyThereAreNoPathsWithoutARobotModel) {
  const Result<Skill> skill = LearnSkill(MakePresses(3), {});
  ASSERT_TRUE(skill.ok());
  const Inspection inspection = Inspect(*skill);
  EXPECT_THAT(inspection.obstacle, testing::HasSubstr("robot model"));
  EXPECT_FALSE(inspection.map.has_value());
  EXPECT_FALSE(InspectAt(*skill, Eigen::Vector3d::Zero()).has_value());
}

TEST(Inspection, OneTrialIsInspected) {
  const Inspection inspection = Inspect(Learned(1, true));
  ASSERT_TRUE(inspection.query.has_value());
  EXPECT_TRUE(inspection.query->answer.allFinite());
  EXPECT_TRUE(inspection.map->absolute.allFinite());
  EXPECT_LT(inspection.map->x_m.front(), inspection.map->x_m.back());
}

TEST(Inspection, ReadsBackAsWritten) {
  const Inspection written = Inspect(Learned(4, true), {.map_columns = 5, .map_rows = 4});
  const nlohmann::json json = ToJson(written);
  const Result<Inspection> read = InspectionFromJson(nlohmann::json::parse(json.dump()));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(ToJson(*read), json);
}

TEST(Inspection, RefusesPartsThatDoNotFit) {
  nlohmann::json json = ToJson(Inspect(Learned(2, true), {.map_columns = 3, .map_rows = 3}));
  EXPECT_FALSE(InspectionFromJson(nlohmann::json::object()).ok());
  nlohmann::json other = json;
  other["contact_frame"] = 1 << 20;
  EXPECT_FALSE(InspectionFromJson(other).ok());
  other = json;
  other["upsilon"] = {0.5};
  EXPECT_FALSE(InspectionFromJson(other).ok());
  other = json;
  other["base_paths"].erase(0);
  EXPECT_FALSE(InspectionFromJson(other).ok());
}

TEST(Inspection, LengthNormalisedMeanLosesWhatAlignmentKeeps) {
  const Skill skill = Learned(6, false);
  const Alignment& alignment = skill.alignment();
  const std::vector<Eigen::VectorXd> msv = ToolMsv(alignment);
  const Eigen::MatrixXd aligned = WarpSeries(alignment, msv, true);
  const Eigen::MatrixXd plain = WarpSeries(alignment, msv, false);
  const double of_trials = aligned.colwise().maxCoeff().mean();
  EXPECT_GT(aligned.rowwise().mean().maxCoeff(), 0.8 * of_trials);
  EXPECT_LT(plain.rowwise().mean().maxCoeff(), aligned.rowwise().mean().maxCoeff());
  const std::vector<UniformTrial> normalised = LengthNormalised(alignment);
  ASSERT_EQ(normalised.size(), alignment.trials.size());
  for (const UniformTrial& trial : normalised) {
    EXPECT_EQ(trial.base_T_tool.size(), alignment.time_s.size());
  }
  EXPECT_GT(Largest(alignment.canonical_tool), 0.1);
}

}  // namespace
}  // namespace exemplar::learning
