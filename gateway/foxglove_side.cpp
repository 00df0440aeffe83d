#include "gateway/foxglove_side.hpp"

#include <optional>
#include <utility>

#include "exemplar/bus/codec.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/security/access.hpp"
#include "gateway/foxglove/bridge.hpp"
#include "gateway/foxglove/playback.hpp"
#include "gateway/foxglove/scene_feed.hpp"
#include "gateway/foxglove/station_services.hpp"

namespace exemplar::gateway {
namespace {

foxglove::Permit PermitOf(std::shared_ptr<security::AccessFile> access) {
  if (access == nullptr) return {};
  return [access = std::move(access)](const http::Request& request) -> foxglove::Permission {
    constexpr std::string_view kBearer = "Bearer ";
    const std::string authorization = foxglove::AuthorizationOf(request);
    if (!authorization.starts_with(kBearer)) return {false, false};
    const std::string_view token = std::string_view(authorization).substr(kBearer.size());
    const auto caller = access->Identify({.token = token});
    if (!caller) return {false, false};
    return {caller->roles.Has(security::Role::kObserve),
            caller->roles.Has(security::Role::kAdminister)};
  };
}

class Side final : public FoxgloveSide {
 public:
  Side(TopicHub& hub, api::JsonCalls& calls, http::Server& server, const Clock& clock,
       bool is_simulated, Log& log, foxglove::Permit permit)
      : server_(server),
        permit_(std::move(permit)),
        bridge_(
            foxglove::Bridge::Create(hub, clock, log, foxglove::StationServices(calls),
                                     {.name = "exemplar",
                                      .session = std::to_string(real_clock_.Now().nanoseconds()),
                                      .simulated_time = is_simulated,
                                      .permit = permit_})) {}

  ~Side() override { server_.Stop(); }

  Status Start(const ProgramOptions& words, TopicHub& hub, const Clock& clock, Log& log) {
    if (!words.robot.empty()) {
      auto robot = kinematics::ReadRobotDescription(words.robot);
      if (!robot) return robot.error();
      robot_ = std::move(*robot);
    }
    auto scene = foxglove::SceneFeed::Create(hub, *bridge_, clock, log, robot_ ? &*robot_ : nullptr,
                                             {.joint_state = bus::Decode<ircp::JointStateSample>,
                                              .object = bus::Decode<ircp::ObjectSample>,
                                              .plan = bus::Decode<ircp::PlanSample>},
                                             {});
    if (!scene) return scene.error();
    scene_ = std::move(*scene);
    for (const char* path : {"/", "/foxglove"}) {
      if (Status added = server_.RouteWebSocket(path, bridge_->Endpoint()); !added) return added;
    }
    if (words.recordings.empty()) return {};
    playback_ = foxglove::Playback::Create(real_clock_, log,
                                           {.folder = words.recordings, .permit = permit_});
    return server_.RouteWebSocket("/foxglove/recordings/{file}", playback_->Endpoint());
  }

  std::vector<Metric> metrics() const override { return foxglove::MetricsOf(*bridge_); }

 private:
  const SystemClock real_clock_;
  http::Server& server_;
  const foxglove::Permit permit_;
  std::optional<kinematics::RobotDescription> robot_;
  std::unique_ptr<foxglove::Bridge> bridge_;
  std::unique_ptr<foxglove::SceneFeed> scene_;
  std::unique_ptr<foxglove::Playback> playback_;
};

}  // namespace

Result<std::unique_ptr<FoxgloveSide>> FoxgloveSide::Create(const ProgramOptions& words,
                                                           const program::CommonOptions& common,
                                                           TopicHub& hub, api::JsonCalls& calls,
                                                           http::Server& server, const Clock& clock,
                                                           bool is_simulated, Log& log) {
  std::shared_ptr<security::AccessFile> access;
  if (!common.server.access.empty()) {
    static const SystemClock real_clock;
    auto opened = security::AccessFile::Open(common.server.access, real_clock, log);
    if (!opened) return opened.error();
    access = std::move(*opened);
  }
  auto side = std::make_unique<Side>(hub, calls, server, clock, is_simulated, log,
                                     PermitOf(std::move(access)));
  if (Status started = side->Start(words, hub, clock, log); !started) return started.error();
  return std::unique_ptr<FoxgloveSide>(std::move(side));
}

}  // namespace exemplar::gateway
