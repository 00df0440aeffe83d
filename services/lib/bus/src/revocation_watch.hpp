#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

namespace exemplar::bus {

/// Looks at a member's revocation list again and again: Fast DDS 2.9 reads it when a participant is
/// made, and never after.
class RevocationWatch {
 public:
  struct Options {
    std::filesystem::path list;
    /// Called once, on the watch's thread, with the first serial number that stands on the list and
    /// did not when the watch was made.
    std::function<void(const std::string& serial)> on_revoked;
    /// Called each day, likewise: time to look at what ends by itself. May be null.
    std::function<void()> on_day = nullptr;
    std::chrono::milliseconds period = std::chrono::seconds(1);
    std::chrono::milliseconds day = std::chrono::hours(24);
  };
  /// A list that cannot be read is taken for the one before it.
  explicit RevocationWatch(Options options);

 private:
  std::jthread thread_;
};

/// Asks this process to end, as `kill` would.
void EndProcess();

}  // namespace exemplar::bus
