#pragma once
// The invariants of samples, checked where they enter: before a write and after a decode.

#include "exemplar/base/result.hpp"
#include "exemplar/ircp/samples.hpp"

namespace exemplar::ircp {

/// Longest source, object or hand name in bytes; these are the keys of instances.
inline constexpr std::size_t kMaxKeyBytes = 255;

/// Lists that belong together have one length, every number is finite, orientations are of unit
/// length, keys are neither empty nor longer than kMaxKeyBytes. The error names field and value:
/// `positions[3] ("elbow"): nan is not a finite number`.
Status Check(const SuitSample& sample);
Status Check(const EndEffectorSample& sample);
Status Check(const TactileSample& sample);
Status Check(const CameraSample& sample);
Status Check(const ObjectSample& sample);
Status Check(const JointStateSample& sample);
Status Check(const JointCommandSample& sample);
Status Check(const PlanSample& sample);
Status Check(const CommandSample& sample);
Status Check(const StatusSample& sample);
Status Check(const SafetySample& sample);
Status Check(const ClockSample& sample);

}  // namespace exemplar::ircp
