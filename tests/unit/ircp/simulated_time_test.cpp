#include "exemplar/ircp/simulated_time.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "exemplar/ircp/control.hpp"
#include "exemplar/ircp/in_step_bus.hpp"
#include "exemplar/ircp/memory_bus.hpp"
#include "support/eventually.hpp"

namespace exemplar::ircp {
namespace {

using std::chrono::milliseconds;
using testing::Eventually;

constexpr auto kAllHasCome = [](const TopicCount&) { return true; };

class SimulatedTime : public ::testing::Test {
 protected:
  std::unique_ptr<TimeLeader> MakeLeader(const TimeLeaderOptions& options = {}) {
    auto leader = TimeLeader::Create(bus_, real_, "simulator", options);
    EXPECT_TRUE(leader.ok());
    return std::move(*leader);
  }
  std::unique_ptr<NetworkClock> MakeClock(const std::string& program = "executor",
                                          const NetworkClockOptions& options = {}) {
    auto clock = NetworkClock::Create(bus_, program, options);
    EXPECT_TRUE(clock.ok());
    return std::move(*clock);
  }
  bool Lead(TimeLeader& leader, Duration time) {
    return leader.Lead(time, Stamp() + std::chrono::hours(1) + time, {}, kAllHasCome,
                       stop_.get_token());
  }

