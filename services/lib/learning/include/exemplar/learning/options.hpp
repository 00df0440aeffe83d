#pragma once
#include <map>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::learning {

enum class Method {
  kAuto,    ///< the better of the others by leave-one-trial-out error inside the training set
  kPaper,   ///< the paper to the letter: RBF with affine trend, translation-only object frame,
            ///< variances
  kFrames,  ///< frames that turn with the object and the start, chosen per episode; see
            ///< DECISIONS.md
};
/// The paper's rule; the best joint choice. Where candidates are few and one trial's do not match
/// (rail_pressing, user 3) votes are cast for markers that cannot go together: r of the aligned
/// trials .49, jointly .84; elsewhere on the real trials both agree.
enum class Selection { kVote, kJoint };
enum class EpisodeRule { kTwitch, kLiteral };
enum class ForceRate { kAbsolute, kSigned };
/// c and k of the whole trial (Eqs. 3, 4), or of the stretch around each moment, so that a slow
/// episode beside a fast one keeps thresholds of its own (the paper's future work, section 3.1).
enum class ThresholdRule { kTrial, kLocal };
/// Onto the mean times of the chosen markers (section 4), or all along the motion: elastic
/// registration of the joints' (without joints, the tool's) curves by their square-root velocity
/// functions.
enum class AlignmentRule { kMarkers, kElastic };
/// The demonstrator's joints, or those that the robot measured while it followed (section 3.1).
enum class JointSource { kSuit, kMeasured };
/// Further causes of candidates (section 3.1).
struct Cues {
  bool orientation = false;  ///< the tool begins to turn, by Eqs. 3 and 4 on its angular speed
  bool extrema = false;      ///< a joint turns back; without joints, a coordinate of the tool
  friend bool operator==(const Cues&, const Cues&) = default;
};

/// Every default works without a person's help (PAPER.md claim 1). Set on the command line as
/// `--option name=value`, names as below.
struct LearnOptions {
  Method method = Method::kAuto;
  Selection selection = Selection::kJoint;
  EpisodeRule rule = EpisodeRule::kTwitch;
  ForceRate force_rate = ForceRate::kAbsolute;
  JointSource joints = JointSource::kSuit;
  AlignmentRule alignment = AlignmentRule::kMarkers;
  ThresholdRule threshold = ThresholdRule::kTrial;
  Cues cues = {};              ///< `cues=orientation,extrema`
  std::string target = {};     ///< name of the object the skill is about; empty: the only one
  double sample_rate_hz = 60;  ///< of the learner's time base
  double cutoff_hz = 0;        ///< low-pass; 0: chosen from the data, and reported
  int frames = 0;              ///< of the canonical motion; 0: mean duration times sample rate
  std::vector<std::string> leave_out = {};  ///< trials not used, by id or source

  /// Errors name the option, its value and what is allowed; a mistyped name gets the nearest one.
  /// method=paper brings selection=vote and force_rate=signed with it, unless they are given.
  static Result<LearnOptions> FromStrings(const std::map<std::string, std::string>& options);
  std::map<std::string, std::string> ToStrings() const;
};

}  // namespace exemplar::learning
