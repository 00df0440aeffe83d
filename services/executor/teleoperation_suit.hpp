#pragma once
// What a suit says, as postures that a robot is asked for.

#include <array>
#include <atomic>
#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "executor/command_stream.hpp"
#include "executor/teleoperation_map.hpp"
#include "exemplar/ircp/samples.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::executor {

/// What can be wrong with a sample that came in time.
enum class SuitFault {
  kNone,
  kUnknown,    ///< not one of its joints drives one of the robot's
  kNotFinite,  ///< `joint` was asked for a position that is none
  kJump,       ///< `joint` was asked to be `way` away from where the sample before asked it to be
};

/// One sample, on the robot's joints. Of fixed size.
struct SuitPosture {
  std::array<double, kMaxJoints> positions{};
  std::array<double, kMaxJoints> velocities{};  ///< as the last few samples changed
  std::bitset<kMaxJoints> driven;               ///< by the suit; the others' values mean nothing
  Duration received{0};                         ///< steady time
  Duration interval{0};                         ///< between samples, of late; 0: the first one
  SuitFault fault = SuitFault::kNone;
  int joint = 0;
  double way = 0;
};

struct SuitLimits {
  /// Samples that come so much later than the quickest did, by their stamps, are left out: what a
  /// network brings after a cut is history.
  Duration lateness = std::chrono::milliseconds(150);
  /// A joint may be asked to move by this many times its speed limit, and so much besides, between
  /// two samples; more is a jump.
  double jump_factor = 3;
  double jump_margin_rad = 0.15;
};

/// The samples of one suit: the one named, or the first that is heard. Take belongs to one thread,
/// and does not allocate while the suit's joints stay the same; the rest is thread-safe.
class SuitIntake {
 public:
  SuitIntake(JointMap map, std::vector<kinematics::JointLimits> limits,
             const SuitLimits& suit_limits = {});

  /// Begins anew: follows `suit`, or whoever is heard first where that is empty. Not beside Take.
  void Begin(const std::string& suit);
  /// The next sample in the order of reception; `writer`: its identity on the network. nullopt
  /// where it is left out: of another suit, late, or a repetition.
  std::optional<SuitPosture> Take(const ircp::SuitSample& sample, std::string_view writer,
                                  Duration steady);
  /// The lateness of what comes next is judged against what comes from now on.
  void ForgetDelay() { forget_delay_.store(true, std::memory_order_relaxed); }

  std::uint64_t taken() const { return taken_.load(std::memory_order_relaxed); }
  std::uint64_t left_out() const { return left_out_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kKept = 3;  ///< samples, for the velocity
  struct Kept {
    std::array<double, kMaxJoints> positions{};
    Duration received{0};
    Duration stamp{0};
  };
  bool IsMine(const ircp::SuitSample& sample, std::string_view writer);
  bool IsLate(Duration stamp, Duration steady);
  void Map(const ircp::SuitSample& sample, SuitPosture& posture) const;
  void FindJump(SuitPosture& posture) const;
  void AddVelocity(SuitPosture& posture) const;
  void Keep(const SuitPosture& posture, Duration stamp);
  const Kept& kept(std::size_t back) const { return kept_[(next_ + kKept - 1 - back) % kKept]; }

  const JointMap map_;
  const std::vector<kinematics::JointLimits> limits_;
  const SuitLimits suit_limits_;
  std::vector<std::string> names_;  ///< that bindings_ were made for
  std::vector<JointMap::Binding> bindings_;
  std::string suit_;    ///< wanted, or heard first
  std::string writer_;  ///< of the first sample
  std::array<Kept, kKept> kept_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;  ///< of those kept
  std::optional<Duration> least_delay_;
  Duration last_stamp_{0};
  std::atomic<bool> forget_delay_{false};
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<std::uint64_t> left_out_{0};
};

}  // namespace exemplar::executor
