#include "simulator/world.hpp"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "simulator/mjcf_writer.hpp"
#include "simulator/mujoco_rows.hpp"

namespace exemplar::simulator {
namespace {

struct ModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
struct DataDeleter {
  void operator()(mjData* data) const { mj_deleteData(data); }
};
struct VfsDeleter {
  void operator()(mjVFS* vfs) const {
    mj_deleteVFS(vfs);
    delete vfs;
  }
};
using ModelPtr = std::unique_ptr<mjModel, ModelDeleter>;
using DataPtr = std::unique_ptr<mjData, DataDeleter>;

/// Overlap that still counts as placed beside the robot, not in it.
constexpr double kAllowedOverlap = 1e-3;
/// Likewise of a movable object in another thing: it is pushed out that far without a leap.
constexpr double kAllowedSink = 2e-3;

Result<ModelPtr> Load(const std::string& mjcf) {
  // MuJoCo writes warnings to a file in the working folder unless somebody takes them; World counts
  // what matters in mjData::warning.
  mju_user_warning = [](const char*) {};
  std::unique_ptr<mjVFS, VfsDeleter> vfs(new mjVFS);  // 2 MB: not for the stack
  mj_defaultVFS(vfs.get());
  const char* name = "world.xml";
  if (mj_makeEmptyFileVFS(vfs.get(), name, static_cast<int>(mjcf.size())) != 0) {
    return Internal("simulator: the world's description has no place in memory");
  }
  std::memcpy(vfs->filedata[mj_findFileVFS(vfs.get(), name)], mjcf.data(), mjcf.size());
  char message[1000] = "";
  ModelPtr model(mj_loadXML(name, vfs.get(), message, sizeof message));
  if (!model)
    return InvalidArgument(std::string("simulator: MuJoCo refuses the world: ") + message);
  return model;
}

int BodyId(const mjModel& model, const std::string& name) {
  return mj_name2id(&model, mjOBJ_BODY, name.c_str());
}

geometry::Pose BodyPose(const mjData& data, int body) {
  const mjtNum* p = Row(data.xpos, 3, body);
  const mjtNum* q = Row(data.xquat, 4, body);
  return {{p[0], p[1], p[2]}, Eigen::Quaterniond(q[0], q[1], q[2], q[3])};
}

Error NoSuchThing(std::string_view thing) {
  return NotFound("there is no \"" + std::string(thing) + "\" in the scene", "object");
}

/// A servo-driven joint of the chain.
struct Drive {
  int qpos = 0;
  int dof = 0;
  int actuator = 0;
  double effort = 0;
  double stiffness = 0;
  double damping = 0;
};

struct ButtonParts {
  std::string name;
  ButtonMechanism mechanism;
  int body = 0;
  int qpos = 0;
  bool armed = true;
  std::uint64_t clicks = 0;
  Duration last_click{0};
};

/// A button on a rail.
struct Cart {
  int body = 0;
  int mocap = 0;
  scene::Rail rail;
  Eigen::Vector3d base_p_start;
  Duration begin{0};
};

/// A hand's joint on its way to where it is told to be.
struct HandDrive {
  kinematics::Hand hand;
  Drive drive;
  double speed = 0;
  double target = 0;  ///< of the joint
};

Drive MakeDrive(const mjModel& model, const kinematics::Joint& joint) {
  const std::string name = RobotJoint(joint.name);
  const int id = mj_name2id(&model, mjOBJ_JOINT, name.c_str());
  const int actuator = mj_name2id(&model, mjOBJ_ACTUATOR, name.c_str());
  return {.qpos = model.jnt_qposadr[id],
          .dof = model.jnt_dofadr[id],
          .actuator = actuator,
          .effort = joint.limits.effort,
          .stiffness = Row(model.actuator_gainprm, mjNGAIN, actuator)[0],
          .damping = -Row(model.actuator_biasprm, mjNBIAS, actuator)[2]};
}

}  // namespace

struct World::Impl {
  ModelPtr model;
  DataPtr data;
  WorldOptions options;
  std::vector<Drive> chain;    ///< by chain joint
  std::vector<Drive> drives;   ///< all of them
  std::vector<bool> is_robot;  ///< by body
  std::vector<bool> is_touch;  ///< by body
  std::vector<std::string> link_names;
  std::vector<ButtonParts> buttons;
  std::vector<Cart> carts;
  std::optional<HandDrive> hand;
  std::vector<std::pair<std::string, int>> things;  ///< buttons and objects, with their bodies
  std::int64_t steps = 0;

