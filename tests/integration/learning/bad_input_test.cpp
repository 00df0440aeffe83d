// What a user may give the learning service by mistake: each is refused, or answered with a
// warning, by a message that names value and field, and what was stored stays.

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <optional>
#include <set>

#include "exemplar/base/text.hpp"
#include "running_service.hpp"

namespace exemplar::learning_service {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class BadInputTest : public LearningServiceTest {
 protected:
  /// Submits `files` as the trials of `skill` and learns it.
  Result<learning::SkillReport> LearnFrom(const std::string& skill,
                                          const std::vector<std::string>& files) {
    for (std::size_t i = 0; i < files.size(); ++i) {
      const auto submitted = trials().Submit(skill, "trial" + std::to_string(i) + ".csv", files[i]);
      if (!submitted) return submitted.error();
    }
    return skills().Learn(skill, {}, {}, {});
  }
  void ExpectAllTrialsKept(const std::string& skill, std::size_t count) {
    const auto kept = trials().List(skill);
    ASSERT_TRUE(kept.ok());
    EXPECT_EQ(kept->size(), count);
    for (const api::TrialInfo& info : *kept) EXPECT_TRUE(trials().Load(info.id).ok());
  }
};

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

/// Only the named columns of a CSV text.
std::string Columns(const std::string& csv, const std::string& prefix, bool keep) {
  std::string result;
  std::vector<bool> kept;
  for (const std::string_view line : Split(csv, '\n')) {
    if (line.empty()) continue;
    const std::vector<std::string_view> cells = Split(line, ',');
    if (kept.empty()) {
      for (const std::string_view name : cells) {
        kept.push_back(name == "time_s" || name.starts_with(prefix) == keep);
      }
    }
    std::string row;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (kept[c]) row += (row.empty() ? "" : ",") + std::string(cells[c]);
    }
    result += row + "\n";
  }
  return result;
}

std::string JointTrial(const std::string& joint, std::uint64_t seed) {
  Rng rng(seed);
  std::string csv = "time_s," + joint + "_rad\n";
  for (int i = 0; i < 200; ++i) {
    const double s = std::clamp(i / 100.0 - 0.3, 0.0, 1.0);
    csv += FormatDouble(0.01 * i) + "," + FormatDouble(s * s * (3 - 2 * s) + 1e-4 * rng.Normal()) +
           "\n";
  }
  return csv;
}

TEST_F(BadInputTest, TrialsOfDifferentJointsAreRefusedByTheJointsName) {
  const auto report = LearnFrom("press", {JointTrial("elbow", 1), JointTrial("wrist", 2)});
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(report.error().field, "trials");
  EXPECT_THAT(report.error().message, HasSubstr("no joint \"elbow\""));
  ExpectAllTrialsKept("press", 2);
}

TEST_F(BadInputTest, TrialsOfDifferentObjectsAreRefusedByTheObjectsName) {
  const auto report =
      LearnFrom("press", {PressTrial(kPlaces[0], 1),
                          Replaced(PressTrial(kPlaces[1], 2), "object_button", "object_lever")});
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(report.error().message, HasSubstr("no object is in every trial"));
  EXPECT_THAT(report.error().message, HasSubstr("\"button\", \"lever\""));
  ExpectAllTrialsKept("press", 2);
}

TEST_F(BadInputTest, TrialsWithoutObjectsAreLearnedWithAWarning) {
  std::vector<std::string> files;
  for (std::size_t i = 0; i < 4; ++i) {
    files.push_back(Columns(PressTrial(kPlaces[i], i), "object_", false));
  }
  const auto report = LearnFrom("press", files);
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->warnings, Contains(HasSubstr("the trials hold no object")));
  EXPECT_TRUE(skills().Query("press", 0, {}).ok());
  const auto unknown = skills().Query("press", 0, At(kPlaces[0]));
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().field, "query.objects[0].name");
}

TEST_F(BadInputTest, ATrialOfTwoSamplesIsNamed) {
  std::string two = PressTrial(kPlaces[1], 2);
  std::size_t end = 0;
  for (int line = 0; line < 3; ++line) end = two.find('\n', end) + 1;
  two.resize(end);
  const auto report = LearnFrom("press", {PressTrial(kPlaces[0], 1), two});
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(report.error().message, HasSubstr("2 samples of motion"));
  EXPECT_THAT(report.error().message, HasSubstr("trial1.csv"));
  ExpectAllTrialsKept("press", 2);
}

