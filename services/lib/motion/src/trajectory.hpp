#pragma once
// A joint trajectory as the collision checker sees it.

#include <Eigen/Core>

#include "exemplar/collision/scene.hpp"
#include "exemplar/kinematics/chain.hpp"
#include "exemplar/motion/plan.hpp"

namespace exemplar::motion {

/// Keeps references to its arguments.
class TrajectoryPath final : public collision::JointPath {
 public:
  TrajectoryPath(const JointTrajectory& trajectory, const kinematics::RobotModel& model,
                 const kinematics::Chain& chain);
  void Position(double s, Eigen::Ref<Eigen::VectorXd> q) const override;
  void Travel(double s0, double s1, Eigen::Ref<Eigen::VectorXd> travel) const override;

 private:
  double TravelWithin(Eigen::Index piece, Eigen::Index joint, double begin_s, double end_s) const;
  /// Of the opening, from the first frame.
  double HandTravelTo(double time_s) const;

  const JointTrajectory& trajectory_;
  const kinematics::RobotModel& model_;
  const kinematics::Chain& chain_;
  Eigen::VectorXd others_;           ///< the model's joints, those of the chain at 0
  Eigen::MatrixXd travel_;           ///< frames x joints: from the first frame
  std::vector<double> hand_travel_;  ///< likewise of the opening; empty: the hand stays open
  mutable Eigen::VectorXd position_, velocity_;
};

}  // namespace exemplar::motion
