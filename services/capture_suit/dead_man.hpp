#pragma once
// The dead-man switch of whoever wears the suit, on ircp/safety, and what comes of it.

#include <atomic>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/bus.hpp"

namespace exemplar::capture_suit {

/// Says 50 times a second whether the switch is held; it is released at first, and when this goes.
/// One thread says it, and what is done at a moment it says after that moment, so that in simulated
/// time no order of threads decides what is sent.
/// Thread-safe.
class DeadMan {
 public:
  static Result<std::unique_ptr<DeadMan>> Create(ircp::Bus& bus, const Clock& clock);
  ~DeadMan();

  /// Releases; then GoOnPressing, called again and again on the same thread, presses after half a
  /// second, and anew until a robot answers. What has answered once is never pressed anew.
  void BeginToPress();
  void GoOnPressing();
  void Release() { Set(false); }
  /// Whether the executor says that the robot follows since the last press: what it said of an
  /// earlier one, perhaps of somebody before us, is history.
  bool followed() const { return followed_.load(); }
  ircp::TopicCount sent() const;

 private:
  DeadMan(const Clock& clock, std::unique_ptr<ircp::Writer<ircp::SafetySample>> writer);
  void Set(bool held);
  void Hear(const ircp::StatusSample& status);
  bool held() const;
  bool HeldUntilNow() const;  ///< before what was done at this very moment
  void Write(bool held);
  void Run(const std::stop_token& stop);

  const Clock& clock_;
  std::unique_ptr<ircp::Writer<ircp::SafetySample>> writer_;
  mutable std::mutex mutex_;
  bool held_ = false;
  bool held_before_ = false;  ///< until turned_
  Duration turned_{-1};
  Stamp pressed_;  ///< when it was held last
  std::atomic<bool> followed_{false};
  std::atomic<bool> answered_{false};  ///< the robot followed, or came to it, since BeginToPress
  Duration turn_at_{0};                ///< of the press or release that comes next
  std::unique_ptr<ircp::Reader> executor_;
  std::jthread thread_;
};

}  // namespace exemplar::capture_suit