TEST_F(BadInputTest, ATrialOfAnHourIsLearnedAndTheCoarserBaseIsNoted) {
  // The hand rests for an hour between reach and return.
  std::string hour =
      "time_s,ee_x_m,ee_y_m,ee_z_m,object_button_x_m,object_button_y_m,"
      "object_button_z_m\n";
  for (int i = 0; i <= 36000; ++i) {
    const double t = 0.1 * i;
    const double s = std::clamp(t / 10, 0.0, 1.0) - std::clamp((t - 3590) / 10, 0.0, 1.0);
    hour += FormatDouble(t) + "," + FormatDouble(0.3 + 0.2 * s) + ",0," +
            FormatDouble(0.3 - 0.25 * s) + ",0.5,0,0.05\n";
  }
  const auto report = LearnFrom("press", {hour});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->trials.at(0).notes, Contains(HasSubstr("frames; taken at")));
  const auto motion = skills().Query("press", 0, At({0.5, 0}));
  ASSERT_TRUE(motion.ok()) << motion.error().message;
  EXPECT_GT(motion->time_s.back(), 3500);
}

TEST_F(BadInputTest, OneTrialIsLearnedWithAWarning) {
  const auto report = LearnFrom("press", {PressTrial(kPlaces[0], 1)});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->warnings, Contains(HasSubstr("one trial only")));
}

TEST_F(BadInputTest, QueriesOfUnknownOrFarObjectsSaySo) {
  SubmitAllAndLearn();
  demonstration::SkillQuery unknown = At(kPlaces[0]);
  unknown.objects[0].name = "buton";
  const auto refused = skills().Query("press", 0, unknown);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kNotFound);
  EXPECT_EQ(refused.error().field, "query.objects[0].name");
  EXPECT_THAT(refused.error().message, HasSubstr("did you mean \"button\"?"));
  const auto far = skills().Query("press", 0, At({7.5, -3}));
  ASSERT_TRUE(far.ok()) << far.error().message;
  EXPECT_THAT(far->warnings, Contains(HasSubstr("far extrapolation")));
  for (const geometry::Pose& pose : far->base_T_tool) EXPECT_TRUE(pose.translation.allFinite());
}

TEST_F(BadInputTest, QueriesThatCannotBeMeantAreRefusedByFieldAndValue) {
  SubmitAllAndLearn();
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  struct Case {
    std::function<void(demonstration::SkillQuery&)> spoil;
    std::string field, words;
  };
  const auto position = [](double x, double y, double z) {
    return [=](demonstration::SkillQuery& q) {
      q.objects[0].base_T_object.translation = {x, y, z};
    };
  };
  const auto start = [](double x) {
    return [=](demonstration::SkillQuery& q) {
      q.start = geometry::Pose::FromTranslation({x, 0, 0});
    };
  };
  const auto joints = [](std::vector<double> values, std::vector<std::string> names) {
    return [=](demonstration::SkillQuery& q) {
      q.joint_start = Eigen::Map<const Eigen::VectorXd>(values.data(),
                                                        static_cast<Eigen::Index>(values.size()));
      q.joint_start_names = names;
    };
  };
  const std::vector<Case> cases = {
      {position(kNan, 0, 0), "query.objects[0].pose.position", "not finite"},
      {position(0, kInfinite, 0), "query.objects[0].pose.position", "not finite"},
      {position(0, 0, -kInfinite), "query.objects[0].pose.position", "not finite"},
      {position(1e300, 0, 0), "query.objects[0].position", "1e+300"},
      {position(0, -20000, 0), "query.objects[0].position", "-20000"},
      {[](auto& q) { q.objects[0].base_T_object.rotation.coeffs().setZero(); },
       "query.objects[0].pose.rotation", "zero"},
      {[](auto& q) { q.objects[0].base_T_object.rotation.x() = std::nan(""); },
       "query.objects[0].pose.rotation", "not finite"},
      {[](auto& q) { q.objects[0].name.clear(); }, "query.objects[0].name", "empty"},
      {[](auto& q) { q.objects[0].name = std::string(100'000, 'x'); }, "query.objects[0].name",
       "knows no object"},
      {[](auto& q) { q.objects.push_back(q.objects[0]); }, "query.objects[1].name", "given twice"},
      {[](auto& q) { q.objects.clear(); }, "query.objects", "lacks object \"button\""},
      {start(kNan), "query.start.position", "not finite"},
      {start(-1e30), "query.start", "-1e+30"},
      {[](auto& q) {
         q.start = geometry::Pose();
         q.start->rotation.coeffs().setZero();
       },
       "query.start.rotation", "zero"},
      {joints({kNan}, {}), "query.joint_start", "not finite"},
      {joints({1, 2}, {"elbow"}), "query.joint_start", "2 values for 1 names"},
  };
  for (const Case& each : cases) {
    demonstration::SkillQuery query = At(kPlaces[0]);
    each.spoil(query);
    const auto answer = skills().Query("press", 0, query);
    ASSERT_FALSE(answer.ok()) << each.field << " " << each.words;
    EXPECT_EQ(answer.error().field, each.field) << answer.error().message;
    EXPECT_THAT(answer.error().message, HasSubstr(each.words));
    // A stream says the same, and goes on.
    const auto stream = rpc::OpenMotionStream({.server = service_->server->address()}, "press", 0);
    ASSERT_TRUE(stream.ok());
    EXPECT_EQ((*stream)->Ask(query).error().field, each.field);
    EXPECT_TRUE((*stream)->Ask(At(kPlaces[0])).ok());
  }
  demonstration::SkillQuery unused = At(kPlaces[0]);
  joints({1, 2}, {})(unused);
  const auto warned = skills().Query("press", 0, unused);
  ASSERT_TRUE(warned.ok()) << warned.error().message;
  EXPECT_THAT(warned->warnings, Contains(HasSubstr("joint_start is not used")));
  unused.start = unused.objects[0].base_T_object;
  const auto told = skills().Query("press", 0, unused);
  ASSERT_TRUE(told.ok()) << told.error().message;
  EXPECT_THAT(told->warnings, Not(Contains(HasSubstr("joint_start"))));
  ExpectAllTrialsKept("press", kPlaces.size());
}

TEST_F(BadInputTest, EveryOptionOutOfRangeIsNamedWithItsValue) {
  SubmitAllAndLearn();
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"method", "best"},      {"selection", "both"},       {"rule", "loose"},
      {"force_rate", "fast"},  {"joints", "spied"},         {"alignment", "loose"},
      {"threshold", "global"}, {"cues", "sound"},           {"target", "lever"},
      {"sample_rate_hz", "0"}, {"sample_rate_hz", "1e9"},   {"sample_rate_hz", "nan"},
      {"cutoff_hz", "-1"},     {"cutoff_hz", "59"},         {"frames", "1"},
      {"frames", "-7"},        {"frames", "1000000000000"}, {"leave_out", "nobody.csv"}};
  std::set<std::string> tried;
  for (const auto& [name, value] : wrong) {
    const auto report = skills().Learn("press", {{name, value}}, {}, {});
    ASSERT_FALSE(report.ok()) << name << "=" << value;
    EXPECT_EQ(report.error().code, ErrorCode::kInvalidArgument) << report.error().message;
    EXPECT_THAT(report.error().field, HasSubstr(name));
    EXPECT_THAT(report.error().message, HasSubstr(value));
    tried.insert(name);
  }
  // None was forgotten.
  for (const auto& [name, value] : learning::LearnOptions().ToStrings()) {
    EXPECT_TRUE(tried.contains(name)) << name;
  }
  EXPECT_EQ(skills().Versions("press")->size(), 1u);
  ExpectAllTrialsKept("press", kPlaces.size());
}

