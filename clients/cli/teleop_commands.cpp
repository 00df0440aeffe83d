#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/program/runtime.hpp"
#include "screen.hpp"

namespace exemplar::cli {
namespace {

struct Words {
  std::string suit, format;
  std::vector<std::string> touch;
  bool detach = false;
};

nlohmann::json ToJson(const api::TeleoperationResult& result) {
  return {
      {"state", result.state},
      {"detail", result.detail},
      {"duration_s", result.duration_s},
      {"following_s", result.following_s},
      {"suit_samples", result.suit_samples},
      {"suit_samples_left_out", result.suit_samples_left_out},
      {"commands_sent", result.commands_sent},
      {"holds", result.holds},
      {"blocks", result.blocks},
      {"tracking_error_rad", result.tracking_error_rad},
      {"clearance_m", result.clearance_m ? nlohmann::json(*result.clearance_m) : nlohmann::json()},
      {"touch_max_n", result.touch_max_n},
      {"latency_p50_s", result.latency_p50_s},
      {"latency_p99_s", result.latency_p99_s},
      {"latency_max_s", result.latency_max_s}};
}

std::string ResultText(const api::TeleoperationResult& result) {
  return result.state + (result.detail.empty() ? "" : ": " + result.detail) +
         "\n  duration        " + FormatFixed(result.duration_s, 1) + " s, following " +
         FormatFixed(result.following_s, 1) + " s of it\n  suit            " +
         std::to_string(result.suit_samples) + " samples, " +
         std::to_string(result.suit_samples_left_out) + " left out\n  commands        " +
         std::to_string(result.commands_sent) + ", " + FormatFixed(1e3 * result.latency_p99_s, 2) +
         " ms behind the suit in 99 of 100\n  holds           " + std::to_string(result.holds) +
         ", blocked " + std::to_string(result.blocks) + " times\n  tracking error  " +
         FormatFixed(result.tracking_error_rad, 4) + " rad at most\n  clearance       " +
         (result.clearance_m ? FormatFixed(1e3 * *result.clearance_m, 1) + " mm at least"
                             : std::string("not measured")) +
         "\n  touch           " + FormatFixed(result.touch_max_n, 1) + " N at most\n";
}

void Draw(ProgressDisplay& display, const api::TeleoperationFeedback& now) {
  constexpr double kFarAway_rad = 0.5;
  const std::string measured = "suit " + FormatFixed(now.suit_rate_hz, 0) + " Hz, behind " +
                               FormatFixed(now.behind_rad, 2) + " rad" +
                               (now.behind_joint.empty() ? "" : " (" + now.behind_joint + ")") +
                               ", touch " + FormatFixed(now.touch_n, 1) + " N";
  display.Show(1 - now.behind_rad / kFarAway_rad, now.phase + ": " + now.detail, measured);
}

int On(const Session& session, const Words& words) {
  api::TeleoperationRequest request;
  request.suit = words.suit;
  request.touch = words.touch;
  request.detached = words.detach;
  const program::Signals signals;
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  ProgressDisplay display;
  const Result<api::TeleoperationResult> result = clients->executor->Teleoperate(
      request, [&](const api::TeleoperationFeedback& now) { Draw(display, now); }, signals.token());
  display.Clear();
  if (!result) {
    return FailOrInterrupted(result.error(), signals.token(),
                             "teleoperation has ended, the robot holds");
  }
  if (words.format == "json") {
    Print(ToJson(*result));
  } else if (result->state == "teleoperating") {
    std::cout << result->state << (result->detail.empty() ? "" : ": ") << result->detail << '\n';
  } else {
    std::cout << ResultText(*result);
  }
  if (result->state == "teleoperating" || result->state == "done") return 0;
  return Fail(FailedPrecondition("teleoperation ended as " + result->state +
                                 (result->detail.empty() ? "" : ": " + result->detail)));
}

int Off(const Session& session, const std::string& format) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  if (const Status done = clients->executor->EndTeleoperation(); !done) return Fail(done.error());
  const Result<api::RobotStatus> status = clients->executor->GetStatus();
  if (!status) return Fail(status.error());
  if (format == "json") {
    Print({{"state", status->state}, {"detail", status->detail}});
  } else {
    std::cout << status->state << '\n';
  }
  return 0;
}

}  // namespace

void AddTeleopCommands(Command& robot, const Session& session) {
  Command teleop = robot.Add("teleop", "The robot follows the suit, while the dead-man is held");
  const auto words = std::make_shared<Words>();
  Command command =
      teleop.Add("on",
                 "Lets the robot follow ircp/suit while the dead-man on ircp/safety is held.\n\n"
                 "Shows what it does until `teleop off`, or Ctrl-C; without this program the robot "
                 "holds. With\n"
                 "--detach: returns once the mode is on, which then lasts until `teleop off`. Exit "
                 "code 4 when\n"
                 "it is refused, or ended by anything but `teleop off`.",
                 {"exemplar robot teleop on", "exemplar robot teleop on --touch target --detach"});
  command.Option("--suit", "NAME", words->suit,
                 "source of ircp/suit to follow (default: the first that is heard)");
  command.Option("--touch", "OBJECT", words->touch,
                 "what the robot's touch links may touch; may be given several times");
  command.Flag("--detach", words->detach, "return once the mode is on");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return On(session, *words); });

  const auto format = std::make_shared<std::string>();
  command = teleop.Add("off", "Ends teleoperation, the robot holds; prints the state",
                       {"exemplar robot teleop off"});
  AddFormat(command, *format, {"text", "json"});
  command.Runs([&session, format] { return Off(session, *format); });
}

}  // namespace exemplar::cli
