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

/// Every default works without a person's help (PAPER.md claim 1). Set on the command line as
/// `--option name=value`, names as below.
struct LearnOptions {
  Method method = Method::kAuto;
  Selection selection = Selection::kJoint;
  EpisodeRule rule = EpisodeRule::kTwitch;
  ForceRate force_rate = ForceRate::kAbsolute;
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