  SystemClock real_;
  MemoryBus bus_{real_};
  std::stop_source stop_;
};

TEST_F(SimulatedTime, IsWhatTheLeaderSays) {
  const auto clock = MakeClock();
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  EXPECT_EQ(clock->Steady(), Duration(0));
  ASSERT_TRUE(Lead(*leader, milliseconds(0)));
  EXPECT_TRUE(clock->WaitForLeader({}));
  ASSERT_TRUE(Lead(*leader, milliseconds(30)));
  EXPECT_EQ(clock->Steady(), milliseconds(30));
  EXPECT_EQ(clock->Now(), Stamp() + std::chrono::hours(1) + milliseconds(30));
}

TEST_F(SimulatedTime, MovesOnWhenEveryLoopOfEveryFollowerHasDoneItsWork) {
  constexpr int kBeats = 300;
  const auto first = MakeClock("first");
  const auto second = MakeClock("second");
  const auto leader = MakeLeader({.in_step_with = {"first", "second"}});
  std::atomic<int> fast{0};
  std::atomic<int> slow{0};
  std::atomic<int> other{0};
  const auto loop = [](const NetworkClock& clock, Duration period, std::atomic<int>& count) {
    return std::jthread([&clock, period, &count](const std::stop_token& stop) {
      for (Duration next = period; clock.SleepUntil(next, stop); next += period) {
        std::this_thread::yield();
        ++count;
      }
    });
  };
  const std::jthread threads[] = {loop(*first, milliseconds(1), fast),
                                  loop(*first, milliseconds(3), slow),
                                  loop(*second, milliseconds(2), other)};
  ASSERT_TRUE(Eventually([&] { return first->asleep() == 2 && second->asleep() == 1; }));
  for (int beat = 0; beat <= kBeats; ++beat) {
    ASSERT_TRUE(Lead(*leader, milliseconds(beat)));
    ASSERT_EQ(fast, beat);
    ASSERT_EQ(slow, beat / 3);
    ASSERT_EQ(other, beat / 2);
  }
}

TEST_F(SimulatedTime, DoesNotWaitForAThreadThatHasLeftItsLoop) {
  const auto clock = MakeClock("executor", {.patience = milliseconds(1)});
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::thread([&] { EXPECT_TRUE(clock->SleepUntil(milliseconds(0), {})); }).join();
  EXPECT_TRUE(Lead(*leader, milliseconds(1)));
  EXPECT_TRUE(Lead(*leader, milliseconds(2)));
}

TEST_F(SimulatedTime, DoesNotWaitForAThreadWhoseSleepWasStopped) {
  const auto clock = MakeClock("executor", {.patience = std::chrono::hours(1)});
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  stop_.request_stop();
  std::thread([&] {
    EXPECT_TRUE(clock->SleepUntil(milliseconds(0), {}));
    EXPECT_FALSE(clock->SleepUntil(Duration::max(), stop_.get_token()));
  }).join();
  EXPECT_TRUE(leader->Lead(milliseconds(1), Stamp(), {}, kAllHasCome, {}));
}

TEST_F(SimulatedTime, WaitsForAFollowerThatComesLater) {
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::atomic<bool> moved{false};
  const std::jthread leading([&] {
    EXPECT_TRUE(Lead(*leader, milliseconds(5)));
    moved = true;
  });
  EXPECT_FALSE(moved);
  const auto clock = MakeClock();
  EXPECT_TRUE(Eventually([&] { return moved.load(); }));
}

TEST_F(SimulatedTime, WaitsForSomeOnlyFromTheirTimeOn) {
  const auto leader = MakeLeader({.in_step_with = {"suit@0.5"}});
  ASSERT_TRUE(Lead(*leader, milliseconds(499)));
  std::atomic<bool> moved{false};
  const std::jthread leading([&] {
    EXPECT_TRUE(Lead(*leader, milliseconds(500)));
    moved = true;
  });
  const auto other = MakeClock("executor");
  ASSERT_TRUE(
      Eventually([&] { return other->Steady() == milliseconds(0) && other->WaitForLeader({}); }));
  EXPECT_FALSE(moved);
  const auto clock = MakeClock("suit");
  EXPECT_TRUE(Eventually([&] { return moved.load(); }));
}

TEST_F(SimulatedTime, RefusesNamesWithoutSense) {
  for (const char* entry : {"", "@1", "suit@", "suit@soon", "suit@-1"}) {
    const auto leader = TimeLeader::Create(bus_, real_, "simulator", {.in_step_with = {entry}});
    ASSERT_FALSE(leader.ok()) << entry;
    EXPECT_EQ(leader.error().message,
              "\"" + std::string(entry) + "\" is neither NAME nor NAME@SECONDS");
  }
}

TEST_F(SimulatedTime, WaitsForWhatFollowersHaveSent) {
  const auto clock = MakeClock();
  InStepBus in_step(bus_, bus_, nullptr, *clock);
  const auto writer = *in_step.MakeWriter<JointCommandSample>("executor");
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  ASSERT_TRUE(Lead(*leader, milliseconds(0)));
  ASSERT_TRUE(writer->Write({}).ok());
  std::atomic<bool> has_come{false};
  std::atomic<int> asked{0};
  std::atomic<bool> moved{false};
  const std::jthread leading([&] {
    const auto asks = [&](const TopicCount& count) {
      EXPECT_EQ(count.topic, "ircp/joint_command");
      EXPECT_EQ(count.source, "executor");
      EXPECT_EQ(count.sent, 1u);
      ++asked;
      return has_come.load();
    };
    EXPECT_TRUE(leader->Lead(milliseconds(1), Stamp(), {}, asks, {}));
    moved = true;
  });
  ASSERT_TRUE(Eventually([&] { return asked > 0; }));
  EXPECT_FALSE(moved);
  has_come = true;
  leader->Recheck();
  EXPECT_TRUE(Eventually([&] { return moved.load(); }));
}

TEST_F(SimulatedTime, DoesNotWaitForWhatWasSentBeforeItLed) {
  const auto clock = MakeClock();
  InStepBus in_step(bus_, bus_, nullptr, *clock);
  const auto writer = *in_step.MakeWriter<JointCommandSample>("executor");
  ASSERT_TRUE(writer->Write({}).ok());
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  const auto nothing = [](const TopicCount&) { return false; };
  EXPECT_TRUE(leader->Lead(milliseconds(1), Stamp(), {}, nothing, {}));
}

TEST_F(SimulatedTime, IsAnsweredOnceTheProgramHasSettled) {
  const auto clock = MakeClock();
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::atomic<bool> is_settled{false};
  std::atomic<int> asked{0};
  clock->SetSettled([&] {
    ++asked;
    return is_settled.load();
  });
  std::atomic<bool> reached{false};
  const std::jthread leading([&] {
    EXPECT_TRUE(Lead(*leader, milliseconds(8)));
    reached = true;
  });
  ASSERT_TRUE(Eventually([&] { return asked > 0; }));
  const int before = asked;
  clock->Recheck();
  ASSERT_TRUE(Eventually([&] { return asked > before; }));
  EXPECT_FALSE(reached);
  is_settled = true;
  clock->Recheck();
  EXPECT_TRUE(Eventually([&] { return reached.load(); }));
  clock->SetSettled(nullptr);
}

TEST_F(SimulatedTime, IsNotHeldUpByAProgramThatNeverSettles) {
  const auto clock = MakeClock("executor", {.input_patience = milliseconds(1)});
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  clock->SetSettled([] { return false; });
  ASSERT_TRUE(Lead(*leader, milliseconds(0)));
  EXPECT_TRUE(Lead(*leader, milliseconds(1)));
  EXPECT_EQ(clock->Steady(), milliseconds(1));
  clock->SetSettled(nullptr);
}

TEST_F(SimulatedTime, WaitsForAProgramUntilItIsComplete) {
  const auto clock = MakeClock("executor", {.is_complete = false});
  InStepBus in_step(bus_, bus_, nullptr, *clock);
  const auto writer = *in_step.MakeWriter<SuitSample>("suit");
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::atomic<bool> reached{false};
  const std::jthread leading([&] {
    EXPECT_TRUE(Lead(*leader, milliseconds(3)));
    reached = true;
  });
  EXPECT_TRUE(clock->WaitForLeader({}));
  EXPECT_FALSE(reached);
  EXPECT_TRUE(clock->Begin(NetworkClock::Caller::kOnlyWaits));
  EXPECT_TRUE(Eventually([&] { return reached.load(); }));
}

TEST_F(SimulatedTime, BeginsAProgramsFirstMomentOnceItsThreadSleeps) {
  const auto clock =
      MakeClock("executor", {.patience = std::chrono::hours(1), .is_complete = false});
  InStepBus in_step(bus_, bus_, nullptr, *clock);
  const auto writer = *in_step.MakeWriter<SuitSample>("suit");
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  std::atomic<bool> reached{false};
  const std::jthread leading([&] {
    EXPECT_TRUE(Lead(*leader, milliseconds(0)));
    reached = true;
    EXPECT_TRUE(Lead(*leader, milliseconds(7)));
  });
  ASSERT_TRUE(clock->Begin(NetworkClock::Caller::kSleeps));
  EXPECT_FALSE(reached);
  EXPECT_TRUE(clock->SleepUntil(milliseconds(7), {}));
  EXPECT_EQ(clock->Steady(), milliseconds(7));
  EXPECT_TRUE(clock->SleepUntilWithin(milliseconds(7), std::chrono::seconds(20)));
  EXPECT_FALSE(clock->SleepUntilWithin(milliseconds(8), milliseconds(1)));
  EXPECT_FALSE(clock->SleepUntil(Duration::max(), [] {
    std::stop_source left;
    left.request_stop();
    return left.get_token();
  }()));
}

TEST_F(SimulatedTime, StandsStillWhileItIsHeld) {
  const auto clock = MakeClock();
  const auto leader = MakeLeader({.in_step_with = {"executor"}});
  ASSERT_TRUE(Lead(*leader, milliseconds(0)));
  std::atomic<bool> reached{false};
  std::jthread leading;
  {
    const TimeHold hold(*clock);
    leading = std::jthread([&] {
      EXPECT_TRUE(Lead(*leader, milliseconds(8)));
      reached = true;
    });
    ASSERT_TRUE(Eventually([&] { return clock->Steady() == milliseconds(8); }));
    EXPECT_FALSE(reached);
  }
  EXPECT_TRUE(Eventually([&] { return reached.load(); }));
  EXPECT_NE(&RealTimeOf(*clock), clock.get());
  EXPECT_EQ(&RealTimeOf(real_), &real_);
}

TEST_F(SimulatedTime, GoesOnAtOnceWithoutAFollowerThatHasLeft) {
  const auto leader = MakeLeader({.in_step_with = {"executor"}, .patience = std::chrono::hours(1)});
  {
    const auto clock = MakeClock();
    ASSERT_TRUE(Lead(*leader, milliseconds(1)));
  }
  EXPECT_TRUE(Lead(*leader, milliseconds(2)));
  EXPECT_TRUE(leader->TakeLost().empty());
}

TEST_F(SimulatedTime, GoesOnWithoutAFollowerThatFellSilentAndNamesIt) {
  const auto leader = MakeLeader({.in_step_with = {"executor"}, .patience = Duration(0)});
  {
    const auto clock = MakeClock();
    ASSERT_TRUE(Lead(*leader, milliseconds(1)));
    EXPECT_TRUE(leader->TakeLost().empty());
    bus_.LoseWhere([](const std::string& topic, const Header& header) {
      return topic == ClockSample::kTopic && header.source == "executor";
    });
  }
  ASSERT_TRUE(Lead(*leader, milliseconds(2)));
  EXPECT_EQ(leader->TakeLost(), std::vector<std::string>{"executor"});
  EXPECT_TRUE(Lead(*leader, milliseconds(3)));
  EXPECT_TRUE(leader->TakeLost().empty());
}

// ---- what one hears in step

class InStepNetwork : public SimulatedTime {
 protected:
  /// A program in step.
  struct Program {
    std::unique_ptr<NetworkClock> clock;
    std::unique_ptr<InStepBus> bus;
  };
  Program Make(const std::string& name) {
    Program program;
    program.clock = MakeClock(name);
    program.bus = std::make_unique<InStepBus>(bus_, bus_, nullptr, *program.clock);
    return program;
  }
};

TEST_F(InStepNetwork, HandsSamplesOverAtTheNextMomentInAFixedOrder) {
  const Program suit = Make("suit");
  const Program touch = Make("touch");
  const Program listener = Make("listener");
  const auto leader = MakeLeader({.in_step_with = {"suit", "touch", "listener"}});
  const auto joints = *suit.bus->MakeWriter<SuitSample>("suit");
  const auto forces = *touch.bus->MakeWriter<TactileSample>("finger");
  const auto states = *bus_.MakeWriter<JointStateSample>(kRobotSource);
  std::vector<std::string> heard;
  std::vector<Stamp> received;
  const auto note = [&](const auto& sample, const Reception& from) {
    heard.push_back(sample.header.source + std::to_string(sample.header.seq));
    received.push_back(from.received);
  };
  const auto joint_reader = *listener.bus->MakeReader<SuitSample>(note);
  const auto force_reader = *listener.bus->MakeReader<TactileSample>(note);
  const auto state_reader = *listener.bus->MakeReader<JointStateSample>(note);
  const auto lead = [&](int ms) {
    const std::vector<TopicCount> sent = {{JointStateSample::kTopic, kRobotSource, states->sent()}};
    return leader->Lead(milliseconds(ms), Stamp() + milliseconds(ms), sent, kAllHasCome, {});
  };
  ASSERT_TRUE(lead(0));
  ASSERT_TRUE(lead(1));  // now everybody is known
  ASSERT_TRUE(states->Write({}).ok());
  ASSERT_TRUE(forces->Write({}).ok());
  ASSERT_TRUE(forces->Write({}).ok());
  ASSERT_TRUE(joints->Write({}).ok());
  EXPECT_TRUE(heard.empty());
  ASSERT_TRUE(lead(2));  // the leader had not heard yet what was sent after 1
  EXPECT_EQ(heard, std::vector<std::string>({"robot1"}));
  ASSERT_TRUE(lead(3));
  EXPECT_EQ(heard, std::vector<std::string>({"robot1", "suit1", "finger1", "finger2"}));
  EXPECT_EQ(received.front(), Stamp() + milliseconds(2));
  EXPECT_EQ(received.back(), Stamp() + milliseconds(3));
}

TEST_F(InStepNetwork, HandsOverAtTheNextMomentWhatWasSentWhileTimeStood) {
  const Program suit = Make("suit");
  const Program listener = Make("listener");
  const auto leader = MakeLeader({.in_step_with = {"suit", "listener"}});
  const auto joints = *suit.bus->MakeWriter<SuitSample>("suit");
  std::vector<Stamp> received;
  const auto reader = *listener.bus->MakeReader<SuitSample>(
      [&](const SuitSample&, const Reception& from) { received.push_back(from.received); });
  const auto lead = [&](int ms) {
    return leader->Lead(milliseconds(ms), Stamp() + milliseconds(ms), {}, kAllHasCome, {});
  };
  ASSERT_TRUE(lead(0));
  for (int ms = 1; ms < 30; ++ms) {
    ASSERT_TRUE(lead(ms));
    ASSERT_TRUE(joints->Write({}).ok());  // everybody has answered before
    leader->AskAnew();
    ASSERT_TRUE(lead(ms));
    ASSERT_TRUE(lead(ms + 1));
    ASSERT_EQ(received.size(), static_cast<std::size_t>(ms));
    ASSERT_EQ(received.back(), Stamp() + milliseconds(ms + 1));
  }
}

TEST_F(InStepNetwork, SettlesAfterEachSampleBeforeAnybodyActs) {
  const Program program = Make("program");
  const auto leader = MakeLeader({.in_step_with = {"program"}});
  const auto states = *bus_.MakeWriter<JointStateSample>(kRobotSource);
  std::atomic<int> taken{0};
  std::atomic<int> checked{0};
  const auto reader =
      *program.bus->MakeReader<JointStateSample>([&](const JointStateSample&, const Reception&) {
        EXPECT_EQ(taken, checked);
        ++taken;
      });
  program.clock->SetSettled([&] {
    checked = taken.load();
    return true;
  });
  const auto lead = [&](int ms) {
    return leader->Lead(milliseconds(ms), Stamp(),
                        {{JointStateSample::kTopic, kRobotSource, states->sent()}}, kAllHasCome,
                        {});
  };
  ASSERT_TRUE(lead(0));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(states->Write({}).ok());
  ASSERT_TRUE(lead(1));
  EXPECT_EQ(taken, 3);
  program.clock->SetSettled(nullptr);
}

TEST_F(InStepNetwork, PassesOnAtOnceWhatOutsidersSend) {
  const Program program = Make("program");
  int heard = 0;
  const auto reader = *program.bus->MakeReader<SafetySample>(
      [&](const SafetySample&, const Reception&) { ++heard; });
  const auto stop_button = *bus_.MakeWriter<SafetySample>("button");
  ASSERT_TRUE(stop_button->Write({}).ok());
  EXPECT_EQ(heard, 1);
}

TEST_F(InStepNetwork, IsNotHeldUpByASampleThatNeverComes) {
  Program program;
  program.clock = MakeClock("program", {.input_patience = milliseconds(1)});
  program.bus = std::make_unique<InStepBus>(bus_, bus_, nullptr, *program.clock);
  const auto leader = MakeLeader({.in_step_with = {"program"}});
  const auto states = *bus_.MakeWriter<JointStateSample>(kRobotSource);
  const auto reader =
      *program.bus->MakeReader<JointStateSample>([](const JointStateSample&, const Reception&) {});
  const auto lead = [&](int ms, std::uint64_t sent) {
    return leader->Lead(milliseconds(ms), Stamp(), {{JointStateSample::kTopic, kRobotSource, sent}},
                        kAllHasCome, {});
  };
  ASSERT_TRUE(lead(0, 0));
  EXPECT_TRUE(lead(1, 5));
  EXPECT_EQ(program.clock->Steady(), milliseconds(1));
}

TEST_F(InStepNetwork, WaitsForTheFirstSampleOfAWriterThatCameWhileTimeStood) {
  Program program;
  program.clock = MakeClock("program", {.input_patience = std::chrono::minutes(1)});
  program.bus = std::make_unique<InStepBus>(bus_, bus_, nullptr, *program.clock);
  const auto leader = MakeLeader({.in_step_with = {"program"}});
  std::atomic<std::int64_t> received_ns{-1};
  const auto reader = *program.bus->MakeReader<JointStateSample>(
      [&](const JointStateSample&, const Reception& from) {
        received_ns = (from.received - Stamp()).count();
      });
  const auto lead = [&](int ms, std::uint64_t sent) {
    return leader->Lead(milliseconds(ms), Stamp() + milliseconds(ms),
                        {{JointStateSample::kTopic, kRobotSource, sent}}, kAllHasCome, {});
  };
  ASSERT_TRUE(lead(0, 0));
  ASSERT_TRUE(lead(1, 0));
  const auto states = *bus_.MakeWriter<JointStateSample>(kRobotSource);
  leader->AskAnew();
  ASSERT_TRUE(lead(1, 0));  // it stands
  std::atomic<int> said{0};
  bus_.LoseWhere([&](const std::string& topic, const Header& header) {
    if (topic == ClockSample::kTopic && header.source == "simulator") ++said;
    return false;
  });
  std::atomic<bool> has_led{false};
  std::jthread leading([&] { has_led = lead(2, 1); });
  // The leader says the time again while it is not reached.
  ASSERT_TRUE(Eventually([&] { return said >= 3 || has_led; }));
  EXPECT_FALSE(has_led);
  ASSERT_TRUE(states->Write({}).ok());
  leading.join();
  EXPECT_TRUE(has_led);
  EXPECT_EQ(Duration(received_ns.load()), milliseconds(2));
}

TEST_F(InStepNetwork, AcknowledgesOnceReadersInStepHaveTheSamples) {
  Program program;
  program.clock = MakeClock("program", {.patience = milliseconds(1)});
  program.bus = std::make_unique<InStepBus>(bus_, bus_, nullptr, *program.clock);
  const auto leader = MakeLeader({.in_step_with = {"program"}});
  const auto writer = *program.bus->MakeWriter<SuitSample>("suit");
  ASSERT_TRUE(Lead(*leader, milliseconds(0)));
  EXPECT_TRUE(writer->WaitForAcknowledgments(milliseconds(1)));  // nothing was sent
  ASSERT_TRUE(writer->Write({}).ok());
  EXPECT_FALSE(writer->WaitForAcknowledgments(milliseconds(1)));
  ASSERT_TRUE(Lead(*leader, milliseconds(8)));
  EXPECT_TRUE(writer->WaitForAcknowledgments(milliseconds(1)));
}

TEST_F(InStepNetwork, ACallTakesNoTimeAndIsHeardAtTheTimeItWasMade) {
  const Program asker = Make("asker");
  const Program recorder = Make("recorder");
  const auto leader = MakeLeader({.in_step_with = {"asker", "recorder"}});
  std::atomic<std::int64_t> asked_at{-1};
  const auto server = *ControlServer::Create(*recorder.bus, *recorder.clock, "recorder",
                                             [&](const CommandSample&) -> Answer {
                                               asked_at = recorder.clock->Steady().count();
                                               return {true, "started", {}};
                                             });
  const auto client = *ControlClient::Create(*asker.bus, *asker.clock, "recorder", "asker", 1);
  std::atomic<std::int64_t> answered_at{-1};
  std::jthread caller([&](const std::stop_token& stop) {
    ASSERT_TRUE(asker.clock->SleepUntil(milliseconds(8), stop));
    const auto answer = client->Call("start", {}, std::chrono::seconds(20), stop);
    EXPECT_TRUE(answer.ok());
    answered_at = asker.clock->Steady().count();
    EXPECT_FALSE(asker.clock->SleepUntil(Duration::max(), stop));
  });
  ASSERT_TRUE(Eventually([&] { return asker.clock->asleep() == 1; }));
  for (int ms = 0; ms <= 24; ms += 4) ASSERT_TRUE(Lead(*leader, milliseconds(ms)));
  EXPECT_EQ(Duration(asked_at.load()), milliseconds(8));
  EXPECT_EQ(Duration(answered_at.load()), milliseconds(8));
}

TEST_F(SimulatedTime, NeverGoesBackWhenAnotherLeaderBegins) {
  const auto clock = MakeClock();
  ASSERT_TRUE(Lead(*MakeLeader({.in_step_with = {"executor"}}), milliseconds(700)));
  const Duration before = clock->Steady();
  const auto again = MakeLeader({.in_step_with = {"executor"}});
  ASSERT_TRUE(Lead(*again, milliseconds(0)));
  EXPECT_EQ(clock->Steady(), before);
  ASSERT_TRUE(Lead(*again, milliseconds(10)));
  EXPECT_EQ(clock->Steady(), before + milliseconds(10));
}

TEST_F(SimulatedTime, EndsSleepAndLeadershipWhenAsked) {
  const auto clock = MakeClock();
  const auto leader = MakeLeader({.in_step_with = {"nobody"}});
  stop_.request_stop();
  EXPECT_FALSE(clock->SleepUntil(milliseconds(1), stop_.get_token()));
  EXPECT_FALSE(clock->WaitForLeader(stop_.get_token()));
  EXPECT_FALSE(Lead(*leader, milliseconds(1)));
}

}  // namespace
}  // namespace exemplar::ircp
