// The learner's first half on real demonstrations, where they are at hand (EXEMPLAR_DATA, or
// shared/data beside the checkout).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "exemplar/demonstration/csv.hpp"
#include "exemplar/learning/aligned.hpp"
#include "exemplar/learning/touch.hpp"

namespace exemplar::learning {
namespace {

namespace fs = std::filesystem;

class RealTrials : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* named = std::getenv("EXEMPLAR_DATA");
    folder_ = named != nullptr ? fs::path(named)
                               : fs::path(EXEMPLAR_SOURCE_DIR).parent_path() / "shared" / "data";
    if (!fs::exists(folder_ / "rail_pressing")) {
      GTEST_SKIP() << "no demonstrations in " << folder_ << "; EXEMPLAR_DATA names their folder";
    }
  }

  std::vector<UniformTrial> Load(const std::string& set, const std::string& prefix) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_ / set)) {
      if (entry.path().filename().string().starts_with(prefix)) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    std::vector<UniformTrial> trials;
    for (const fs::path& file : files) {
      std::ifstream in(file);
      std::stringstream text;
      text << in.rdbuf();
      const auto trial = demonstration::ReadCsv(text.str(), file.filename().string());
      EXPECT_TRUE(trial.ok()) << (trial.ok() ? "" : trial.error().message);
      if (!trial) continue;
      auto prepared = Prepare(*trial, {}, nullptr);
      EXPECT_TRUE(prepared.ok()) << (prepared.ok() ? "" : prepared.error().message);
      if (prepared) trials.push_back(std::move(*prepared));
    }
    return trials;
  }

  fs::path folder_;
};

TEST_F(RealTrials, PeopleGuidingAnArmAskForAFewHertz) {
  for (const std::string set : {"rail_pressing", "rail_pushing"}) {
    for (const UniformTrial& trial : Load(set, "user")) {
      EXPECT_GT(trial.cutoff_hz, 3) << trial.id;
      EXPECT_LT(trial.cutoff_hz, 8) << trial.id;
      ASSERT_EQ(trial.base_T_object.size(), 1u);
      EXPECT_EQ(trial.base_T_object[0].front().translation,
                trial.base_T_object[0].back().translation);
    }
  }
}

TEST_F(RealTrials, JointMarkersNeverAlignAPersonsTrialsWorseThanLinearTime) {
  for (const std::string set : {"rail_pressing", "rail_pushing"}) {
    for (int user = 1; user <= 5; ++user) {
      LearnOptions options;
      options.selection = Selection::kJoint;
      const auto aligned = Align(Load(set, "user0" + std::to_string(user)), options);
      ASSERT_TRUE(aligned.ok());
      EXPECT_EQ(aligned->trials.size(), 6u);
      EXPECT_GT(aligned->mean_correlation, aligned->plain_correlation - 0.02) << set << user;
      EXPECT_NEAR(aligned->choice_bound, aligned->choice_value, 1e-8) << set << user;
    }
  }
}

// Users 2 and 5 lift the tool off the button half way; it is their second marker in every trial.
TEST_F(RealTrials, TheLiftOffTheButtonIsFoundInEveryTrial) {
  for (const std::string user : {"user02", "user05"}) {
    const auto aligned = Align(Load("rail_pressing", user), {});
    ASSERT_TRUE(aligned.ok());
    ASSERT_EQ(aligned->knots_s.size(), 4u);
    for (const AlignedTrial& trial : aligned->trials) {
      const double at = trial.own_knots_s[2] / trial.own_knots_s[3];
      EXPECT_GT(at, 0.45) << trial.id;
      EXPECT_LT(at, 0.65) << trial.id;
      const auto frame = static_cast<std::size_t>(
          trial.segmentation.markers[static_cast<std::size_t>(trial.chosen[1])].frame);
      // Where the tool is at its lowest so far, give or take two centimetres.
      double lowest = 1e300;
      for (std::size_t k = 0; k <= frame; ++k) {
        lowest = std::min(lowest, trial.own.base_T_tool[k].translation.z());
      }
      EXPECT_LT(trial.own.base_T_tool[frame].translation.z() - lowest, 0.02) << trial.id;
    }
  }
}

// The person's hand leans on the arm between the presses too, so there are more than three.
TEST_F(RealTrials, PressesShowAsTouchesInTheWrench) {
  const std::vector<UniformTrial> trials = Load("three_buttons", "trial");
  ASSERT_EQ(trials.size(), 1u);
  int firm = 0;
  for (const Touch& touch : FindTouches(trials[0].touch_n)) {
    EXPECT_LT(touch.first, touch.last);
    if (touch.peak_n > 10) ++firm;
  }
  EXPECT_GE(firm, 3);
}

TEST_F(RealTrials, DrawnReachesInPlotUnitsAlignBetterThanLinearTime) {
  const auto aligned = Align(Load("reach_target", "trial"), {});
  ASSERT_TRUE(aligned.ok());
  EXPECT_EQ(aligned->knots_s.size(), 3u);
  EXPECT_GT(aligned->mean_correlation, aligned->plain_correlation + 0.05);
}

// Grating is rhythmic: every stroke is a candidate, as the paper's rule has it, and the work stays
// bounded.
TEST_F(RealTrials, EveryStrokeOfTheGraterIsACandidate) {
  const auto aligned = Align(Load("grating", "trial"), {});
  ASSERT_TRUE(aligned.ok());
  EXPECT_GT(aligned->knots_s.size(), 30u);
  EXPECT_GT(aligned->mean_correlation, aligned->plain_correlation);
}

}  // namespace
}  // namespace exemplar::learning
