#pragma once
// A trial as the samples that capture programs would have sent: what a replay publishes.

#include <string>
#include <variant>
#include <vector>

#include "exemplar/demonstration/trial.hpp"
#include "exemplar/ircp/samples.hpp"

namespace exemplar::ircp {

/// What a trial is made of on the network.
using TrialSample = std::variant<SuitSample, EndEffectorSample, TactileSample, ObjectSample>;

struct TrialSamples {
  /// In order of header.stamp; sources and sequence numbers are left to the writers.
  std::vector<TrialSample> samples;
};

/// Every sample of every stream, stamped `start` + time_s to the nanosecond; hand opening, wrench
/// and labels at times without a tool pose go out as end effector samples without one.
/// TrialBuilder makes the same trial of them again. Objects are in frame `base_frame`.
TrialSamples SamplesOf(const demonstration::Trial& trial, Stamp start,
                       const std::string& base_frame = "base");

/// The stamp of a sample, whatever its type.
Stamp StampOf(const TrialSample& sample);

}  // namespace exemplar::ircp