  Duration Now() const { return steps * options.step; }

  /// Sets joints to `home` and every servo to hold it.
  void PutAt(const kinematics::RobotModel& robot, const Eigen::VectorXd& by_joint) {
    for (std::size_t j = 0; j < robot.joints.size(); ++j) {
      const kinematics::Joint& joint = robot.joints[j];
      if (joint.type == kinematics::JointType::kFixed) continue;
      double q = by_joint[static_cast<Eigen::Index>(j)];
      if (joint.mimic) {
        q = joint.mimic->multiplier * by_joint[joint.mimic->joint] + joint.mimic->offset;
      }
      const int id = mj_name2id(model.get(), mjOBJ_JOINT, RobotJoint(joint.name).c_str());
      data->qpos[model->jnt_qposadr[id]] = q;
      if (joint.mimic) continue;
      drives.push_back(MakeDrive(*model, joint));
      data->ctrl[drives.back().actuator] = q;
    }
  }

  /// Pairs of links that overlap as the robot stands now.
  std::set<std::pair<std::string, std::string>> Overlaps() const {
    std::set<std::pair<std::string, std::string>> pairs;
    for (int i = 0; i < data->ncon; ++i) {
      const int a = model->geom_bodyid[data->contact[i].geom1];
      const int b = model->geom_bodyid[data->contact[i].geom2];
      if (!is_robot[static_cast<std::size_t>(a)] || !is_robot[static_cast<std::size_t>(b)])
        continue;
      pairs.emplace(link_names[static_cast<std::size_t>(std::min(a, b))],
                    link_names[static_cast<std::size_t>(std::max(a, b))]);
    }
    return pairs;
  }

  Status Build(const kinematics::RobotDescription& robot, const scene::Description& scene,
               const MjcfOptions& mjcf_options) {
    Result<std::string> mjcf = WriteMjcf(robot, scene, mjcf_options);
    if (!mjcf) return mjcf.error();
    Result<ModelPtr> loaded = Load(*mjcf);
    if (!loaded) return loaded.error();
    model = std::move(loaded).value();
    data.reset(mj_makeData(model.get()));
    if (!data) return Internal("simulator: no memory for the world's state");

    const std::size_t bodies = static_cast<std::size_t>(model->nbody);
    is_robot.assign(bodies, false);
    is_touch.assign(bodies, false);
    link_names.assign(bodies, {});
    for (const kinematics::Link& link : robot.model.links) {
      const std::size_t body = static_cast<std::size_t>(BodyId(*model, LinkBody(link.name)));
      is_robot[body] = true;
      link_names[body] = link.name;
      is_touch[body] = std::find(robot.touch_links.begin(), robot.touch_links.end(), link.name) !=
                       robot.touch_links.end();
    }
    drives.clear();
    PutAt(robot.model, kinematics::FullJointVector(robot.model, robot.chain, robot.home));
    chain.clear();
    for (const int j : robot.chain.joint_indices()) {
      chain.push_back(MakeDrive(*model, robot.model.joints[static_cast<std::size_t>(j)]));
    }
    hand.reset();
    if (robot.model.hand) {
      const kinematics::Joint& joint =
          robot.model.joints[static_cast<std::size_t>(robot.model.hand->joint)];
      hand = {*robot.model.hand, MakeDrive(*model, joint), joint.limits.velocity,
              robot.model.hand->open};
    }
    buttons.clear();
    carts.clear();
    things.clear();
    for (const scene::Button& button : scene.buttons) {
      ButtonParts parts;
      parts.name = button.name;
      parts.mechanism = MechanismOf(button);
      parts.body = BodyId(*model, ThingBody(button.name));
      const int joint = mj_name2id(model.get(), mjOBJ_JOINT, CapJoint(button.name).c_str());
      parts.qpos = model->jnt_qposadr[joint];
      if (button.rail) {
        carts.push_back({.body = parts.body,
                         .mocap = model->body_mocapid[parts.body],
                         .rail = *button.rail,
                         .base_p_start = button.base_T_object.translation});
      }
      things.emplace_back(button.name, parts.body);
      buttons.push_back(std::move(parts));
    }
    for (const scene::Object& object : scene.objects) {
      things.emplace_back(object.name, BodyId(*model, ThingBody(object.name)));
    }
    mj_forward(model.get(), data.get());
    return {};
  }

