#include "capture_suit/session_parts.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/ircp/simulated_time.hpp"

namespace exemplar::capture_suit {
namespace {

constexpr Duration kPollInterval = std::chrono::milliseconds(20);
constexpr Duration kAcknowledgeSlice = std::chrono::milliseconds(100);  // then looks for a stop

}  // namespace

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

Status AwaitReaders(const Clock& clock, Log& log,
                    const std::function<std::map<std::string, int>()>& readers, int wanted,
                    const std::stop_token& stop) {
  const ircp::TimeHold hold(clock);
  const Clock& real = ircp::RealTimeOf(clock);
  const Duration deadline = real.Steady() + kReaderTimeout;
  std::map<std::string, int> counts = readers();
  const auto lacks = [wanted](const auto& entry) { return entry.second < wanted; };
  while (std::any_of(counts.begin(), counts.end(), lacks) && real.Steady() < deadline) {
    if (!real.SleepFor(kPollInterval, stop)) return Cancelled();
    counts = readers();
  }
  for (const auto& [topic, count] : counts) {
    if (count == 0) {
      log.Warning("nobody reads", {{"topic", topic}});
    } else if (count < wanted) {
      log.Warning("fewer readers than expected",
                  {{"topic", topic}, {"readers", count}, {"expected", wanted}});
    }
  }
  return {};
}

bool AwaitAcknowledgments(const Clock& clock, const std::function<bool(Duration)>& acknowledged,
                          const std::stop_token& stop) {
  const Clock& real = ircp::RealTimeOf(clock);
  const Duration deadline = real.Steady() + kAcknowledgeTimeout;
  while (!acknowledged(kAcknowledgeSlice)) {
    if (stop.stop_requested() || real.Steady() >= deadline) return false;
  }
  return true;
}

Status Glide(const Clock& clock, const Eigen::VectorXd& from, const Eigen::VectorXd& to,
             double seconds, double rate_hz,
             const std::function<Status(const Eigen::VectorXd&)>& send,
             const std::stop_token& stop) {
  const int steps = std::max(1, static_cast<int>(std::lround(seconds * rate_hz)));
  const Duration start = clock.Steady();
  for (int k = 1; k <= steps; ++k) {
    if (!clock.SleepUntil(start + FromSeconds(k / rate_hz), stop)) return Cancelled();
    const double s = static_cast<double>(k) / steps;
    if (Status status = send(from + s * s * (3 - 2 * s) * (to - from)); !status) return status;
  }
  return {};
}

Error Cancelled() { return {ErrorCode::kCancelled, "stopped before the last trial had ended"}; }

std::string PlaceText(const geometry::Pose& pose) {
  return "(" + FormatFixed(pose.translation.x(), 2) + ", " + FormatFixed(pose.translation.y(), 2) +
         ")";
}

}  // namespace exemplar::capture_suit
