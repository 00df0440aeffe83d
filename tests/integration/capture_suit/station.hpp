#pragma once
// A station in one process, in a time that the test's own thread drives.

#include <gtest/gtest.h>

#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/memory_bus.hpp"
#include "exemplar/ircp/trial_builder.hpp"

namespace exemplar::capture_suit::testing {

/// Time that jumps to where its owner, the thread that made it, wants to sleep to. Others wait.
class LeadingClock final : public Clock {
 public:
  Stamp Now() const override { return clock_.Now(); }
  Duration Steady() const override { return clock_.Steady(); }
  bool SleepUntil(Duration steady, std::stop_token stop) const override {
    if (std::this_thread::get_id() != leader_) return clock_.SleepUntil(steady, std::move(stop));
    if (stop.stop_requested()) return false;
    if (steady > clock_.Steady()) clock_.Advance(steady - clock_.Steady());
    return true;
  }

 private:
  const std::thread::id leader_ = std::this_thread::get_id();
  mutable ManualClock clock_;
};

/// Keeps events for the test to look at.
class KeptLog final : public Log {
 public:
  void Write(LogLevel level, std::string_view event, Fields fields) override {
    std::string line(event);
    for (const LogField& field : fields) line += " " + field.name + "=" + field.value;
    const std::lock_guard lock(mutex_);
    (level == LogLevel::kWarning ? warnings_ : events_).push_back(std::move(line));
  }
  std::vector<std::string> warnings() const {
    const std::lock_guard lock(mutex_);
    return warnings_;
  }
  std::vector<std::string> events() const {
    const std::lock_guard lock(mutex_);
    return events_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> warnings_, events_;
};

/// Everything that happens on the bus, in order, and a program at the far end of `commands` that
/// answers at once.
class Station {
 public:
  explicit Station(const std::vector<std::string>& answering_programs) : bus(clock) {
    Listen<ircp::SuitSample>();
    Listen<ircp::EndEffectorSample>();
    Listen<ircp::TactileSample>();
    Listen<ircp::ObjectSample>();
    for (const std::string& program : answering_programs) Answer(program);
  }

  LeadingClock clock;
  ircp::MemoryBus bus;
  KeptLog log;
  std::vector<std::string> story;  ///< "simulator place", "ircp/suit" (once a run of samples), ...
  std::vector<ircp::CommandSample> commands;
  std::vector<ircp::SuitSample> suit;
  ircp::TrialBuilder heard;
  std::string refuse;                       ///< the action that is answered with no
  std::function<void()> on_sample = [] {};  ///< after each sample

 private:
  template <class Sample>
  void Listen() {
    auto reader = bus.MakeReader<Sample>([this](const Sample& sample, const ircp::Reception&) {
      heard.Add(sample);
      if constexpr (std::is_same_v<Sample, ircp::SuitSample>) suit.push_back(sample);
      if (story.empty() || story.back() != Sample::kTopic) story.push_back(Sample::kTopic);
      on_sample();
    });
    readers_.push_back(std::move(*reader));
  }

  void Answer(const std::string& program) {
    auto writer = bus.MakeWriterOn<ircp::StatusSample>(ircp::StatusTopic(program), program);
    writers_.push_back(std::move(*writer));
    ircp::Writer<ircp::StatusSample>* status = writers_.back().get();
    auto reader = bus.MakeReaderOn<ircp::CommandSample>(
        ircp::CommandTopic(program),
        [this, program, status](const ircp::CommandSample& command, const ircp::Reception&) {
          story.push_back(program + " " + command.action);
          commands.push_back(command);
          ircp::StatusSample answer;
          answer.program = program;
          answer.state = "ready";
          answer.request_id = command.request_id;
          answer.ok = command.action != refuse;
          if (!answer.ok) answer.detail = "I will not " + command.action;
          EXPECT_TRUE(status->Write(answer).ok());
        });
    readers_.push_back(std::move(*reader));
  }

  std::vector<std::unique_ptr<ircp::Writer<ircp::StatusSample>>> writers_;
  std::vector<std::unique_ptr<ircp::Reader>> readers_;
};

}  // namespace exemplar::capture_suit::testing
