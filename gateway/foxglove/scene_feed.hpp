#pragma once
// The robot, the objects around it and the planned motion, drawn from the station's topics.

#include <memory>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/samples.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "gateway/foxglove/bridge.hpp"
#include "gateway/foxglove/scene_messages.hpp"

namespace exemplar::gateway::foxglove {

/// How the topics' bytes are read.
struct SceneDecoders {
  std::function<Result<ircp::JointStateSample>(std::span<const std::uint8_t>)> joint_state;
  std::function<Result<ircp::ObjectSample>(std::span<const std::uint8_t>)> object;
  std::function<Result<ircp::PlanSample>(std::span<const std::uint8_t>)> plan;
};

/// The links' collision shapes, each link in its own frame, which its transforms move. A mesh goes
/// as the bytes of its file (STL); one that cannot be read or is over 8 MB is left out and named in
/// `notices`.
SceneUpdate DrawRobot(const kinematics::RobotDescription& robot, Stamp now,
                      std::vector<std::string>& notices);

/// Parent to child for every joint of the model, at the sample's joints; those it does not name
/// stand as in FullJointVector.
std::vector<FrameTransform> TransformsAt(const kinematics::RobotDescription& robot,
                                         const ircp::JointStateSample& state, Stamp time);

/// The object as a cube of 4 cm with its name.
Entity DrawObject(const ircp::ObjectSample& object, const std::string& base, Stamp now);

/// The tool's way as a line; deletes it when the plan is empty.
SceneUpdate DrawPlan(const ircp::PlanSample& plan, const std::string& base, Stamp now);

struct SceneOptions {
  double rate_hz = 30;  ///< of transforms, at most
};

/// Adds the channels exemplar/robot, exemplar/transforms (both with a robot only),
/// exemplar/objects and exemplar/plan. Ends with its destructor.
class SceneFeed {
 public:
  /// `robot` may be null; all arguments outlive the feed.
  static Result<std::unique_ptr<SceneFeed>> Create(TopicHub& hub, Bridge& bridge,
                                                   const Clock& clock, Log& log,
                                                   const kinematics::RobotDescription* robot,
                                                   SceneDecoders decoders, SceneOptions options);
  virtual ~SceneFeed() = default;
};

}  // namespace exemplar::gateway::foxglove
