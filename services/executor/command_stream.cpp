#include "executor/command_stream.hpp"

#include <utility>

#include "executor/realtime.hpp"

namespace exemplar::executor {

namespace {
constexpr std::uint64_t kEnd = std::uint64_t{1} << 63;
constexpr int kWritingPriority = 35;
constexpr Duration kGoodbye = std::chrono::seconds(1);
}  // namespace

CommandStream::CommandStream(std::unique_ptr<ircp::Writer<ircp::JointCommandSample>> writer,
                             std::vector<std::string> joint_names, Duration validity, bool realtime)
    : writer_(std::move(writer)),
      joint_names_(std::move(joint_names)),
      validity_(validity),
      thread_([this, realtime] { Run(realtime); }) {}

CommandStream::~CommandStream() {
  put_.fetch_or(kEnd, std::memory_order_release);
  put_.notify_one();
  thread_.join();
  writer_->WaitForAcknowledgments(kGoodbye);
}

bool CommandStream::Put(const Setpoint& setpoint) {
  const std::uint64_t at = put_.load(std::memory_order_relaxed);
  if (at - taken_.load(std::memory_order_acquire) >= kCapacity) {
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }
  ring_[at % kCapacity] = setpoint;
  put_.store(at + 1, std::memory_order_release);
  put_.notify_one();
  return true;
}

void CommandStream::Flush() const {
  const std::uint64_t goal = put_.load(std::memory_order_acquire) & ~kEnd;
  for (std::uint64_t taken = taken_.load(std::memory_order_acquire); taken < goal;
       taken = taken_.load(std::memory_order_acquire)) {
    taken_.wait(taken, std::memory_order_acquire);
  }
}

void CommandStream::Run(bool realtime) {
  if (realtime) (void)RaisePriority(kWritingPriority);  // the control loop says when it is not
  ircp::JointCommandSample sample;
  sample.names = joint_names_;
  sample.positions.resize(joint_names_.size());
  sample.velocities.resize(joint_names_.size());
  sample.validity = validity_;
  for (std::uint64_t next = 0;; ++next) {
    std::uint64_t put = put_.load(std::memory_order_acquire);
    while ((put & ~kEnd) == next) {
      if ((put & kEnd) != 0) return;
      put_.wait(put, std::memory_order_acquire);
      put = put_.load(std::memory_order_acquire);
    }
    const Setpoint& setpoint = ring_[next % kCapacity];
    for (std::size_t j = 0; j < joint_names_.size(); ++j) {
      sample.positions[j] = setpoint.positions[j];
      sample.velocities[j] = setpoint.velocities[j];
    }
    sample.has_hand_open = setpoint.hand_open >= 0;
    sample.hand_open = sample.has_hand_open ? setpoint.hand_open : 0;
    std::atomic<std::uint64_t>& count = writer_->Write(sample).ok() ? sent_ : failed_;
    count.fetch_add(1, std::memory_order_release);
    taken_.store(next + 1, std::memory_order_release);
    taken_.notify_all();
  }
}

}  // namespace exemplar::executor
