#pragma once
// Samples back into a trial: what the learning service makes of a recording.

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/demonstration/trial.hpp"
#include "exemplar/ircp/samples.hpp"

namespace exemplar::ircp {

/// Gathers one trial's samples, in any order. Joints come from ircp/suit and touch from
/// ircp/tactile. Only where the recording holds neither a suit nor a tool pose was a robot itself
/// the demonstrator: then joints, and touch if there is no other, come from ircp/joint_state (else
/// the robot merely stood by). Beside a suit, ircp/joint_state gives the measured joints. Hands and
/// objects keep the order in which they were first seen. Thread-compatible.
class TrialBuilder {
 public:
  void Add(const SuitSample& sample);
  void Add(const EndEffectorSample& sample);
  void Add(const TactileSample& sample);
  void Add(const ObjectSample& sample);
  void Add(const JointStateSample& sample);

  /// Every stream sorted by stamp, repeated stamps dropped with a notice; time_s counts from the
  /// earliest stamp. An error when there is neither a joint nor a tool pose, or the result breaks
  /// an invariant of Trial.
  Result<demonstration::Trial> Build(std::string source) const;

 private:
  using Row = std::vector<double>;
  /// Rows of one sender; all have its first sample's channel names.
  struct Rows {
    std::vector<std::string> names;
    std::vector<std::pair<Stamp, Row>> rows;
    int other_names = 0;  ///< samples left out because their names differ
  };
  struct Poses {
    std::size_t order = 0;  ///< how many others were seen first
    std::vector<std::pair<Stamp, geometry::Pose>> poses;
    bool has_orientation = true;
  };

  static Poses& FindOrAdd(std::map<std::string, Poses>& named, const std::string& name);
  static void Gather(std::map<std::string, Rows>& senders, const Header& header,
                     const std::vector<std::string>& names, const Row& values);

  std::map<std::string, Rows> suits_, tactile_, states_, touches_;  ///< by source
  std::map<std::string, Poses> hands_, objects_;                    ///< by name
  std::map<std::string, Rows> openings_;                            ///< by hand
  Rows wrench_, label_;
};

}  // namespace exemplar::ircp
