#include "capture_suit/replay_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "station.hpp"

namespace exemplar::capture_suit {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
using testing::Station;

/// Joints, touch and an object, each on time stamps of its own; two seconds.
demonstration::Trial MakeTrial(double phase) {
  demonstration::Trial trial;
  trial.source = "wave.csv";
  trial.joints.names = {"a", "b"};
  trial.joints.values.resize(121, 2);
  trial.tactile.names = {"finger"};
  trial.tactile.values.resize(41, 1);
  for (int k = 0; k <= 120; ++k) {
    trial.joints.time_s.push_back(k / 60.0);
    trial.joints.values.row(k) << std::sin(phase + k * 0.1), std::cos(phase + k * 0.07);
  }
  for (int k = 0; k <= 40; ++k) {
    trial.tactile.time_s.push_back(0.05 * k);
    trial.tactile.values(k, 0) = k % 7;
  }
  demonstration::PoseSeries button;
  button.name = "button";
  for (int k = 0; k < 20; ++k) {
    button.time_s.push_back(0.1 * k);
    button.base_T_frame.push_back(geometry::Pose::FromTranslation({0.4, 0.01 * k, 0.1}));
  }
  trial.objects.push_back(button);
  return trial;
}

Status Replay(Station& station, const std::vector<demonstration::Trial>& trials,
              const ReplayOptions& options, std::stop_token stop = {}) {
  auto session = ReplaySession::Create(station.bus, station.clock, station.log, trials, options);
  return session ? (*session)->Run(stop) : Status(session.error());
}

TEST(ReplaySession, SendsTheTrialWithItsTrueTimingWhateverTheRate) {
  for (const double rate : {1.0, 4.0, 25.0}) {
    Station station({});
    const demonstration::Trial trial = MakeTrial(0);
    const Status status = Replay(station, {trial}, {.rate = rate});
    ASSERT_TRUE(status.ok()) << status.error().message;
    EXPECT_NEAR(ToSeconds(station.clock.Steady()), 2.0 / rate, 1e-6);
    const Result<demonstration::Trial> heard = station.heard.Build(trial.source);
    ASSERT_TRUE(heard.ok()) << heard.error().message;
    ASSERT_EQ(heard->joints.size(), trial.joints.size());
    EXPECT_EQ(heard->joints.values, trial.joints.values);
    EXPECT_EQ(heard->tactile.values, trial.tactile.values);
    ASSERT_EQ(heard->objects.size(), 1U);
    for (std::size_t k = 0; k < trial.joints.size(); ++k) {
      EXPECT_NEAR(heard->joints.time_s[k], trial.joints.time_s[k], 2e-9);
    }
    EXPECT_EQ(heard->objects[0].base_T_frame[7].translation.y(), 0.07);
  }
}

TEST(ReplaySession, HasEachTrialRecordedUnderANameOfItsOwn) {
  Station station({"recorder"});
  const Status status =
      Replay(station, {MakeTrial(0), MakeTrial(1)}, {.record = true, .name = "press"});
  ASSERT_TRUE(status.ok()) << status.error().message;
  ASSERT_EQ(station.commands.size(), 4U);
  EXPECT_EQ(station.commands[0].arguments.at("name"), "press-001");
  EXPECT_EQ(station.commands[0].arguments.at("source"), "wave.csv");
  // Whatever else reads these topics: the recording begins once the recorder hears them.
  EXPECT_EQ(station.commands[0].arguments.at("expect"), "ircp/suit,ircp/tactile,ircp/objects");
  EXPECT_EQ(station.commands[2].arguments.at("name"), "press-002");
  EXPECT_EQ(station.story.front(), "recorder start");
  EXPECT_EQ(station.story.back(), "recorder stop");
  EXPECT_EQ(station.commands[1].action, "stop");
  EXPECT_THAT(station.log.events(), Contains(HasSubstr("trial 2 of 2: wave.csv, 2.0 s")));
}

TEST(ReplaySession, StopsTheRecordingWhenItIsStoppedHalfWay) {
  Station station({"recorder"});
  std::stop_source stop;
  int samples = 0;
  station.on_sample = [&] {
    if (++samples == 50) stop.request_stop();
  };
  const Status status = Replay(station, {MakeTrial(0)}, {.record = true}, stop.get_token());
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(samples, 50);
  EXPECT_EQ(station.story.back(), "recorder stop");
}

TEST(ReplaySession, PlaysNothingWhenTheRecorderRefuses) {
  Station station({"recorder"});
  station.refuse = "start";
  const Status status = Replay(station, {MakeTrial(0)}, {.record = true});
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("recorder start: I will not start"));
  EXPECT_THAT(station.story, ElementsAre("recorder start"));
}

TEST(ReplaySession, SaysWhenNobodyReads) {
  testing::LeadingClock clock;
  ircp::MemoryBus bus(clock);
  testing::KeptLog log;
  auto session = ReplaySession::Create(bus, clock, log, {MakeTrial(0)}, {});
  ASSERT_TRUE(session.ok());
  EXPECT_THAT((*session)->readers(),
              ElementsAre(Pair("ircp/objects", 0), Pair("ircp/suit", 0), Pair("ircp/tactile", 0)));
  EXPECT_TRUE((*session)->Run({}).ok());
  EXPECT_THAT(log.warnings(),
              ElementsAre("nobody reads topic=ircp/objects", "nobody reads topic=ircp/suit",
                          "nobody reads topic=ircp/tactile"));
}

TEST(ReplaySession, RefusesRatesThatMakeNoSense) {
  for (const double rate : {0.0, -1.0, std::nan("")}) {
    Station station({});
    EXPECT_EQ(Replay(station, {MakeTrial(0)}, {.rate = rate}).error().field, "rate");
  }
}

TEST(ReadTrialFile, NamesTheFileAndLineOfWhatIsWrong) {
  EXPECT_EQ(ReadTrialFile("/nowhere/trial.csv").error().code, ErrorCode::kNotFound);
  const std::string file = ::testing::TempDir() + "/wrong.csv";
  std::ofstream(file) << "time_s,a_rad\n0,1\n0.1,x\n0.2,2\n";
  EXPECT_THAT(ReadTrialFile(file).error().message, HasSubstr("wrong.csv:3: a_rad"));
}

}  // namespace
}  // namespace exemplar::capture_suit
