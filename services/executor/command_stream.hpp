#pragma once
// The way of joint commands out of the control loop: a ring, and a thread that writes.

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "exemplar/ircp/bus.hpp"

namespace exemplar::executor {

inline constexpr std::size_t kMaxJoints = 32;

/// One command, of fixed size.
struct Setpoint {
  std::array<double, kMaxJoints> positions{};
  std::array<double, kMaxJoints> velocities{};
  double hand_open = -1;  ///< from 0 (closed) to 1 (open); less: nothing is said of the hand
};

/// One producer. Put neither allocates nor waits.
class CommandStream {
 public:
  /// `validity`: for how long a command stands without another one. `realtime`: the writing thread
  /// goes before ordinary ones, where this is permitted.
  CommandStream(std::unique_ptr<ircp::Writer<ircp::JointCommandSample>> writer,
                std::vector<std::string> joint_names, Duration validity, bool realtime);
  /// Writes what is left, waits a little for its acknowledgment.
  ~CommandStream();

  /// False when the ring is full: the command is dropped and counted.
  bool Put(const Setpoint& setpoint);
  std::uint64_t sent() const { return sent_.load(std::memory_order_acquire); }
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }
  /// Writes that the network refused.
  std::uint64_t failed() const { return failed_.load(std::memory_order_relaxed); }
  int matched_readers() const { return writer_->matched_readers(); }
  /// Returns when everything put so far was written.
  void Flush() const;

 private:
  void Run(bool realtime);

  static constexpr std::size_t kCapacity = 256;
  std::unique_ptr<ircp::Writer<ircp::JointCommandSample>> writer_;
  std::vector<std::string> joint_names_;
  Duration validity_;
  std::array<Setpoint, kCapacity> ring_;
  std::atomic<std::uint64_t> put_{0};  ///< the top bit says that no more will come
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> sent_{0};
  std::atomic<std::uint64_t> failed_{0};
  std::thread thread_;  ///< last: begins when the rest stands
};

}  // namespace exemplar::executor
