#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

std::string StatusText(const api::RobotStatus& status) {
  std::string text = "state   " + status.state +
                     (status.detail.empty() ? "" : " (" + status.detail + ")") + "\nspeed   " +
                     FormatFixed(status.speed, 2) + '\n';
  if (status.joints.size() == 0) {
    text += "joints  none received\n";
  } else {
    text += "tool    " + PoseText(status.base_T_tool, true) + "  (m)\njoints  " +
            FormatFixed(status.state_age_s, 3) + " s old\n";
    Table joints({"JOINT", "RAD OR M"});
    for (std::size_t i = 0; i < status.joint_names.size(); ++i) {
      joints.Add(
          {status.joint_names[i], FormatFixed(status.joints[static_cast<Eigen::Index>(i)], 4)});
    }
    text += joints.Text(2);
  }
  if (!status.objects.empty()) {
    text += "objects\n";
    Table objects({"OBJECT", "AGE (s)", "AT (m)"});
    for (const api::SeenObject& object : status.objects) {
      objects.Add({object.pose.name, FormatFixed(object.age_s, 2),
                   PoseText(object.pose.base_T_object, object.pose.has_orientation)});
    }
    text += objects.Text(2);
  }
  return text;
}

int PrintStatus(api::ExecutorApi& executor, const std::string& format) {
  const Result<api::RobotStatus> status = executor.GetStatus();
  if (!status) return Fail(status.error());
  if (format == "json") {
    Print(ToJson(*status));
  } else {
    std::cout << StatusText(*status);
  }
  return 0;
}

/// Does something and prints the state that the robot is in then.
int Do(const Session& session, const std::string& format,
       const std::function<Status(api::ExecutorApi&)>& action) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  if (const Status done = action(*clients->executor); !done) return Fail(done.error());
  const Result<api::RobotStatus> status = clients->executor->GetStatus();
  if (!status) return Fail(status.error());
  if (format == "json") {
    Print(ToJson(*status));
  } else {
    std::cout << status->state << '\n';
  }
  return 0;
}

}  // namespace

void AddRobotCommands(Command& root, const Session& session) {
  Command robot = root.Add("robot", "The robot of the station, through its executor");

  auto format = std::make_shared<std::string>();
  Command command = robot.Add("status", "Shows state, joints, tool and the objects that are seen",
                              {"exemplar robot status", "exemplar robot status --format json"});
  AddFormat(command, *format, {"text", "json"});
  command.Runs([&session, format] {
    const Result<rpc::Clients> clients = session.Connect();
    if (!clients) return FailUsage(clients.error());
    return PrintStatus(*clients->executor, *format);
  });

  struct Action {
    const char* name;
    const char* summary;
    Status (api::ExecutorApi::*call)();
  };
  for (const Action& action :
       {Action{"pause", "Holds the motion on its path", &api::ExecutorApi::Pause},
        Action{"resume", "Goes on with a held motion", &api::ExecutorApi::Resume},
        Action{"cancel", "Ends the motion smoothly", &api::ExecutorApi::Cancel},
        Action{"stop", "Ends the motion at once; refuses others until reset",
               &api::ExecutorApi::Stop},
        Action{"reset", "Lets the robot move again after a stop", &api::ExecutorApi::Reset}}) {
    format = std::make_shared<std::string>();
    command = robot.Add(action.name, std::string(action.summary) + "; prints the state",
                        {std::string("exemplar robot ") + action.name});
    AddFormat(command, *format, {"text", "json"});
    command.Runs([&session, format, call = action.call] {
      return Do(session, *format,
                [call](api::ExecutorApi& executor) { return (executor.*call)(); });
    });
  }

  AddTeleopCommands(robot, session);

  struct SpeedWords {
    std::string factor, format;
  };
  const auto words = std::make_shared<SpeedWords>();
  command = robot.Add("speed", "Sets the speed of this and later motions; prints the state",
                      {"exemplar robot speed 0.25"});
  command.Argument("FACTOR", words->factor, "over 0 and at most 1");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] {
    const std::optional<double> factor = ParseDouble(words->factor);
    if (!factor || !(*factor > 0 && *factor <= 1)) {
      return FailUsage(InvalidArgument(
          "FACTOR is \"" + words->factor + "\", must be a number over 0 and at most 1", "FACTOR"));
    }
    return Do(session, words->format,
              [&](api::ExecutorApi& executor) { return executor.SetSpeed(*factor); });
  });
}

}  // namespace exemplar::cli
