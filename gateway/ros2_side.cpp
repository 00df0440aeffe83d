#include "gateway/ros2_side.hpp"

#include <optional>
#include <utility>

#include "exemplar/bus/participant.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "gateway/ros2_bridge.hpp"

namespace exemplar::gateway {
namespace {

class Side final : public Ros2Side {
 public:
  Status Start(const ProgramOptions& words, const program::CommonOptions& common,
               ircp::Bus& station, const Clock& clock, bool is_simulated, Log& log) {
    if (!words.robot.empty()) {
      auto robot = kinematics::ReadRobotDescription(words.robot);
      if (!robot.ok()) return robot.error();
      robot_ = std::move(*robot);
    }
    auto graph = bus::Participant::Create({.domain = common.domain,
                                           .without_station = true,
                                           .name = "exemplar-gateway-ros2",
                                           .user_data = "enclave=/;",  // as ROS 2's are marked
                                           .interfaces = common.interfaces,
                                           .peers = common.peers,
                                           .discovery_servers = common.discovery_servers,
                                           .clock = &clock,
                                           .log = &log});
    if (!graph.ok()) return graph.error();
    graph_ = std::move(*graph);
    auto bridge = Ros2Bridge::Create(station, *graph_, *graph_, robot_ ? &*robot_ : nullptr,
                                     {.max_rate_hz = words.ros2_rate_hz,
                                      .robot_from = words.ros2_robot_from,
                                      .clock = is_simulated ? &clock : nullptr},
                                     log);
    if (!bridge.ok()) return bridge.error();
    bridge_ = std::move(*bridge);
    return {};
  }

  std::vector<Metric> metrics() const override { return MetricsOf(*bridge_); }

 private:
  std::optional<kinematics::RobotDescription> robot_;
  std::unique_ptr<bus::Participant> graph_;
  std::unique_ptr<Ros2Bridge> bridge_;
};

}  // namespace

Result<std::unique_ptr<Ros2Side>> Ros2Side::Create(const ProgramOptions& words,
                                                   const program::CommonOptions& common,
                                                   ircp::Bus& station, const Clock& clock,
                                                   bool is_simulated, Log& log) {
  if (!common.security.empty()) {
    return InvalidArgument(
        "--ros2 would publish a secured station's robot to everybody: leave out one of --ros2 and "
        "--security",
        "ros2");
  }
  auto side = std::make_unique<Side>();
  if (const Status started = side->Start(words, common, station, clock, is_simulated, log);
      !started.ok()) {
    return started.error();
  }
  return std::unique_ptr<Ros2Side>(std::move(side));
}

}  // namespace exemplar::gateway
