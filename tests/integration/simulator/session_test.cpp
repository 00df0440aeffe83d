#include "simulator/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "exemplar/ircp/control.hpp"
#include "exemplar/ircp/memory_bus.hpp"
#include "pressing.hpp"
#include "robots.hpp"

namespace exemplar::simulator {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A session on a network within the process; time moves only in Advance.
class SessionRig : public testing::Test {
 protected:
  explicit SessionRig(const std::string& robot = "leonardo",
                      const std::string& scene = "press_table.yaml")
      : robot_(Robot(robot)), scene_(Scene(scene)) {}

  void Begin(Leader leader, SessionOptions options = {}) {
    options.leader = leader;
    options.cameras = false;
    auto session = Session::Create(bus_, clock_, log_, robot_, scene_, options);
    ASSERT_TRUE(session.ok()) << session.error().message;
    session_ = std::move(session).value();
    state_reader_ = *bus_.MakeReader<ircp::JointStateSample>(
        [this](const ircp::JointStateSample& sample, const ircp::Reception&) {
          const std::lock_guard lock(mutex_);
          states_.push_back(sample);
          heard_.notify_all();
        });
    status_reader_ = *bus_.MakeReaderOn<ircp::StatusSample>(
        ircp::StatusTopic("simulator"), [this](const ircp::StatusSample& sample, const auto&) {
          const std::lock_guard lock(mutex_);
          status_ = sample;
        });
    client_ = *ircp::ControlClient::Create(bus_, clock_, "simulator", "test", 1);
    thread_ = std::jthread([this](std::stop_token stop) { session_->Run(stop); });
    // The session takes its start from the clock; it says a first state one step later.
    while (count() == 0) {
      clock_.Advance(milliseconds(1));
      AwaitStates(1, milliseconds(20));
    }
    Advance(1);
  }

  void TearDown() override {
    if (thread_.joinable()) {
      thread_.request_stop();
      thread_.join();
    }
  }

  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return states_.size();
  }

  bool AwaitStates(std::size_t wanted, Duration patience = std::chrono::seconds(30)) {
    std::unique_lock lock(mutex_);
    return heard_.wait_for(lock, patience, [&] { return states_.size() >= wanted; });
  }

  /// So many states (8 ms each) later; `each` is called before every one.
  void Advance(
      int states, const std::function<void()>& each = [] {}) {
    for (int i = 0; i < states; ++i) {
      each();
      const std::size_t before = count();
      clock_.Advance(milliseconds(8));
      ASSERT_TRUE(AwaitStates(before + 1));
    }
  }

  ircp::JointStateSample state() {
    const std::lock_guard lock(mutex_);
    return states_.back();
  }
  Eigen::VectorXd positions() {
    const ircp::JointStateSample sample = state();
    return Eigen::Map<const Eigen::VectorXd>(sample.positions.data(),
                                             static_cast<Eigen::Index>(sample.positions.size()));
  }
  std::map<std::string, std::string> values() {
    // A refused request is answered with the values as they are.
    (void)client_->Call("look", {}, std::chrono::seconds(30));
    const std::lock_guard lock(mutex_);
    return status_.values;
  }

  ircp::JointCommandSample CommandTo(const Eigen::VectorXd& q) const {
    ircp::JointCommandSample sample;
    sample.names = robot_.chain.joint_names();
    sample.positions.assign(q.data(), q.data() + q.size());
    sample.validity = milliseconds(100);
    return sample;
  }

  const kinematics::RobotDescription robot_;
  const scene::Description scene_;
  ManualClock clock_;
  NullLog log_;
  ircp::MemoryBus bus_{clock_};
  std::mutex mutex_;
  std::condition_variable heard_;
  std::vector<ircp::JointStateSample> states_;
  ircp::StatusSample status_;
  std::unique_ptr<Session> session_;
  std::unique_ptr<ircp::Reader> state_reader_;
  std::unique_ptr<ircp::Reader> status_reader_;
  std::unique_ptr<ircp::ControlClient> client_;
  std::jthread thread_;
};

