// Whether a tool path can be reached at all, by brute force: many random postures a pose, each
// moved onto the pose by plain damped least squares and checked for collisions by MuJoCo, as the
// simulator's robot would collide. Shares no code with the executor's inverse kinematics, its
// search or its collision checks. Where links of the robot meet each other, only what overlaps
// collides: a posture is rather called clear than not.
//
//   workspace_judge --robot DIR                   prints the tool's pose at home
//   workspace_judge --robot DIR --scene FILE      reads poses from stdin, one a line:
//       WORD x y z qx qy qz qw                    WORD: touching, near or free

#include <mujoco/mujoco.h>

#include <Eigen/Dense>
#include <cmath>
#include <exception>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/motion/plan.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "simulator/mjcf_writer.hpp"
#include "simulator/world.hpp"

namespace exemplar {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

Vector6 ErrorTo(const geometry::Pose& goal, const geometry::Pose& now) {
  Vector6 error;
  const Eigen::AngleAxisd turn(goal.rotation * now.rotation.conjugate());
  const double angle =
      turn.angle() > std::numbers::pi ? turn.angle() - 2 * std::numbers::pi : turn.angle();
  error << goal.translation - now.translation, angle * turn.axis();
  return error;
}

Eigen::VectorXd RandomPosture(const kinematics::Chain& chain, Rng& rng) {
  Eigen::VectorXd q(chain.dof());
  for (int j = 0; j < chain.dof(); ++j) {
    const kinematics::JointLimits& limit = chain.limits()[static_cast<std::size_t>(j)];
    const bool bounded = std::isfinite(limit.lower) && std::isfinite(limit.upper);
    q[j] = bounded ? rng.Uniform(limit.lower, limit.upper)
                   : rng.Uniform(-std::numbers::pi, std::numbers::pi);
  }
  return q;
}

/// Moves `q` towards the pose, within the joints' limits.
bool Reach(const kinematics::Chain& chain, const geometry::Pose& goal, double position_m,
           double rotation_rad, Eigen::VectorXd& q) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(6, chain.dof());
  for (int step = 0; step < 120; ++step) {
    const Vector6 error = ErrorTo(goal, chain.ToolPoseAndJacobian(q, jacobian));
    if (error.head<3>().norm() <= position_m && error.tail<3>().norm() <= rotation_rad) return true;
    const double damping = 1e-6 + 0.05 * error.squaredNorm();
    const Eigen::Matrix<double, 6, 6> normal =
        jacobian * jacobian.transpose() + damping * Eigen::Matrix<double, 6, 6>::Identity();
    Eigen::VectorXd way = jacobian.transpose() * normal.ldlt().solve(error);
    way *= std::min(1.0, 0.4 / std::max(1e-12, way.cwiseAbs().maxCoeff()));
    q += way;
    for (int j = 0; j < chain.dof(); ++j) {
      const kinematics::JointLimits& limit = chain.limits()[static_cast<std::size_t>(j)];
      q[j] = std::min(std::max(q[j], limit.lower), limit.upper);
    }
  }
  return false;
}

/// The simulated robot in its scene, put into postures.
class Contacts {
 public:
  /// `clearance_m`: what is nearer to the scene than this touches it.
  Contacts(const simulator::World& world, const kinematics::RobotDescription& robot,
           const scene::Description& scene, double clearance_m)
      : model_(mj_copyModel(nullptr, world.model()), mj_deleteModel),
        data_(mj_makeData(model_.get()), mj_deleteData) {
    for (int geom = 0; geom < model_->ngeom; ++geom) model_->geom_margin[geom] = clearance_m;
    for (const std::string& joint : robot.chain.joint_names()) {
      const int id = mj_name2id(model_.get(), mjOBJ_JOINT, simulator::RobotJoint(joint).c_str());
      places_.push_back(model_->jnt_qposadr[id]);
    }
    const auto body = [this](const std::string& name) {
      return mj_name2id(model_.get(), mjOBJ_BODY, name.c_str());
    };
    for (const kinematics::Link& link : robot.model.links) {
      robot_.insert(body(simulator::LinkBody(link.name)));
    }
    for (const std::string& link : robot.touch_links) {
      touch_.insert(body(simulator::LinkBody(link)));
    }
    for (const scene::Button& button : scene.buttons) {
      buttons_.insert(body(simulator::ThingBody(button.name)));
      buttons_.insert(body(simulator::CapBody(button.name)));
    }
  }

