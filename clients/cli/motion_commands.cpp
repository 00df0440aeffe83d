#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/program/runtime.hpp"
#include "screen.hpp"
#include "skill_text.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

struct Words {
  std::string name, format, output, file, start, joint_start;
  int version = 0;
  std::vector<std::string> objects;
  std::optional<double> speed;
  bool wait = false;
  bool follow = false;
};

Result<demonstration::SkillQuery> ReadQuery(const Words& words) {
  demonstration::SkillQuery query;
  Result<std::vector<geometry::NamedPose>> objects = ParseObjects(words.objects);
  if (!objects) return objects.error();
  query.objects = *std::move(objects);
  if (!words.start.empty()) {
    const Result<ReadPose> start = ParsePose(words.start, "--start");
    if (!start) return start.error();
    query.start = start->pose;
    query.start_has_orientation = start->has_orientation;
  }
  if (!words.joint_start.empty()) {
    if (const Status read = ParseJointStart(words.joint_start, query); !read) return read.error();
  }
  return query;
}

int Query(const Session& session, const Words& words) {
  const Result<demonstration::SkillQuery> query = ReadQuery(words);
  if (!query) return FailUsage(query.error());
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<demonstration::SkillMotion> motion =
      clients->skills->Query(words.name, words.version, *query);
  if (!motion) return Fail(motion.error());
  // In JSON the warnings are part of the answer.
  if (words.format != "json") Warn(motion->warnings);
  const std::string text = words.format == "csv"    ? demonstration::ToCsv(*motion)
                           : words.format == "json" ? ToJson(*motion).dump(2) + "\n"
                                                    : MotionText(*motion);
  const Status written = Write(text, words.output);
  return written ? 0 : Fail(written.error());
}

int Evaluate(const Session& session, const Words& words) {
  Result<std::string> file = ReadFile(words.file);
  if (!file) return Fail(file.error());
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<learning::Evaluation> evaluation =
      clients->skills->Evaluate(words.name, words.version, FileName(words.file), *std::move(file));
  if (!evaluation) return Fail(evaluation.error());
  if (words.format == "json") {
    Print(ToJson(*evaluation));
    return 0;
  }
  Warn(evaluation->answer.warnings);
  const demonstration::Deviation& deviation = evaluation->deviation;
  std::cout << "Frechet distance  " << FormatFixed(100 * deviation.frechet_m, 2)
            << " cm\nend error         " << FormatFixed(100 * deviation.end_error_m, 2)
            << " cm\nend angle         " << FormatFixed(deviation.end_angle_rad, 3) << " rad\n";
  return 0;
}

Result<api::ExecuteRequest> ReadExecution(const Words& words) {
  api::ExecuteRequest request;
  request.skill = words.name;
  request.version = words.version;
  Result<std::vector<geometry::NamedPose>> objects = ParseObjects(words.objects);
  if (!objects) return objects.error();
  request.objects = *std::move(objects);
  if (!words.start.empty()) {
    const Result<ReadPose> start = ParsePose(words.start, "--start");
    if (!start) return start.error();
    if (!start->has_orientation) {
      return InvalidArgument("--start " + words.start + ": needs an orientation to go there",
                             "--start");
    }
    request.start = start->pose;
  }
  if (words.speed) {
    request.speed = *words.speed;
    if (!(request.speed > 0 && request.speed <= 1)) {
      return InvalidArgument(
          "--speed is " + FormatDouble(request.speed) + ", must be over 0 and at most 1",
          "--speed");
    }
  }
  request.detached = !words.wait;
  request.follow = words.follow;
  if (request.follow && !request.objects.empty()) {
    return InvalidArgument("--follow takes the target where it is seen: leave --object away",
                           "--follow");
  }
  return request;
}

std::string ResultText(const api::ExecutionResult& result) {
  const auto or_none = [](const std::optional<double>& value, double scale, int decimals,
                          const char* unit) {
    return value ? FormatFixed(scale * *value, decimals) + unit : std::string("not measured");
  };
  return result.state + (result.detail.empty() ? "" : ": " + result.detail) +
         "\n  duration        " + FormatFixed(result.plan.duration_s, 2) +
         " s\n  contact error   " + or_none(result.contact_error_m, 1e3, 2, " mm") +
         "\n  touch           " + or_none(result.touch_onset_s, 1, 2, " s after the start") +
         ", at most " + FormatFixed(result.touch_max_n, 1) + " N\n  tracking error  " +
         FormatFixed(result.tracking_error_rad, 4) + " rad at most\n  clearance       " +
         FormatFixed(1e3 * result.clearance_m, 1) + " mm at least\n  commands        " +
         std::to_string(result.commands_sent) + ", late by at most " +
         FormatFixed(1e3 * result.lateness_max_s, 2) + " ms\n";
}