TEST_F(SessionRig, SaysItsStateAtItsRate) {
  Begin(Leader::kCommand);
  Advance(20);
  const std::lock_guard lock(mutex_);
  for (std::size_t i = states_.size() - 20; i < states_.size(); ++i) {
    EXPECT_EQ(states_[i].header.stamp - states_[i - 1].header.stamp, milliseconds(8));
    EXPECT_EQ(states_[i].header.seq, i + 1);
  }
  EXPECT_EQ(states_.back().header.source, "robot");
  EXPECT_EQ(states_.back().names, robot_.chain.joint_names());
  EXPECT_THAT(states_.back().touch_sensors, ElementsAre(kTouchSensor));
  EXPECT_THAT(states_.back().touch_n, ElementsAre(0.0));
  EXPECT_EQ(states_.back().velocities.size(), states_.back().names.size());
  EXPECT_EQ(states_.back().efforts.size(), states_.back().names.size());
  EXPECT_EQ(states_.back().command_seq, 0u);
}

TEST_F(SessionRig, FollowsCommandsAndNamesTheLastOne) {
  Begin(Leader::kCommand);
  auto writer = *bus_.MakeWriter<ircp::JointCommandSample>("executor");
  Eigen::VectorXd q = robot_.home;
  Advance(50, [&] {
    q[6] += 0.002;
    ASSERT_TRUE(writer->Write(CommandTo(q)).ok());
  });
  EXPECT_EQ(state().command_seq, 50u);
  EXPECT_LT((positions() - q).cwiseAbs().maxCoeff(), 0.03);
  Advance(10, [&] { ASSERT_TRUE(writer->Write(CommandTo(q)).ok()); });
  EXPECT_LT((positions() - q).cwiseAbs().maxCoeff(), 2e-3);
}

TEST_F(SessionRig, HoldsWhenCommandsStopComing) {
  Begin(Leader::kCommand);
  auto writer = *bus_.MakeWriter<ircp::JointCommandSample>("executor");
  Eigen::VectorXd q = robot_.home;
  Advance(50, [&] {
    q[6] += 0.004;
    ASSERT_TRUE(writer->Write(CommandTo(q)).ok());
  });
  EXPECT_EQ(values()["mode"], "following");
  Advance(20);
  const Eigen::VectorXd held = positions();
  EXPECT_EQ(values()["mode"], "holding");
  EXPECT_EQ(values()["stale"], "1");
  EXPECT_LT((held - q).cwiseAbs().maxCoeff(), 0.03) << "not far beyond the last command";
  Advance(50);
  EXPECT_LT((positions() - held).cwiseAbs().maxCoeff(), 2e-3);
}

TEST_F(SessionRig, ACommandForOtherJointsIsRefusedAndCounted) {
  Begin(Leader::kCommand);
  auto writer = *bus_.MakeWriter<ircp::JointCommandSample>("executor");
  ircp::JointCommandSample sample;
  sample.names = {"left_knee"};
  sample.positions = {1};
  sample.validity = milliseconds(100);
  ASSERT_TRUE(writer->Write(sample).ok());
  Advance(2);
  EXPECT_EQ(values()["samples_refused"], "1");
  EXPECT_EQ(state().command_seq, 0u);
}

TEST_F(SessionRig, FollowsAPersonsSuitByName) {
  Begin(Leader::kSuit);
  auto writer = *bus_.MakeWriter<ircp::SuitSample>("suit");
  int i = 0;
  double elbow = robot_.home[6];
  Advance(100, [&] {
    if (i++ % 2 != 0) return;
    elbow += 0.004;
    ircp::SuitSample sample;
    sample.header.stamp = clock_.Now();
    sample.names = {"left_knee", "right_elbow_in_out"};
    sample.positions = {0.3, elbow};
    ASSERT_TRUE(writer->Write(sample).ok());
  });
  Eigen::VectorXd expected = robot_.home;
  expected[6] = elbow;
  EXPECT_LT((positions() - expected).cwiseAbs().maxCoeff(), 0.03);
}

TEST_F(SessionRig, PutsAButtonWhereItIsToldTo) {
  Begin(Leader::kCommand);
  const auto answer = client_->Call("place", {{"object", "target"}, {"x", "0.5"}, {"y", "-0.3"}},
                                    std::chrono::seconds(30));
  ASSERT_TRUE(answer.ok()) << answer.error().message;
  EXPECT_EQ(values()["position.target"], "0.5,-0.3,0.04,0,0,0,1");
}

