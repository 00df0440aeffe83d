#pragma once
// Trials on one time base, and warped onto common marker times: what segmentation and alignment
// hand to interpolation.

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/demonstration/tool_kinematics.hpp"
#include "exemplar/demonstration/trial.hpp"
#include "exemplar/learning/options.hpp"
#include "exemplar/learning/pose_path.hpp"

namespace exemplar::learning {

/// A trial filtered and resampled onto a uniform time base. n frames.
struct UniformTrial {
  std::string id;                        ///< trial id, or source where it has none
  std::vector<double> time_s;            ///< n, from 0
  std::vector<std::string> joint_names;  ///< may be empty
  Eigen::MatrixXd joints;                ///< n x joints (or n x 0)
  std::vector<geometry::Pose>
      base_T_tool;  ///< n, or empty: measured, else from joints by ToolKinematics
  bool has_orientation = true;
  std::vector<double> hand_open;  ///< n, or empty
  Eigen::VectorXd touch_n;        ///< n, summed over sensors; empty without touch
  std::vector<std::string> object_names;
  std::vector<PosePath> base_T_object;  ///< [object][frame]
  std::vector<bool> object_has_orientation;
  double cutoff_hz = 0;            ///< low-pass of the motion; 0: none was needed
  std::vector<std::string> notes;  ///< cut-off chosen, repairs
};

enum class MarkerKind { kBeginning, kEnding };

/// A candidate episode boundary.
struct Marker {
  double time_s = 0;
  int frame = 0;  ///< of the uniform time base
  MarkerKind kind = MarkerKind::kBeginning;
  std::string cause;  ///< "motion", "touch onset", "touch release", "first sample", "orientation",
                      ///< "extremum of <joint>", ...
  double score = 0;   ///< how clearly the episode stands out: peak MSV over k c
};

/// Eqs. 1 to 4 on one trial.
struct Segmentation {
  Eigen::VectorXd msv;         ///< Eq. 1 or 2, one a frame
  Eigen::VectorXd touch_term;  ///< c_tactile dw/dt (or its absolute value), or empty
  double c = 0;                ///< low-motion cut-off, Eq. 3
  double k = 0;                ///< ratio of high to low motion, Eq. 4
  /// Of threshold=local, one a frame: c and c k there (c and k above are the whole trial's); else
  /// empty.
  Eigen::VectorXd c_along;
  Eigen::VectorXd high_along;
  double c_tactile = 0;
  bool c_replaced = false;      ///< Eq. 3 was not positive; c came from the data
  std::vector<Marker> markers;  ///< beginnings and endings, in time order
};

/// One trial's part in the alignment.
struct AlignedTrial {
  std::string id;
  UniformTrial own;  ///< on its own time
  Segmentation segmentation;
  std::vector<int> chosen;  ///< indices of the chosen beginnings within segmentation.markers
  /// First sample, chosen markers, last sample; of alignment=elastic, as many as its grid has.
  std::vector<double> own_knots_s;
};

struct Alignment {
  std::vector<double> time_s;   ///< the common time base, N frames from 0
  std::vector<double> knots_s;  ///< means of the trials' own_knots_s, on the common time base
  /// Mean times of the chosen markers with start and end on the common time base: the knots, but
  /// for alignment=elastic.
  std::vector<double> markers_s;
  std::vector<AlignedTrial> trials;
  Eigen::MatrixXd canonical_joints;  ///< mean of the warped trials, N x joints (or N x 0)
  Eigen::MatrixXd canonical_tool;    ///< N x 3 (or 0 x 3)
  double mean_correlation = 0;       ///< over pairs, after alignment
  double plain_correlation = 0;      ///< over pairs, length-normalised only
  /// Of selection=joint: the sum of r over pairs that the choice reached, and what none can exceed.
  double choice_value = 0;
  double choice_bound = 0;
  std::vector<std::string> warnings;  ///< names of trials that drag N_min down, have no marker, ...
};

/// All streams of a trial on the common time base, by the trial's own warp. Made at each call: what
/// can be made again is not kept.
UniformTrial Warped(const Alignment& alignment, std::size_t trial);

using Progress = std::function<void(double fraction, std::string_view step)>;

/// Filter and resample (PAPER.md section 2, reading). `tool` may be null when trials have poses.
Result<UniformTrial> Prepare(const demonstration::Trial& trial, const LearnOptions& options,
                             const demonstration::ToolKinematics* tool);

/// Section 3.
Segmentation Segment(const UniformTrial& trial, const LearnOptions& options);

/// Section 4: marker choice, warps, canonical motion. Precondition: at least one trial, all with
/// the same joints and the same streams (LearnSkill checks).
Result<Alignment> Align(std::vector<UniformTrial> trials, const LearnOptions& options,
                        const Progress& progress = {}, std::stop_token stop = {});

}  // namespace exemplar::learning
