#include "capture_suit/session_parts.hpp"

#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::capture_suit {

Result<std::unique_ptr<ircp::ControlServer>> MakeControl(
    ircp::Bus& bus, const Clock& clock, std::function<std::vector<ircp::TopicCount>()> sent) {
  auto control = ircp::ControlServer::Create(
      bus, clock, "capture_suit", [](const ircp::CommandSample& command) -> ircp::Answer {
        return {false, "\"" + command.action + "\" is no action of this program", {}};
      });
  if (control) (*control)->SetSentCounts(std::move(sent));
  return control;
}

Result<std::optional<RecorderRemote>> MakeRecorder(bool wanted, ircp::Bus& bus, const Clock& clock,
                                                   std::uint64_t seed,
                                                   const std::string& demonstrator) {
  if (!wanted) return std::optional<RecorderRemote>();
  Result<RecorderRemote> recorder = RecorderRemote::Create(bus, clock, seed, demonstrator);
  if (!recorder) return recorder.error();
  return std::optional<RecorderRemote>(std::move(*recorder));
}

Status PutObject(ircp::ControlClient& simulator, const std::string& object,
                 const geometry::Pose& base_T_object, const std::stop_token& stop) {
  constexpr Duration kAnswerTimeout = std::chrono::seconds(10);
  const Eigen::Vector3d& p = base_T_object.translation;
  const Eigen::Quaterniond& q = base_T_object.rotation;
  const Result<ircp::Answer> answer = simulator.Call("place",
                                                     {{"object", object},
                                                      {"x", FormatDouble(p.x())},
                                                      {"y", FormatDouble(p.y())},
                                                      {"z", FormatDouble(p.z())},
                                                      {"qx", FormatDouble(q.x())},
                                                      {"qy", FormatDouble(q.y())},
                                                      {"qz", FormatDouble(q.z())},
                                                      {"qw", FormatDouble(q.w())}},
                                                     kAnswerTimeout, stop);
  if (answer) return {};
  return WithPlace(answer.error(), "putting \"" + object + "\" at " + PlaceText(base_T_object));
}

std::string PlaceText(const geometry::Pose& pose) {
  return "(" + FormatFixed(pose.translation.x(), 2) + ", " + FormatFixed(pose.translation.y(), 2) +
         ")";
}

}  // namespace exemplar::capture_suit