  /// Whether the robot at `q` is clear of everything but, with `may_touch`, its touch links of the
  /// buttons.
  bool IsClear(const Eigen::VectorXd& q, bool may_touch) {
    for (std::size_t j = 0; j < places_.size(); ++j) {
      data_->qpos[places_[j]] = q[static_cast<Eigen::Index>(j)];
    }
    mj_kinematics(model_.get(), data_.get());
    mj_comPos(model_.get(), data_.get());
    mj_collision(model_.get(), data_.get());
    for (int i = 0; i < data_->ncon; ++i) {
      const mjContact& contact = data_->contact[i];
      const int a = model_->geom_bodyid[contact.geom1];
      const int b = model_->geom_bodyid[contact.geom2];
      const bool both = robot_.count(a) != 0 && robot_.count(b) != 0;
      if ((both && contact.dist >= 0) || (robot_.count(a) == 0 && robot_.count(b) == 0)) continue;
      const bool is_touch = (touch_.count(a) != 0 && buttons_.count(b) != 0) ||
                            (touch_.count(b) != 0 && buttons_.count(a) != 0);
      if (!(may_touch && is_touch)) return false;
    }
    return true;
  }

 private:
  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
  std::vector<int> places_;  ///< of the chain's joints within qpos
  std::set<int> robot_;      ///< bodies
  std::set<int> touch_;
  std::set<int> buttons_;
};

nlohmann::json ToJson(const geometry::Pose& pose) {
  const Eigen::Vector3d& p = pose.translation;
  const Eigen::Quaterniond& r = pose.rotation;
  return {p.x(), p.y(), p.z(), r.x(), r.y(), r.z(), r.w()};
}

struct Judged {
  int reached = 0;  ///< postures that hold the tool there
  int clear = 0;    ///< of these, clear of everything
};

int Judge(int argc, char** argv) {
  constexpr const char* kName = "workspace_judge";
  std::string robot_folder;
  std::string scene_file;
  int restarts = 2000;
  program::Options options(kName, "Judges by brute force whether tool poses can be reached",
                           "workspace_judge --robot deploy/models/arm7", {});
  options.Add("--robot", robot_folder, "folder with robot.yaml and the URDF").Required();
  options.Add("--scene", scene_file, "what stands around the robot; none: prints the home pose");
  options.Add("--restarts", restarts, "random postures a pose, until one is clear").MinMax(1, 1e6);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;

  const auto robot = kinematics::ReadRobotDescription(robot_folder);
  if (!robot) return program::Fail(kName, robot.error());
  if (scene_file.empty()) {
    std::cout << ToJson(robot->chain.ToolPose(robot->home)) << '\n';
    return 0;
  }
  const auto scene = scene::ReadDescription(scene_file);
  if (!scene) return program::Fail(kName, scene.error());
  const auto world = simulator::World::Create(*robot, *scene);
  if (!world) return program::Fail(kName, world.error());

  const motion::PlanOptions plan;  // for its tolerances
  Contacts contacts(*world, *robot, *scene, plan.required_clearance_m);
  Rng rng(1);
  nlohmann::json verdicts = nlohmann::json::array();
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream words(line);
    std::string where;
    Eigen::Matrix<double, 7, 1> n;
    words >> where;
    for (double& number : n) words >> number;
    if (!words) return options.Refuse("\"" + line + "\" is not a word and seven numbers");
    const geometry::Pose goal{n.head<3>(), Eigen::Quaterniond(n[6], n[3], n[4], n[5]).normalized()};
    const double position_m =
        where == "touching" ? plan.position_tolerance_m : plan.free_tolerance_m;
    Judged judged;
    for (int i = 0; i < restarts && judged.clear == 0; ++i) {
      Eigen::VectorXd q = RandomPosture(robot->chain, rng);
      if (!Reach(robot->chain, goal, position_m, plan.rotation_tolerance_rad, q)) continue;
      ++judged.reached;
      if (contacts.IsClear(q, where != "free")) ++judged.clear;
    }
    verdicts.push_back({{"reached", judged.reached}, {"clear", judged.clear}});
  }
  std::cout << verdicts << '\n';
  return 0;
}

}  // namespace
}  // namespace exemplar

int main(int argc, char** argv) {
  try {
    return exemplar::Judge(argc, argv);
  } catch (const std::exception& failure) {
    std::cerr << "workspace_judge: " << failure.what() << '\n';
    return 1;
  }
}
