#pragma once
// What people look at to understand a skill: the numbers behind the paper's Figs. 4 to 14
// (PAPER.md section 7). Pure functions on values.

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/learning/aligned.hpp"
#include "exemplar/learning/objectivity.hpp"
#include "exemplar/learning/skill.hpp"

namespace exemplar::learning {

// ---- from the alignment alone -------------------------------------------------------------------

/// The trials on the alignment's common time base, normalised in length only: what the markers
/// improve upon (section 4, Fig. 4).
std::vector<UniformTrial> LengthNormalised(const Alignment& alignment);

/// MSV of the tool on each trial's own time base (m^2/s^2), as Fig. 8 has it; of the joints
/// (rad^2/s^2) where there is no tool. One vector a trial.
std::vector<Eigen::VectorXd> ToolMsv(const Alignment& alignment);

/// Series on the trials' own time bases, brought onto the common one: by the chosen markers, or in
/// length only. Columns are trials. Precondition: one series a trial, a value a frame of its own.
Eigen::MatrixXd WarpSeries(const Alignment& alignment, const std::vector<Eigen::VectorXd>& own,
                           bool by_markers);

// ---- from the whole skill -----------------------------------------------------------------------

/// What the methods answer for one place of the target. Paths are frames x 3 (m, base frame).
struct InspectedQuery {
  geometry::Pose base_T_target;
  Eigen::Vector3d base_p_contact = Eigen::Vector3d::Zero();
  Eigen::MatrixXd absolute;   ///< FK of the joint-wise RBF; without joints the RBF on paths
  Eigen::MatrixXd objective;  ///< RBF on paths in the target's shifted frame
  Eigen::MatrixXd blended;    ///< the paper's answer
  Eigen::MatrixXd answer;     ///< what this skill answers, by its chosen method
};

/// Distance (m) of the tool at contact from the mean point at which the trials touch the target,
/// over the target's place. Rows are y, columns x. The answer's contact is that of its own
/// alignment.
struct ContactErrorMap {
  std::vector<double> x_m, y_m;
  double z_m = 0;            ///< the trials' mean
  Eigen::MatrixXd absolute;  ///< as InspectedQuery::absolute
  Eigen::MatrixXd blended;
  Eigen::MatrixXd answer;
};

/// All that needs the robot model or the fitted methods. The parts on paths hold the trials as the
/// paper's method has them: aligned by markers, objects shifted and not turned.
struct Inspection {
  std::string obstacle;         ///< why there are no paths in the target's frame; else empty
  bool through_joints = false;  ///< the absolute solution comes through joints
  std::vector<Eigen::MatrixXd> base_paths;    ///< frames x 3, one a trial; empty without a tool
  std::vector<Eigen::MatrixXd> object_paths;  ///< relative to the target; empty without target
  std::vector<geometry::Pose> base_T_target;  ///< one a trial
  Objectivity objectivity;                    ///< towards the target
  struct Window {
    int first = 0;
    int last = 0;
  };
  std::vector<Window> contacts;  ///< with the target, in time order
  int contact_frame = 0;  ///< of the first contact; without one, where objectivity is highest
  bool contact_found = false;
  std::optional<InspectedQuery> query;  ///< at a place that no trial had
  std::optional<ContactErrorMap> map;
};

struct InspectOptions {
  int map_columns = 33;
  int map_rows = 27;
  double map_margin = 0.35;  ///< around the trials' places, as a part of their extent
};
Inspection Inspect(const Skill& skill, const InspectOptions& options = {});

/// The paths for the target at `position`, turned as the trials' mean. nullopt where
/// Inspection::obstacle says why.
std::optional<InspectedQuery> InspectAt(const Skill& skill, const Eigen::Vector3d& position);

nlohmann::json ToJson(const Inspection& inspection);
Result<Inspection> InspectionFromJson(const nlohmann::json& json);

}  // namespace exemplar::learning