  /// Servo plus what gravity and speed ask for, together within the drive's effort.
  void CompensateBias() {
    for (const Drive& drive : drives) {
      const double bias = data->qfrc_bias[drive.dof];
      data->qfrc_applied[drive.dof] = bias;
      mjtNum* range = Row(model->actuator_forcerange, 2, drive.actuator);
      range[0] = -drive.effort - bias;
      range[1] = drive.effort - bias;
    }
  }

  void MoveHand() {
    if (!hand) return;
    mjtNum& told = data->ctrl[hand->drive.actuator];
    const double most = hand->speed * ToSeconds(options.step);
    told += std::clamp(hand->target - told, -most, most);
  }

  /// Where the first of a free body's positions stands, or -1.
  int FreePlace(int body) const {
    const int joint = model->body_jntadr[body];
    const bool is_free = joint >= 0 && model->jnt_type[joint] == mjJNT_FREE;
    return is_free ? model->jnt_qposadr[joint] : -1;
  }

  void MoveCarts() {
    for (const Cart& cart : carts) {
      const Eigen::Vector3d base_p_cart =
          cart.base_p_start +
          cart.rail.WayAt(ToSeconds(Now() - cart.begin)) * cart.rail.base_direction;
      std::copy_n(base_p_cart.data(), 3, Row(data->mocap_pos, 3, cart.mocap));
    }
  }

  void CountClicks() {
    for (ButtonParts& button : buttons) {
      const double depth = data->qpos[button.qpos];
      if (button.armed && depth >= button.mechanism.click_depth_m) {
        button.armed = false;
        ++button.clicks;
        button.last_click = Now();
      } else if (!button.armed && depth <= button.mechanism.release_depth_m) {
        button.armed = true;
      }
    }
  }