TEST_F(SessionRig, SaysWhyAPlaceIsRefused) {
  Begin(Leader::kCommand);
  const auto why = [this](std::map<std::string, std::string> arguments) {
    const auto answer = client_->Call("place", std::move(arguments), std::chrono::seconds(30));
    return answer.ok() ? std::string("no error") : answer.error().message;
  };
  EXPECT_THAT(why({{"x", "0.5"}}), HasSubstr("object is missing"));
  EXPECT_THAT(why({{"object", "lamp"}}), HasSubstr("\"lamp\""));
  EXPECT_THAT(why({{"object", "target"}, {"x", "far"}}), HasSubstr("x: \"far\""));
  EXPECT_THAT(why({{"object", "target"}, {"x", "nan"}}), HasSubstr("x: \"nan\""));
  EXPECT_THAT(why({{"object", "target"}, {"z", "1e300"}}), HasSubstr("z is 1e300"));
  EXPECT_THAT(why({{"object", "target"}, {"qx", "0.5"}}), HasSubstr("norm"));
  const Eigen::Vector3d hand = robot_.chain.ToolPose(robot_.home).translation;
  EXPECT_THAT(why({{"object", "target"},
                   {"x", FormatDouble(hand.x())},
                   {"y", FormatDouble(hand.y())},
                   {"z", FormatDouble(hand.z())}}),
              HasSubstr("stand in the robot"));
}

TEST_F(SessionRig, GoesHomeWhenAsked) {
  Begin(Leader::kCommand);
  auto writer = *bus_.MakeWriter<ircp::JointCommandSample>("executor");
  Eigen::VectorXd q = robot_.home;
  Advance(60, [&] {
    q[6] += 0.005;
    ASSERT_TRUE(writer->Write(CommandTo(q)).ok());
  });
  ASSERT_GT((positions() - robot_.home).cwiseAbs().maxCoeff(), 0.2);
  const auto answer = client_->Call("home", {}, std::chrono::seconds(30));
  ASSERT_TRUE(answer.ok()) << answer.error().message;
  const double seconds = *ParseDouble(answer->values.at("seconds"));
  Advance(static_cast<int>(seconds / 0.008) + 20);
  EXPECT_LT((positions() - robot_.home).cwiseAbs().maxCoeff(), 2e-3);
}

TEST_F(SessionRig, CountsAPressThatCommandsMake) {
  Begin(Leader::kCommand);
  auto writer = *bus_.MakeWriter<ircp::JointCommandSample>("executor");
  const Press press(robot_, scene_.buttons[0], scene_.buttons[0].base_T_object, 0.005);
  std::vector<Eigen::VectorXd> corners = {robot_.home, press.above};
  corners.insert(corners.end(), press.down.begin(), press.down.end());
  double strongest = 0;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const int steps = i == 0 ? 120 : 8;
    int k = 0;
    Advance(steps, [&] {
      const double s = static_cast<double>(++k) / steps;
      ASSERT_TRUE(writer->Write(CommandTo(corners[i] + s * (corners[i + 1] - corners[i]))).ok());
      strongest = std::max(strongest, state().touch_n[0]);
    });
  }
  Advance(20, [&] { ASSERT_TRUE(writer->Write(CommandTo(corners.back())).ok()); });
  strongest = std::max(strongest, state().touch_n[0]);
  EXPECT_EQ(values()["clicks.target"], "1");
  EXPECT_GT(strongest, scene_.buttons[0].click_force_n);
  ASSERT_TRUE(client_->Call("reset_clicks", {}, std::chrono::seconds(30)).ok());
  EXPECT_EQ(values()["clicks.target"], "0");
}

TEST_F(SessionRig, ARateAboveTheStepsIsAnError) {
  const auto session = Session::Create(bus_, clock_, log_, robot_, scene_, {.rate_hz = 2000});
  ASSERT_FALSE(session.ok());
  EXPECT_EQ(session.error().field, "rate-hz");
}

/// The arm with a hand, a block and a tray.
class HandRig : public SessionRig {
 protected:
  HandRig() : SessionRig("arm7_hand", "carry_table.yaml") {}
};

