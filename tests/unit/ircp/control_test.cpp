#include "exemplar/ircp/control.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <future>
#include <mutex>
#include <thread>

#include "exemplar/ircp/memory_bus.hpp"

namespace exemplar::ircp {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// The statuses of a program, to wait for.
class Statuses {
 public:
  explicit Statuses(Bus& bus, const std::string& program) {
    reader_ = std::move(*bus.MakeReaderOn<StatusSample>(
        StatusTopic(program), [this](const StatusSample& status, const Reception&) {
          const std::lock_guard lock(mutex_);
          all_.push_back(status);
          came_.notify_all();
        }));
  }
  /// The first status for which `wanted` is true, from before or within 20 s.
  template <class Wanted>
  std::optional<StatusSample> Await(Wanted wanted) {
    std::unique_lock lock(mutex_);
    std::optional<StatusSample> found;
    came_.wait_for(lock, seconds(20), [&] {
      for (const StatusSample& status : all_) {
        if (wanted(status)) {
          found = status;
          return true;
        }
      }
      return false;
    });
    return found;
  }
  int AnswersTo(const std::string& request_id) {
    const std::lock_guard lock(mutex_);
    int count = 0;
    for (const StatusSample& status : all_) count += status.request_id == request_id ? 1 : 0;
    return count;
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<StatusSample> all_;
  std::unique_ptr<Reader> reader_;
};

CommandSample Command(const std::string& id, const std::string& action) {
  CommandSample command;
  command.program = "recorder";
  command.request_id = id;
  command.action = action;
  return command;
}

class ControlTest : public ::testing::Test {
 protected:
  std::unique_ptr<ControlServer> Serve(ControlServer::Handler handler) {
    auto server = ControlServer::Create(bus_, clock_, "recorder", std::move(handler));
    EXPECT_TRUE(server.ok());
    return std::move(*server);
  }
  std::unique_ptr<Writer<CommandSample>> CommandWriter() {
    return std::move(*bus_.MakeWriterOn<CommandSample>(CommandTopic("recorder"), "test"));
  }

  ManualClock clock_;
  MemoryBus bus_{clock_};
};

TEST_F(ControlTest, DoesARepeatedRequestOnceAndAnswersItEachTime) {
  std::atomic<int> done = 0;
  const auto server = Serve([&](const CommandSample& command) {
    ++done;
    return Answer{true, "did " + command.action, {{"file", "a.mcap"}}};
  });
  Statuses statuses(bus_, "recorder");
  const auto writer = CommandWriter();
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(writer->Write(Command("r1", "start")).ok());
  // Commands are done in order: when this one is answered, the three before are.
  ASSERT_TRUE(writer->Write(Command("r2", "stop")).ok());
  ASSERT_TRUE(statuses.Await([](const StatusSample& s) { return s.request_id == "r2"; }));
  EXPECT_EQ(done, 2);
  ASSERT_TRUE(writer->Write(Command("r1", "start")).ok());
  ASSERT_TRUE(writer->Write(Command("r3", "stop")).ok());
  ASSERT_TRUE(statuses.Await([](const StatusSample& s) { return s.request_id == "r3"; }));
  EXPECT_EQ(done, 3);
  EXPECT_GE(statuses.AnswersTo("r1"), 2);

  const auto answer = statuses.Await([](const StatusSample& s) { return s.request_id == "r1"; });
  ASSERT_TRUE(answer.has_value());
  EXPECT_TRUE(answer->ok);
  EXPECT_EQ(answer->detail, "did start");
  EXPECT_EQ(answer->values.at("file"), "a.mcap");
}

TEST_F(ControlTest, RefusesCommandsThatWaitedLongerThanTheyAreValid) {
  std::promise<void> started;
  std::promise<void> go;
  std::atomic<int> stops = 0;
  const auto server = Serve([&](const CommandSample& command) {
    if (command.action == "start") {
      started.set_value();
      go.get_future().wait();
    } else {
      ++stops;
    }
    return Answer{};
  });
  Statuses statuses(bus_, "recorder");
  const auto writer = CommandWriter();
  ASSERT_TRUE(writer->Write(Command("long", "start")).ok());
  started.get_future().wait();
  CommandSample stop = Command("late", "stop");
  stop.validity = seconds(2);
  ASSERT_TRUE(writer->Write(stop).ok());
  clock_.Advance(seconds(3));
  go.set_value();
  const auto answer = statuses.Await([](const StatusSample& s) { return s.request_id == "late"; });
  ASSERT_TRUE(answer.has_value());
  EXPECT_FALSE(answer->ok);
  EXPECT_EQ(stops, 0);
}

TEST_F(ControlTest, PublishesStateCountsAndValuesOnChangeAndEverySecond) {
  const auto server = Serve([](const CommandSample&) { return Answer{}; });
  server->SetSentCounts([] { return std::vector<TopicCount>{{"ircp/suit", "suit", 7}}; });
  server->SetValues([] { return std::map<std::string, std::string>{{"disk", "full"}}; });
  Statuses statuses(bus_, "recorder");
  server->SetState("recording", "into a.mcap");
  const auto first = statuses.Await([](const StatusSample& s) { return s.state == "recording"; });
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->detail, "into a.mcap");
  EXPECT_EQ(first->request_id, "");
  ASSERT_EQ(first->sent.size(), 1u);
  EXPECT_EQ(first->sent[0].sent, 7u);
  EXPECT_EQ(first->values.at("disk"), "full");
  const std::uint64_t seq = first->header.seq;
  // The heartbeat may not yet sleep: time moves until it has spoken again.
  std::optional<StatusSample> next;
  std::jthread time([this](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      clock_.Advance(milliseconds(100));
      std::this_thread::yield();
    }
  });
  next = statuses.Await([&](const StatusSample& s) { return s.header.seq > seq + 1; });
  time.request_stop();
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->state, "recording");
}