// A thousand where EXEMPLAR_LONG_TRIALS is set (ctest -C All).
TEST_F(BadInputTest, ManyTrialsAreLearnedWithProgressAndCanBeCancelled) {
  const int kMany = std::getenv("EXEMPLAR_LONG_TRIALS") != nullptr ? 1000 : 120;
  Rng rng(12);
  for (int i = 0; i < kMany; ++i) {
    const Place place{rng.Uniform(0.45, 0.62), rng.Uniform(-0.22, 0.12)};
    // Every tenth row: 10 Hz.
    const std::string full = PressTrial(place, static_cast<std::uint64_t>(i));
    std::string csv;
    int number = 0;
    for (const std::string_view line : Split(full, '\n')) {
      if (number < 2 || number % 10 == 1) csv += std::string(line) + "\n";
      ++number;
    }
    ASSERT_TRUE(trials().Submit("press", "t" + std::to_string(i) + ".csv", csv).ok());
  }
  std::stop_source stop;
  const auto cancelled = service_->skills->Learn(
      "press", {},
      [&](double fraction, std::string_view) {
        if (fraction > 0.3) stop.request_stop();
      },
      stop.get_token());
  ASSERT_FALSE(cancelled.ok());
  EXPECT_EQ(cancelled.error().code, ErrorCode::kCancelled);
  double last = 0;
  int told = 0;
  const auto report = service_->skills->Learn("press", {},
                                              [&](double fraction, std::string_view) {
                                                EXPECT_GE(fraction, last);
                                                last = fraction;
                                                ++told;
                                              },
                                              {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(told, kMany);
  EXPECT_EQ(report->trials.size(), static_cast<std::size_t>(kMany));
  const auto motion = skills().Query("press", 0, At({0.5, 0}));
  ASSERT_TRUE(motion.ok()) << motion.error().message;
  ExpectAllTrialsKept("press", static_cast<std::size_t>(kMany));
}

}  // namespace
}  // namespace exemplar::learning_service