TEST_F(HandRig, OpensAndClosesItsHandAsCommandedAndMeasuresIt) {
  Begin(Leader::kCommand);
  EXPECT_NEAR(state().hand_open, 1, 1e-3);
  auto writer = *bus_.MakeWriter<ircp::JointCommandSample>("executor");
  ircp::JointCommandSample close = CommandTo(robot_.home);
  close.has_hand_open = true;
  close.hand_open = 0.25;
  Advance(10, [&] { ASSERT_TRUE(writer->Write(close).ok()); });
  EXPECT_GT(state().hand_open, 0.5) << "it takes its time";
  EXPECT_LT(state().hand_open, 0.9);
  Advance(60, [&] { ASSERT_TRUE(writer->Write(close).ok()); });
  EXPECT_NEAR(state().hand_open, 0.25, 0.02);
  // Commands that say nothing of the hand leave it where it is.
  Advance(60, [&] { ASSERT_TRUE(writer->Write(CommandTo(robot_.home)).ok()); });
  EXPECT_NEAR(state().hand_open, 0.25, 0.02);
}

TEST_F(HandRig, FollowsAPersonsGloveWithTheSuit) {
  Begin(Leader::kSuit);
  auto glove = *bus_.MakeWriter<ircp::EndEffectorSample>("suit");
  ircp::EndEffectorSample sample;
  sample.has_pose = false;
  ASSERT_TRUE(glove->Write(sample).ok());
  Advance(30);
  EXPECT_NEAR(state().hand_open, 1, 0.02) << "nothing was said of the hand";
  sample.has_hand_open = true;
  sample.hand_open = 0;
  ASSERT_TRUE(glove->Write(sample).ok());
  Advance(60);
  EXPECT_NEAR(state().hand_open, 0, 0.02);
}

TEST_F(HandRig, TracksObjectsWithNoiseAtTheirRate) {
  std::map<std::string, std::vector<Eigen::Vector3d>> seen;
  std::size_t samples = 0;
  auto reader = *bus_.MakeReader<ircp::ObjectSample>(
      [&](const ircp::ObjectSample& sample, const ircp::Reception&) {
        const std::lock_guard lock(mutex_);
        seen[sample.name].push_back(sample.base_T_object.translation);
        EXPECT_EQ(sample.frame, "base");
        EXPECT_NEAR(std::sqrt(sample.position_variance_m2[0]), 0.002, 1e-12);
        ++samples;
        heard_.notify_all();
      });
  SessionOptions options;
  options.track_hz = 62.5;
  options.noise.object_m = 0.002;
  Begin(Leader::kCommand, options);
  Advance(250);
  std::unique_lock lock(mutex_);
  // Every 16 ms for two seconds.
  ASSERT_TRUE(heard_.wait_for(lock, std::chrono::seconds(30), [&] { return samples >= 250; }));
  ASSERT_EQ(seen.size(), 2u);
  for (const auto& [name, places] : seen) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& place : places) mean += place / static_cast<double>(places.size());
    double variance = 0;
    for (const Eigen::Vector3d& place : places) {
      variance += (place - mean).squaredNorm() / (3 * static_cast<double>(places.size()));
    }
    const scene::Object& object = name == "block" ? scene_.objects[0] : scene_.objects[1];
    EXPECT_LT((mean - object.base_T_object.translation).norm(), 1e-3) << name;
    EXPECT_NEAR(std::sqrt(variance), 0.002, 3e-4) << name;
  }
}

TEST_F(HandRig, SaysWhereObjectsAreAndPutsThemElsewhere) {
  Begin(Leader::kCommand);
  const auto placed =
      client_->Call("place", {{"object", "block"}, {"x", "0.6"}, {"y", "-0.3"}, {"z", "0.02"}},
                    std::chrono::seconds(30));
  ASSERT_TRUE(placed.ok()) << placed.error().message;
  Advance(20);
  EXPECT_THAT(values()["position.block"], HasSubstr("0.6"));
  EXPECT_THAT(values()["position.tray"], HasSubstr("0.48"));
  EXPECT_EQ(values()["hand_open"], "1.000");
  const auto inside =
      client_->Call("place", {{"object", "block"}, {"x", "0.6"}, {"y", "0"}, {"z", "-0.02"}},
                    std::chrono::seconds(30));
  ASSERT_FALSE(inside.ok());
  EXPECT_THAT(inside.error().message, HasSubstr("another thing"));
}

}  // namespace
}  // namespace exemplar::simulator