TEST_F(ControlTest, ClientGetsAnswersAndRefusals) {
  const auto server = Serve([](const CommandSample& command) {
    if (command.action == "start")
      return Answer{true, "ok", {{"name", command.arguments.at("name")}}};
    return Answer{false, "nothing is being recorded", {}};
  });
  auto client = ControlClient::Create(bus_, clock_, "recorder", "cli", 1);
  ASSERT_TRUE(client.ok());
  const auto started = (*client)->Call("start", {{"name", "press"}}, seconds(5));
  ASSERT_TRUE(started.ok()) << started.error().message;
  EXPECT_EQ(started->values.at("name"), "press");
  const auto stopped = (*client)->Call("stop", {}, seconds(5));
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_EQ(stopped.error().message, "nothing is being recorded");
}

TEST_F(ControlTest, ClientRepeatsWhatWasLostWithTheSameRequest) {
  std::atomic<int> done = 0;
  const auto server = Serve([&](const CommandSample&) {
    ++done;
    return Answer{};
  });
  bus_.LoseWhere([](const std::string& topic, const Header& header) {
    return topic == CommandTopic("recorder") && header.seq <= 2;
  });
  auto client = ControlClient::Create(bus_, clock_, "recorder", "cli", 1);
  ASSERT_TRUE(client.ok());
  auto call = std::async(std::launch::async,
                         [&] { return (*client)->Call("start", {}, std::chrono::hours(10)); });
  while (call.wait_for(milliseconds(0)) != std::future_status::ready) {
    clock_.Advance(milliseconds(20));
    std::this_thread::yield();
  }
  EXPECT_TRUE(call.get().ok());
  EXPECT_EQ(done, 1);
}

TEST_F(ControlTest, TwoServersOfAProgramLearnOfEachOtherOnce) {
  std::atomic<int> first_met = 0;
  std::atomic<int> second_met = 0;
  const auto first = Serve([](const CommandSample&) { return Answer{}; });
  first->SetOnRival([&](const std::string&) { ++first_met; });
  first->SetState("ready", "");
  EXPECT_EQ(first_met, 0);  // not of itself
  const auto second = Serve([](const CommandSample&) { return Answer{}; });
  second->SetOnRival([&](const std::string&) { ++second_met; });
  for (int i = 0; i < 3; ++i) {
    first->SetState("ready", "");
    second->SetState("ready", "");
  }
  EXPECT_EQ(first_met, 1);
  EXPECT_EQ(second_met, 1);
}

TEST_F(ControlTest, AStopEndsAClientsWaiting) {
  auto client = ControlClient::Create(bus_, clock_, "recorder", "cli", 1);
  ASSERT_TRUE(client.ok());
  std::stop_source stop;
  auto call = std::async(std::launch::async, [&] {
    return (*client)->Call("start", {}, std::chrono::hours(1), stop.get_token());
  });
  stop.request_stop();
  const Result<Answer> answer = call.get();
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().code, ErrorCode::kCancelled);
}

TEST_F(ControlTest, AnAnswerIsStillTakenAfterAStop) {
  const auto server = Serve([](const CommandSample&) { return Answer{}; });
  auto client = ControlClient::Create(bus_, clock_, "recorder", "cli", 1);
  ASSERT_TRUE(client.ok());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE((*client)->Call("stop", {}, std::chrono::hours(1), stop.get_token()).ok());
}

TEST_F(ControlTest, ClientSaysThatNobodyAnswers) {
  auto client = ControlClient::Create(bus_, clock_, "recorder", "cli", 1);
  ASSERT_TRUE(client.ok());
  auto call =
      std::async(std::launch::async, [&] { return (*client)->Call("start", {}, seconds(2)); });
  while (call.wait_for(milliseconds(0)) != std::future_status::ready) {
    clock_.Advance(milliseconds(20));
    std::this_thread::yield();
  }
  const Result<Answer> answer = call.get();
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().code, ErrorCode::kUnavailable);
  EXPECT_NE(answer.error().message.find("ircp/recorder/command"), std::string::npos);
}

}  // namespace
}  // namespace exemplar::ircp
