#include "gateway/foxglove/scene_feed.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>
#include <utility>

namespace exemplar::gateway::foxglove {
namespace {

using geometry::Pose;

constexpr double kObjectSize = 0.04;
constexpr std::uintmax_t kLargestMesh = 8u << 20;

Colour RobotColour() { return {0.72, 0.74, 0.78, 1.0}; }
Colour ObjectColour() { return {0.95, 0.55, 0.15, 0.9}; }
Colour PlanColour() { return {0.15, 0.6, 0.95, 1.0}; }

Result<std::string> ReadMesh(const std::string& path) {
  std::error_code problem;
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (problem) return NotFound(path + ": " + problem.message());
  if (size > kLargestMesh) return InvalidArgument(path + " has " + std::to_string(size) + " bytes");
  std::ifstream file(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file.good() && !file.eof()) return Unavailable(path + " cannot be read");
  return bytes;
}

/// Adds one shape of a link to its entity.
class ShapeDrawer {
 public:
  ShapeDrawer(Entity& entity, const Pose& link_T_shape, const Colour& colour,
              std::vector<std::string>& notices)
      : entity_(entity), pose_(link_T_shape), colour_(colour), notices_(notices) {}

  void operator()(const kinematics::Box& box) {
    entity_.cubes.push_back({pose_, box.size, colour_});
  }
  void operator()(const kinematics::Sphere& sphere) { AddSphere(pose_, sphere.radius); }
  void operator()(const kinematics::Cylinder& cylinder) {
    AddCylinder(cylinder.radius, cylinder.length);
  }
  void operator()(const kinematics::Capsule& capsule) {
    AddCylinder(capsule.radius, capsule.length);
    for (const double end : {-0.5, 0.5}) {
      AddSphere(pose_ * Pose::FromTranslation({0, 0, end * capsule.length}), capsule.radius);
    }
  }
  void operator()(const kinematics::Mesh& mesh) {
    Result<std::string> bytes = ReadMesh(mesh.path);
    if (!bytes.ok()) {
      notices_.push_back(bytes.error().message);
      return;
    }
    entity_.models.push_back({pose_, mesh.scale, colour_, "model/stl", std::move(*bytes)});
  }

 private:
  void AddSphere(const Pose& pose, double radius) {
    entity_.spheres.push_back({pose, Eigen::Vector3d::Constant(2 * radius), colour_});
  }
  void AddCylinder(double radius, double length) {
    entity_.cylinders.push_back({pose_, {2 * radius, 2 * radius, length}, colour_});
  }

  Entity& entity_;
  Pose pose_;
  Colour colour_;
  std::vector<std::string>& notices_;
};

ChannelInfo SceneChannel(const std::string& topic) {
  return {
      .topic = topic, .schema_name = kSceneUpdateType, .schema = std::string(SceneUpdateSchema())};
}

class HubSceneFeed final : public SceneFeed {
 public:
  HubSceneFeed(Bridge& bridge, const Clock& clock, Log& log,
               const kinematics::RobotDescription* robot, SceneDecoders decoders,
               SceneOptions options)
      : bridge_(bridge),
        clock_(clock),
        log_(log),
        robot_(robot),
        decoders_(std::move(decoders)),
        period_(FromSeconds(1 / options.rate_hz)) {}

  Status Start(TopicHub& hub) {
    objects_ = bridge_.AddChannel(SceneChannel("exemplar/objects"));
    plan_ = bridge_.AddChannel(SceneChannel("exemplar/plan"));
    std::vector<std::string> topics = {ircp::ObjectSample::kTopic, ircp::PlanSample::kTopic};
    if (robot_ != nullptr) {
      StartRobot();
      topics.emplace_back(ircp::JointStateSample::kTopic);
    }
    auto subscription = hub.Subscribe({.topics = topics});
    if (!subscription.ok()) return subscription.error();
    subscription_ = std::move(*subscription);
    thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
    return {};
  }

 private:
  void StartRobot() {
    std::vector<std::string> notices;
    const Stamp now = clock_.Now();
    const std::uint32_t channel = bridge_.AddChannel(SceneChannel("exemplar/robot"));
    bridge_.Publish(channel, now, Encode(DrawRobot(*robot_, now, notices), now), true);
    for (const std::string& notice : notices) log_.Warning("mesh not shown", {{"why", notice}});
    transforms_ = bridge_.AddChannel({.topic = "exemplar/transforms",
                                      .schema_name = kFrameTransformsType,
                                      .schema = std::string(FrameTransformsSchema())});
    ircp::JointStateSample home;
    bridge_.Publish(transforms_, now, Encode(TransformsAt(*robot_, home, now)), true);
  }

  void Run(const std::stop_token& stop) {
    constexpr std::size_t kAtOnce = 256;
    std::vector<SamplePtr> samples;
    while (subscription_->WaitAndTake(samples, kAtOnce, stop) > 0) {
      for (const SamplePtr& sample : samples) {
        if (sample->valid) Draw(*sample);
      }
      samples.clear();
    }
  }