  /// Deepest overlap of contacts that `wanted(body1, body2)` accepts.
  template <class Wanted>
  double Deepest(Wanted&& wanted) const {
    double deepest = 0;
    for (int i = 0; i < data->ncon; ++i) {
      const mjContact& contact = data->contact[i];
      if (wanted(model->geom_bodyid[contact.geom1], model->geom_bodyid[contact.geom2])) {
        deepest = std::max(deepest, -contact.dist);
      }
    }
    return deepest;
  }
};

World::World(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

Result<World> World::Create(const kinematics::RobotDescription& robot,
                            const scene::Description& scene, const WorldOptions& options) {
  if (options.step <= Duration::zero() || options.step > std::chrono::milliseconds(10)) {
    return InvalidArgument("simulator step must be above 0 and at most 10 ms", "step");
  }
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  MjcfOptions mjcf_options;
  mjcf_options.step_s = ToSeconds(options.step);
  if (Status status = impl->Build(robot, scene, mjcf_options); !status) return status.error();
  const auto overlaps = impl->Overlaps();
  if (!overlaps.empty()) {
    mjcf_options.excluded_links.assign(overlaps.begin(), overlaps.end());
    if (Status status = impl->Build(robot, scene, mjcf_options); !status) return status.error();
  }
  return World(std::move(impl));
}

int World::dof() const { return static_cast<int>(impl_->chain.size()); }
Duration World::step() const { return impl_->options.step; }
Duration World::time() const { return impl_->Now(); }

void World::SetTarget(const Eigen::Ref<const Eigen::VectorXd>& positions,
                      const Eigen::Ref<const Eigen::VectorXd>& velocities) {
  for (std::size_t i = 0; i < impl_->chain.size(); ++i) {
    const Drive& drive = impl_->chain[i];
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    impl_->data->ctrl[drive.actuator] =
        positions[k] + drive.damping / drive.stiffness * velocities[k];
  }
}

void World::SetHand(double opening) {
  if (impl_->hand)
    impl_->hand->target = impl_->hand->hand.PositionAt(std::clamp(opening, 0.0, 1.0));
}

void World::Step() {
  impl_->MoveCarts();
  impl_->MoveHand();
  mj_step1(impl_->model.get(), impl_->data.get());
  impl_->CompensateBias();
  mj_step2(impl_->model.get(), impl_->data.get());
  ++impl_->steps;
  impl_->CountClicks();
}

void World::MoveTo(const Eigen::Ref<const Eigen::VectorXd>& positions) {
  for (std::size_t i = 0; i < impl_->chain.size(); ++i) {
    const Drive& drive = impl_->chain[i];
    impl_->data->qpos[drive.qpos] = positions[static_cast<Eigen::Index>(i)];
    impl_->data->qvel[drive.dof] = 0;
  }
  SetTarget(positions, Eigen::VectorXd::Zero(positions.size()));
  mj_forward(impl_->model.get(), impl_->data.get());
}

bool World::has_hand() const { return impl_->hand.has_value(); }

double World::hand_open() const {
  if (!impl_->hand) return 1;
  const HandDrive& hand = *impl_->hand;
  return std::clamp(hand.hand.OpeningAt(impl_->data->qpos[hand.drive.qpos]), 0.0, 1.0);
}

Eigen::VectorXd World::positions() const {
  Eigen::VectorXd q(dof());
  for (int i = 0; i < dof(); ++i) {
    q[i] = impl_->data->qpos[impl_->chain[static_cast<std::size_t>(i)].qpos];
  }
  return q;
}

Eigen::VectorXd World::velocities() const {
  Eigen::VectorXd v(dof());
  for (int i = 0; i < dof(); ++i) {
    v[i] = impl_->data->qvel[impl_->chain[static_cast<std::size_t>(i)].dof];
  }
  return v;
}

Eigen::VectorXd World::efforts() const {
  Eigen::VectorXd effort(dof());
  for (int i = 0; i < dof(); ++i) {
    const Drive& drive = impl_->chain[static_cast<std::size_t>(i)];
    effort[i] = impl_->data->actuator_force[drive.actuator] + impl_->data->qfrc_applied[drive.dof];
  }
  return effort;
}

geometry::Pose World::LinkPose(std::string_view link) const {
  const int body = BodyId(*impl_->model, LinkBody(std::string(link)));
  assert(body >= 0);
  return BodyPose(*impl_->data, body);
}

double World::touch_n() const {
  double sum = 0;
  const Impl& w = *impl_;
  for (int i = 0; i < w.data->ncon; ++i) {
    const mjContact& contact = w.data->contact[i];
    const std::size_t a = static_cast<std::size_t>(w.model->geom_bodyid[contact.geom1]);
    const std::size_t b = static_cast<std::size_t>(w.model->geom_bodyid[contact.geom2]);
    const bool touches = (w.is_touch[a] && !w.is_robot[b]) || (w.is_touch[b] && !w.is_robot[a]);
    if (!touches || contact.efc_address < 0) continue;
    mjtNum force[6];
    mj_contactForce(w.model.get(), w.data.get(), i, force);
    sum += force[0];
  }
  return sum;
}

double World::deepest_contact_m() const {
  const std::vector<bool>& is_robot = impl_->is_robot;
  return impl_->Deepest([&](int a, int b) {
    return is_robot[static_cast<std::size_t>(a)] || is_robot[static_cast<std::size_t>(b)];
  });
}

std::vector<ButtonState> World::buttons() const {
  std::vector<ButtonState> states;
  for (const ButtonParts& button : impl_->buttons) {
    const double depth = std::max(0.0, impl_->data->qpos[button.qpos]);
    states.push_back({.name = button.name,
                      .base_T_object = BodyPose(*impl_->data, button.body),
                      .depth_m = depth,
                      .spring_n = button.mechanism.Force(depth),
                      .clicks = button.clicks,
                      .last_click = button.last_click});
  }
  return states;
}

void World::ResetClicks() {
  for (ButtonParts& button : impl_->buttons) {
    button.clicks = 0;
    button.last_click = Duration(0);
  }
}

Status World::Place(std::string_view thing, const geometry::Pose& base_T_thing) {
  Impl& w = *impl_;
  const int body = BodyId(*w.model, ThingBody(std::string(thing)));
  if (body < 0) return NoSuchThing(thing);
  const int mocap = w.model->body_mocapid[body];
  const int place = w.FreePlace(body);
  mjtNum* position = place >= 0 ? w.data->qpos + place : Row(w.data->mocap_pos, 3, mocap);
  mjtNum* rotation = place >= 0 ? position + 3 : Row(w.data->mocap_quat, 4, mocap);
  mjtNum before[7];
  std::copy_n(position, 3, before);
  std::copy_n(rotation, 4, before + 3);
  const Eigen::Vector3d& p = base_T_thing.translation;
  const Eigen::Quaterniond q = base_T_thing.rotation.normalized();
  std::copy_n(p.data(), 3, position);
  const mjtNum quaternion[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy_n(quaternion, 4, rotation);
  mj_forward(w.model.get(), w.data.get());
  const auto overlap_with = [&](bool robot) {
    return w.Deepest([&](int a, int b) {
      const bool a_is_thing = w.model->body_rootid[a] == body;
      const bool b_is_thing = w.model->body_rootid[b] == body;
      return (a_is_thing && w.is_robot[static_cast<std::size_t>(b)] == robot) ||
             (b_is_thing && w.is_robot[static_cast<std::size_t>(a)] == robot);
    });
  };
  const double in_robot = overlap_with(true);
  const double in_things = place >= 0 ? overlap_with(false) : 0;
  if (in_robot > kAllowedOverlap || in_things > kAllowedSink) {
    std::copy_n(before, 3, position);
    std::copy_n(before + 3, 4, rotation);
    mj_forward(w.model.get(), w.data.get());
    const bool robot = in_robot > kAllowedOverlap;
    return FailedPrecondition(
        "\"" + std::string(thing) + "\" would stand in " +
            (robot ? "the robot, " : "another thing, ") +
            std::to_string(std::lround(1000 * (robot ? in_robot : in_things))) + " mm deep",
        "object");
  }
  if (place >= 0) std::fill_n(w.data->qvel + w.model->jnt_dofadr[w.model->body_jntadr[body]], 6, 0);
  for (Cart& cart : w.carts) {
    if (cart.body != body) continue;
    cart.base_p_start = p;
    cart.begin = w.Now();
  }
  return {};
}

std::vector<ThingState> World::things() const {
  std::vector<ThingState> states;
  for (const auto& [name, body] : impl_->things) {
    states.push_back({name, BodyPose(*impl_->data, body)});
  }
  return states;
}

Result<geometry::Pose> World::ThingPose(std::string_view thing) const {
  const int body = BodyId(*impl_->model, ThingBody(std::string(thing)));
  if (body < 0) return NoSuchThing(thing);
  return BodyPose(*impl_->data, body);
}

Snapshot World::snapshot() const {
  Snapshot snapshot;
  const mjModel& model = *impl_->model;
  const mjData& data = *impl_->data;
  snapshot.time = time();
  snapshot.positions.assign(data.qpos, data.qpos + model.nq);
  for (int i = 0; i < model.nmocap; ++i) {
    const mjtNum* position = Row(data.mocap_pos, 3, i);
    const mjtNum* rotation = Row(data.mocap_quat, 4, i);
    snapshot.thing_poses.insert(snapshot.thing_poses.end(), position, position + 3);
    snapshot.thing_poses.insert(snapshot.thing_poses.end(), rotation, rotation + 4);
  }
  return snapshot;
}

const mjModel_* World::model() const { return impl_->model.get(); }

int World::faults() const {
  int faults = 0;
  for (const int kind : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC, mjWARN_CONTACTFULL,
                         mjWARN_CNSTRFULL, mjWARN_INERTIA}) {
    faults += impl_->data->warning[kind].number;
  }
  return faults;
}

}  // namespace exemplar::simulator
