// Answers beside what people did, where the demonstrations are at hand (EXEMPLAR_DATA, or
// shared/data beside the checkout). tests/bench/learning_accuracy prints the whole table.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "exemplar/demonstration/csv.hpp"
#include "exemplar/learning/skill.hpp"

namespace exemplar::learning {
namespace {

namespace fs = std::filesystem;

struct Errors {
  double frechet_m = 0;
  double end_error_m = 0;
};

class RealAnswers : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* named = std::getenv("EXEMPLAR_DATA");
    folder_ = named != nullptr ? fs::path(named)
                               : fs::path(EXEMPLAR_SOURCE_DIR).parent_path() / "shared" / "data";
    if (!fs::exists(folder_ / "rail_pressing")) {
      GTEST_SKIP() << "no demonstrations in " << folder_ << "; EXEMPLAR_DATA names their folder";
    }
  }

  std::vector<NamedTrial> Load(const std::string& set, const std::string& person) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_ / set)) {
      if (entry.path().filename().string().starts_with(person)) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    std::vector<NamedTrial> trials;
    for (const fs::path& file : files) {
      std::ifstream in(file);
      std::stringstream text;
      text << in.rdbuf();
      auto trial = demonstration::ReadCsv(text.str(), file.filename().string());
      EXPECT_TRUE(trial.ok()) << (trial.ok() ? "" : trial.error().message);
      if (trial) trials.push_back({file.stem().string(), std::move(*trial)});
    }
    return trials;
  }

  /// Medians over one person's trials, each predicted from the others.
  Errors LeaveOneOut(const std::string& set, const std::string& person, Method method) const {
    const std::vector<NamedTrial> trials = Load(set, person);
    std::vector<double> frechet, end;
    for (std::size_t out = 0; out < trials.size(); ++out) {
      std::vector<NamedTrial> training = trials;
      training.erase(training.begin() + static_cast<std::ptrdiff_t>(out));
      LearnOptions options;
      options.method = method;
      const Result<Skill> skill = LearnSkill(training, options);
      EXPECT_TRUE(skill.ok()) << (skill.ok() ? "" : skill.error().message);
      if (!skill.ok()) continue;
      const Result<Evaluation> evaluation = Evaluate(*skill, trials[out].trial);
      EXPECT_TRUE(evaluation.ok()) << (evaluation.ok() ? "" : evaluation.error().message);
      if (!evaluation.ok()) continue;
      frechet.push_back(evaluation->deviation.frechet_m);
      end.push_back(evaluation->deviation.end_error_m);
    }
    std::nth_element(frechet.begin(), frechet.begin() + 3, frechet.end());
    std::nth_element(end.begin(), end.begin() + 3, end.end());
    return {frechet[3], end[3]};
  }

  fs::path folder_;
};

TEST_F(RealAnswers, FramesComeNearWhatAPersonDid) {
  const Errors pressing = LeaveOneOut("rail_pressing", "user04", Method::kFrames);
  EXPECT_LT(pressing.frechet_m, 0.055);
  EXPECT_LT(pressing.end_error_m, 0.022);
  const Errors pushing = LeaveOneOut("rail_pushing", "user05", Method::kFrames);
  EXPECT_LT(pushing.frechet_m, 0.08);
  EXPECT_LT(pushing.end_error_m, 0.025);
}

TEST_F(RealAnswers, AutoLeavesThePapersMethodWherePeopleStartAnywhere) {
  const Errors chosen = LeaveOneOut("rail_pressing", "user02", Method::kAuto);
  const Errors paper = LeaveOneOut("rail_pressing", "user02", Method::kPaper);
  EXPECT_LT(chosen.frechet_m, 0.5 * paper.frechet_m);
}

}  // namespace
}  // namespace exemplar::learning
