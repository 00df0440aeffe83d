#pragma once
// Keys of StatusSample::values that one program writes and another reads.

namespace exemplar::ircp {

/// Of the executor, while a teleoperated robot moves: the stamp, in nanoseconds, of the ircp/safety
/// sample that pressed the dead-man, as its writer gave it. So whoever pressed knows which press is
/// answered, whatever the clocks of the two machines say.
inline constexpr const char* kAnsweredPress = "answered_press_ns";

}  // namespace exemplar::ircp