  void Draw(const ircp::RawSample& sample) {
    if (sample.topic == ircp::JointStateSample::kTopic) {
      DrawState(sample);
    } else if (sample.topic == ircp::ObjectSample::kTopic) {
      const auto object = decoders_.object(sample.cdr);
      if (!object.ok()) return;
      SceneUpdate update{{}, {DrawObject(*object, Base(object->frame), sample.received)}};
      bridge_.Publish(objects_, sample.received, Encode(update, sample.received), false);
    } else {
      const auto plan = decoders_.plan(sample.cdr);
      if (!plan.ok()) return;
      bridge_.Publish(plan_, sample.received,
                      Encode(DrawPlan(*plan, Base("base"), sample.received), sample.received),
                      true);
    }
  }

  void DrawState(const ircp::RawSample& sample) {
    const Duration now = clock_.Steady();
    if (drawn_ && now - *drawn_ < period_) return;
    const auto state = decoders_.joint_state(sample.cdr);
    if (!state.ok()) return;
    drawn_ = now;
    bridge_.Publish(transforms_, sample.received,
                    Encode(TransformsAt(*robot_, *state, sample.received)), true);
  }

  std::string Base(const std::string& otherwise) const {
    return robot_ != nullptr ? robot_->chain.base_link() : otherwise;
  }

  Bridge& bridge_;
  const Clock& clock_;
  Log& log_;
  const kinematics::RobotDescription* robot_;
  const SceneDecoders decoders_;
  const Duration period_;
  std::uint32_t objects_ = 0;
  std::uint32_t plan_ = 0;
  std::uint32_t transforms_ = 0;
  std::optional<Duration> drawn_;
  std::unique_ptr<Subscription> subscription_;
  std::jthread thread_;
};

}  // namespace

SceneUpdate DrawRobot(const kinematics::RobotDescription& robot, Stamp now,
                      std::vector<std::string>& notices) {
  SceneUpdate update;
  for (const kinematics::Link& link : robot.model.links) {
    if (link.collisions.empty()) continue;
    Entity entity{.time = now, .frame = link.name, .id = "link " + link.name};
    for (const kinematics::Geometry& part : link.collisions) {
      std::visit(
          ShapeDrawer(entity, part.link_T_shape, link.colour.value_or(RobotColour()), notices),
          part.shape);
    }
    update.entities.push_back(std::move(entity));
  }
  return update;
}

std::vector<FrameTransform> TransformsAt(const kinematics::RobotDescription& robot,
                                         const ircp::JointStateSample& state, Stamp time) {
  const kinematics::RobotModel& model = robot.model;
  Eigen::VectorXd full = kinematics::FullJointVector(model, robot.chain, robot.home);
  if (!state.names.empty()) kinematics::SetHandOpening(model, state.hand_open, full);
  for (std::size_t i = 0; i < state.names.size() && i < state.positions.size(); ++i) {
    const int joint = model.FindJoint(state.names[i]);
    if (joint >= 0) full[joint] = state.positions[i];
  }
  std::vector<Pose> root_T_links;
  kinematics::LinkPoses(model, full, root_T_links);
  std::vector<FrameTransform> transforms;
  for (const kinematics::Joint& joint : model.joints) {
    const auto parent = static_cast<std::size_t>(joint.parent_link);
    const auto child = static_cast<std::size_t>(joint.child_link);
    transforms.push_back({time, model.links[parent].name, model.links[child].name,
                          root_T_links[parent].Inverse() * root_T_links[child]});
  }
  return transforms;
}

Entity DrawObject(const ircp::ObjectSample& object, const std::string& base, Stamp now) {
  constexpr double kLabelAbove = 0.05;
  Entity entity{.time = now,
                .frame = base,
                .id = "object " + object.name,
                .lifetime = std::chrono::seconds(5)};
  entity.cubes.push_back(
      {object.base_T_object, Eigen::Vector3d::Constant(kObjectSize), ObjectColour()});
  Label label{.colour = {1, 1, 1, 1}, .text = object.name};
  label.pose.translation = object.base_T_object.translation + Eigen::Vector3d(0, 0, kLabelAbove);
  entity.labels.push_back(std::move(label));
  return entity;
}

SceneUpdate DrawPlan(const ircp::PlanSample& plan, const std::string& base, Stamp now) {
  constexpr const char* kId = "plan";
  SceneUpdate update;
  if (plan.tool_m.size() < 6) {
    update.deletions.emplace_back(kId);
    return update;
  }
  LineStrip line{.colour = PlanColour()};
  for (std::size_t i = 0; i + 3 <= plan.tool_m.size(); i += 3) {
    line.points.emplace_back(plan.tool_m[i], plan.tool_m[i + 1], plan.tool_m[i + 2]);
  }
  Entity entity{.time = now, .frame = base, .id = kId};
  Label label{.colour = PlanColour(), .text = plan.skill};
  label.pose.translation = line.points.front();
  entity.labels.push_back(std::move(label));
  entity.lines.push_back(std::move(line));
  update.entities.push_back(std::move(entity));
  return update;
}

Result<std::unique_ptr<SceneFeed>> SceneFeed::Create(TopicHub& hub, Bridge& bridge,
                                                     const Clock& clock, Log& log,
                                                     const kinematics::RobotDescription* robot,
                                                     SceneDecoders decoders, SceneOptions options) {
  auto feed =
      std::make_unique<HubSceneFeed>(bridge, clock, log, robot, std::move(decoders), options);
  if (const Status started = feed->Start(hub); !started.ok()) return started.error();
  return std::unique_ptr<SceneFeed>(std::move(feed));
}

}  // namespace exemplar::gateway::foxglove
