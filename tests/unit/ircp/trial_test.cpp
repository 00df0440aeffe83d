// Samples into a trial, and a trial into samples.

#include <gtest/gtest.h>

#include <algorithm>

#include "exemplar/base/rng.hpp"
#include "exemplar/ircp/trial_builder.hpp"
#include "exemplar/ircp/trial_player.hpp"

namespace exemplar::ircp {
namespace {

using demonstration::PoseSeries;
using demonstration::ScalarSeries;
using demonstration::Trial;

/// Times from `first` on, uneven, whole nanoseconds.
std::vector<double> Times(Rng& rng, double first_s, std::size_t count) {
  std::vector<double> times;
  auto ns = static_cast<std::int64_t>(first_s * 1e9);
  for (std::size_t i = 0; i < count; ++i) {
    times.push_back(static_cast<double>(ns) / 1e9);
    ns += 1 + static_cast<std::int64_t>(rng.Below(30'000'000));
  }
  return times;
}

ScalarSeries Scalars(Rng& rng, std::vector<std::string> names, std::vector<double> times) {
  ScalarSeries series;
  series.values.resize(static_cast<Eigen::Index>(times.size()),
                       static_cast<Eigen::Index>(names.size()));
  for (Eigen::Index i = 0; i < series.values.size(); ++i) series.values(i) = rng.Normal();
  series.names = std::move(names);
  series.time_s = std::move(times);
  return series;
}

PoseSeries Poses(Rng& rng, std::string name, std::vector<double> times, bool has_orientation) {
  PoseSeries series;
  series.name = std::move(name);
  series.has_orientation = has_orientation;
  for (std::size_t i = 0; i < times.size(); ++i) {
    geometry::Pose pose;
    pose.translation = Eigen::Vector3d(rng.Normal(), rng.Normal(), rng.Normal());
    if (has_orientation) {
      pose.rotation =
          Eigen::Quaterniond(rng.Normal(), rng.Normal(), rng.Normal(), rng.Normal()).normalized();
    }
    series.base_T_frame.push_back(pose);
  }
  geometry::MakeSignsContinuous(series.base_T_frame);
  series.time_s = std::move(times);
  return series;
}

Trial RandomTrial(std::uint64_t seed) {
  Rng rng(seed);
  Trial trial;
  const std::size_t samples = 2 + rng.Below(60);
  const bool has_hand = rng.Below(4) != 0;
  if (!has_hand || rng.Below(2) == 0) {
    trial.joints = Scalars(rng, {"shoulder", "elbow", "wrist"}, Times(rng, 0, samples));
  }
  if (has_hand) {
    const std::vector<double> times = Times(rng, 0, samples);
    trial.end_effectors.push_back(Poses(rng, rng.Below(2) == 0 ? "" : "right", times, true));
    if (rng.Below(2) == 0) {
      trial.end_effectors.push_back(Poses(rng, "left", Times(rng, 0, samples), false));
    }
    if (rng.Below(2) == 0) {
      trial.hands = Scalars(rng, {trial.end_effectors.front().name}, times);
    }
    if (rng.Below(2) == 0) {
      trial.wrench = Scalars(rng, {"fx", "fy", "fz", "tx", "ty", "tz"}, times);
    }
    if (rng.Below(2) == 0) {
      trial.label = Scalars(rng, {"label"}, times);
      trial.label.values = (trial.label.values * 10).array().round();
    }
  }
  const std::size_t objects = rng.Below(3);
  for (std::size_t i = 0; i < objects; ++i) {
    // Names not in alphabetic order.
    const std::string name(1, static_cast<char>('z' - static_cast<char>(i)));
    trial.objects.push_back(
        Poses(rng, name, Times(rng, 0.1 * static_cast<double>(i), 1 + rng.Below(5)), i == 0));
  }
  if (rng.Below(2) == 0) {
    trial.tactile = Scalars(rng, {"thumb", "index"}, Times(rng, 0.005, samples));
  }
  return trial;
}

void AddTo(TrialBuilder& builder, const TrialSample& sample) {
  std::visit([&](const auto& s) { builder.Add(s); }, sample);
}

TEST(TrialSamplesTest, BuildsTheTrialThatWasPlayed) {
  const Stamp start = Stamp::FromNanoseconds(1'700'000'000'123'456'789);
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    const Trial trial = RandomTrial(seed);
    ASSERT_TRUE(demonstration::Validate(trial).ok()) << seed;
    const TrialSamples played = SamplesOf(trial, start);
    EXPECT_TRUE(std::is_sorted(
        played.samples.begin(), played.samples.end(),
        [](const TrialSample& a, const TrialSample& b) { return StampOf(a) < StampOf(b); }))
        << seed;
    TrialBuilder builder;
    for (const TrialSample& sample : played.samples) AddTo(builder, sample);
    const Result<Trial> built = builder.Build("again");
    ASSERT_TRUE(built.ok()) << seed << ": " << built.error().message;
    EXPECT_TRUE(demonstration::SameContent(trial, *built)) << seed;
    EXPECT_EQ(built->start, start) << seed;
    EXPECT_EQ(built->source, "again");
  }
}

TEST(TrialSamplesTest, OrderOfArrivalDoesNotMatterWithinAStream) {
  Rng rng(7);
  Trial trial;
  trial.joints = Scalars(rng, {"elbow"}, Times(rng, 0, 40));
  TrialSamples played = SamplesOf(trial, Stamp::FromNanoseconds(99));
  for (std::size_t i = played.samples.size(); i > 1; --i) {
    std::swap(played.samples[i - 1], played.samples[rng.Below(i)]);
  }
  TrialBuilder builder;
  for (const TrialSample& sample : played.samples) AddTo(builder, sample);
  const Result<Trial> built = builder.Build("shuffled");
  ASSERT_TRUE(built.ok());
  EXPECT_TRUE(demonstration::SameContent(trial, *built));
}

TEST(TrialSamplesTest, PlaysWhatWasMeasuredAtTimesWithoutAToolPose) {
  Rng rng(1);
  for (int round = 0; round < 50; ++round) {
    Trial trial;
    trial.joints = Scalars(rng, {"elbow"}, Times(rng, 0, 20));
    if (round % 2 == 0) {
      trial.end_effectors.push_back(Poses(rng, "right", Times(rng, 0.003, 20), true));
    }
    trial.hands = Scalars(rng, {"left", "right"}, Times(rng, 0.001, 15));
    trial.wrench = Scalars(rng, {"fx", "fy", "fz", "tx", "ty", "tz"}, Times(rng, 0.002, 25));
    trial.label = Scalars(rng, {"label"}, Times(rng, 0.004, 10));
    trial.label.values = (trial.label.values * 10).array().round();
    TrialBuilder builder;
    for (const TrialSample& sample : SamplesOf(trial, Stamp::FromNanoseconds(99)).samples) {
      AddTo(builder, sample);
    }
    const Result<Trial> built = builder.Build("again");
    ASSERT_TRUE(built.ok()) << built.error().message;
    EXPECT_TRUE(demonstration::SameContent(trial, *built)) << round;
  }
}

EndEffectorSample Tool(std::int64_t ns) {
  EndEffectorSample sample;
  sample.header = {.source = "arm", .seq = 1, .stamp = Stamp::FromNanoseconds(ns)};
  return sample;
}

JointStateSample State(std::int64_t ns) {
  JointStateSample sample;
  sample.header = {.source = "robot", .seq = 1, .stamp = Stamp::FromNanoseconds(ns)};
  sample.names = {"elbow"};
  sample.positions = {0.5};
  sample.touch_sensors = {"tip"};
  sample.touch_n = {1.5};
  return sample;
}

TEST(TrialBuilderTest, DropsRepeatedStampsWithANotice) {
  TrialBuilder builder;
  for (const std::int64_t ns : {100, 100, 200}) builder.Add(Tool(ns));
  const Result<Trial> trial = builder.Build("t");
  ASSERT_TRUE(trial.ok());
  EXPECT_EQ(trial->end_effectors[0].size(), 2u);
  ASSERT_EQ(trial->notices.size(), 1u);
  EXPECT_NE(trial->notices[0].find("1 samples with a repeated"), std::string::npos);
}

TEST(TrialBuilderTest, TakesTheRobotsJointsOnlyWhereItWasTheDemonstrator) {
  TrialBuilder guided;
  guided.Add(State(100));
  guided.Add(State(200));
  const Result<Trial> by_robot = guided.Build("guided");
  ASSERT_TRUE(by_robot.ok());
  EXPECT_EQ(by_robot->joints.size(), 2u);
  EXPECT_EQ(by_robot->tactile.names, std::vector<std::string>{"tip"});
  EXPECT_EQ(by_robot->notices.size(), 1u);

  TrialBuilder watched;
  watched.Add(State(100));
  watched.Add(Tool(150));
  watched.Add(State(200));
  const Result<Trial> by_person = watched.Build("watched");
  ASSERT_TRUE(by_person.ok());
  EXPECT_TRUE(by_person->joints.empty());
  EXPECT_TRUE(by_person->tactile.empty());
  EXPECT_EQ(by_person->start, Stamp::FromNanoseconds(150));
}

TEST(TrialBuilderTest, KeepsWhatTheRobotMeasuredWhileItFollowedASuit) {
  TrialBuilder builder;
  for (const std::int64_t ns : {100, 200, 300}) {
    SuitSample suit;
    suit.header = {.source = "suit", .seq = 1, .stamp = Stamp::FromNanoseconds(ns)};
    suit.names = {"elbow"};
    suit.positions = {0.7};
    builder.Add(suit);
  }
  builder.Add(State(150));
  builder.Add(State(250));
  const Result<Trial> trial = builder.Build("followed");
  ASSERT_TRUE(trial.ok());
  EXPECT_EQ(trial->joints.size(), 3u);
  EXPECT_EQ(trial->joints.values(0, 0), 0.7);
  ASSERT_EQ(trial->measured_joints.size(), 2u);
  EXPECT_EQ(trial->measured_joints.names, std::vector<std::string>{"elbow"});
  EXPECT_EQ(trial->measured_joints.values(1, 0), 0.5);
  EXPECT_TRUE(trial->tactile.empty());
  EXPECT_EQ(trial->start, Stamp::FromNanoseconds(100));
}

TEST(TrialBuilderTest, RefusesRecordingsWithoutADemonstration) {
  TrialBuilder builder;
  ObjectSample object;
  object.header.source = "vision";
  object.name = "button";
  builder.Add(object);
  const Result<Trial> trial = builder.Build("empty.mcap");
  ASSERT_FALSE(trial.ok());
  EXPECT_NE(trial.error().message.find("empty.mcap"), std::string::npos);
}

}  // namespace
}  // namespace exemplar::ircp