int Execute(const Session& session, const Words& words) {
  const Result<api::ExecuteRequest> request = ReadExecution(words);
  if (!request) return FailUsage(request.error());
  const program::Signals signals;
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  ProgressDisplay display;
  const Result<api::ExecutionResult> result = clients->executor->Execute(
      *request,
      [&](const api::ExecutionFeedback& now) {
        // Before there is a plan, nothing else is known.
        if (!(now.duration_s > 0)) return display.Show(0, now.state);
        display.Show(now.time_s / now.duration_s, now.state,
                     FormatFixed(now.time_s, 1) + " of " + FormatFixed(now.duration_s, 1) +
                         " s, touch " + FormatFixed(now.touch_n, 1) + " N");
      },
      signals.token());
  display.Clear();
  if (!result) {
    return FailOrInterrupted(result.error(), signals.token(), "the robot slows down and holds");
  }
  if (words.format == "json") {
    Print(ToJson(*result));
  } else if (request->detached && result->state != "done") {
    std::cout << result->state << '\n';
  } else {
    std::cout << ResultText(*result);
  }
  Warn(result->plan.warnings);
  if (request->detached || result->state == "done") return 0;
  return Fail(FailedPrecondition("the motion ended as " + result->state +
                                 (result->detail.empty() ? "" : ": " + result->detail)));
}

void AddObjects(Command& command, Words& words, const std::string& otherwise) {
  command.Option("--object", "NAME=x,y,z[,qx,qy,qz,qw]", words.objects,
                 "where an object is, in the robot's base frame, m; without a quaternion it takes "
                 "the trials' mean orientation; may be given several times" +
                     otherwise);
  command.Option("--version", "N", words.version, "which version (default: the current one)");
}

}  // namespace

void AddMotionCommands(Command& skill, const Session& session) {
  auto words = std::make_shared<Words>();
  Command command = skill.Add(
      "query",
      "Asks a skill for the motion at object positions.\n\n"
      "CSV columns: time_s, joints, end-effector pose as in trials, objectivity, sigma_m "
      "(predicted\n"
      "standard error). Warnings go to stderr; in JSON they are part of the answer.",
      {"exemplar skill query press --object button=0.45,-0.2,0.06 --output motion.csv",
       "exemplar skill query press --object button=0.45,-0.2,0.06,0,0,0,1 --start 0.3,0,0.3"});
  command.Argument("NAME", words->name, "of the skill").Completes(Names::kSkills);
  AddObjects(command, *words, "");
  command.Option("--start", "x,y,z[,qx,qy,qz,qw]", words->start,
                 "tool pose now (default: the trials' mean)");
  command.Option("--joint-start", "q1,q2,...|NAME=q1,...", words->joint_start,
                 "joints now, rad or m");
  AddFormat(command, words->format, {"csv", "json", "text"});
  command.Option("--output", "FILE", words->output, "default: standard output");
  command.Runs([&session, words] { return Query(session, *words); });

  words = std::make_shared<Words>();
  command = skill.Add("evaluate",
                      "Compares a skill's answer with what a person did in a trial that it was not "
                      "learned from",
                      {"exemplar skill evaluate press left-out.csv"});
  command.Argument("NAME", words->name, "of the skill").Completes(Names::kSkills);
  command.Argument("FILE", words->file, "trial, CSV or MCAP");
  command.Option("--version", "N", words->version, "which version (default: the current one)");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Evaluate(session, *words); });

  words = std::make_shared<Words>();
  command = skill.Add(
      "execute",
      "Carries a skill out on the robot.\n\n"
      "With --wait: streams progress until the motion has ended; Ctrl-C ends the motion. Without:\n"
      "returns once the robot moves. Exit code 4 when the motion is refused or aborted.",
      {"exemplar skill execute press --object button=0.45,-0.2,0.06 --wait",
       "exemplar skill execute press --wait --speed 0.5",
       "exemplar skill execute press --follow --wait"});
  command.Argument("NAME", words->name, "of the skill").Completes(Names::kSkills);
  AddObjects(command, *words, " (default: where the objects are seen)");
  command.Option("--start", "x,y,z,qx,qy,qz,qw", words->start,
                 "go there first (default: from where the tool is)");
  command.Option("--speed", "FACTOR", words->speed, "over 0 and at most 1 (default: 1)");
  command.Flag("--wait", words->wait, "until the motion has ended");
  command.Flag("--follow", words->follow,
               "the target moves, as ircp/objects shows: meet it where it will be");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Execute(session, *words); });
}

}  // namespace exemplar::cli
