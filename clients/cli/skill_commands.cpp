#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/program/runtime.hpp"
#include "figure_files.hpp"
#include "screen.hpp"
#include "skill_text.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

struct Words {
  std::string name, format, output, figures;
  int version = 0;
  int count = 3;
  std::vector<std::string> options;
};

int PrintReport(const learning::SkillReport& report, const std::string& format) {
  if (format == "json") {
    Print(learning::ToJson(report));
  } else {
    std::cout << ReportText(report);
  }
  return 0;
}

int Learn(const Session& session, const Words& words) {
  const auto options = ParsePairs(words.options, "--option");
  if (!options) return FailUsage(options.error());
  const program::Signals signals;
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  ProgressDisplay display;
  const Result<learning::SkillReport> report = clients->skills->Learn(
      words.name, *options,
      [&](double fraction, std::string_view step) { display.Show(fraction, step); },
      signals.token());
  display.Clear();
  if (!report) {
    return FailOrInterrupted(report.error(), signals.token(), "nothing was changed");
  }
  return PrintReport(*report, words.format);
}

int List(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<std::vector<api::SkillInfo>> skills = clients->skills->List();
  if (!skills) return Fail(skills.error());
  if (words.format == "json") {
    nlohmann::json list = nlohmann::json::array();
    for (const api::SkillInfo& info : *skills) list.push_back(ToJson(info));
    Print(list);
    return 0;
  }
  if (skills->empty()) {
    Hint("no skills yet: `exemplar trial submit --skill NAME FILE...`, then `skill learn NAME`");
  }
  Table table({"SKILL", "VERSION", "VERSIONS", "METHOD", "TARGET", "TRIALS", "LEARNED"});
  for (const api::SkillInfo& info : *skills) {
    table.Add({info.name, std::to_string(info.version), std::to_string(info.versions), info.method,
               info.target, std::to_string(info.trials), TimeText(info.learned)});
  }
  std::cout << table.Text();
  return 0;
}

int Show(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<learning::SkillReport> report = clients->skills->Show(words.name, words.version);
  if (!report) return Fail(report.error());
  PrintReport(*report, words.format);
  if (words.figures.empty()) return 0;
  const Result<std::string> document = clients->skills->ExportJson(words.name, report->version);
  if (!document) return Fail(document.error());
  const Result<std::vector<std::string>> written = WriteFigures(*document, words.figures);
  if (!written) return Fail(written.error());
  // Behind a JSON report nothing else may stand.
  std::ostream& out = words.format == "json" ? std::cerr : std::cout;
  for (const std::string& line : *written) out << line << '\n';
  return 0;
}

int Versions(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<std::vector<api::VersionInfo>> versions = clients->skills->Versions(words.name);
  if (!versions) return Fail(versions.error());
  if (words.format == "json") {
    nlohmann::json list = nlohmann::json::array();
    for (const api::VersionInfo& info : *versions) list.push_back(ToJson(info));
    Print(list);
    return 0;
  }
  Table table({"VERSION", "CURRENT", "METHOD", "TRIALS", "LEARNED"});
  for (const api::VersionInfo& info : *versions) {
    table.Add({std::to_string(info.version), info.current ? "yes" : "", info.method,
               std::to_string(info.trial_ids.size()), TimeText(info.learned)});
  }
  std::cout << table.Text();
  return 0;
}

int Suggest(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<learning::Suggestions> found =
      clients->skills->Suggest(words.name, words.version, {.count = words.count});
  if (!found) return Fail(found.error());
  if (words.format == "json") {
    Print(ToJson(*found));
  } else {
    std::cout << SuggestionsText(*found);
  }
  return 0;
}

int Rollback(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Status done = clients->skills->Rollback(words.name, words.version);
  if (!done) return Fail(done.error());
  if (words.format == "json") {
    Print({{"skill", words.name}, {"version", words.version}});
  } else {
    std::cout << "skill " << words.name << ": version " << words.version << " is the current one\n";
  }
  return 0;
}

int Delete(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Status done = clients->skills->Delete(words.name);
  if (!done) return Fail(done.error());
  if (words.format == "json") {
    Print({{"deleted", words.name}});
  } else {
    std::cout << "skill " << words.name << " is deleted; its trials stay\n";
  }
  return 0;
}

int Export(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<std::string> document = clients->skills->ExportJson(words.name, words.version);
  if (!document) return Fail(document.error());
  const Status written = Write(*document, words.output);
  return written ? 0 : Fail(written.error());
}

/// Adds a command on one skill.
Command AddOne(Command& skill, const std::string& name, const std::string& summary,
               const std::vector<std::string>& examples, const std::shared_ptr<Words>& words) {
  Command command = skill.Add(name, summary, examples);
  command.Argument("NAME", words->name, "of the skill").Completes(Names::kSkills);
  return command;
}

void AddVersion(Command& command, Words& words) {
  command.Option("--version", "N", words.version, "which version (default: the current one)");
}

}  // namespace

void AddSkillCommands(Command& root, const Session& session) {
  Command skill = root.Add("skill", "Skills: learned from trials, asked for motions");

  auto words = std::make_shared<Words>();
  Command command = AddOne(
      skill, "learn",
      "Learns a skill's next version from all of its trials; prints what was found.\n\n"
      "Options: method=auto|paper|frames, selection=vote|joint, rule=twitch|literal,\n"
      "force_rate=absolute|signed, alignment=markers|elastic, threshold=trial|local,\n"
      "cues=orientation,extrema, joints=suit|measured, target=OBJECT, leave_out=TRIAL,..., "
      "sample_rate_hz, cutoff_hz,\n"
      "frames. Every default works without them. Ctrl-C stops and changes nothing.",
      {"exemplar skill learn press", "exemplar skill learn press --option method=paper"}, words);
  command.Option("--option", "NAME=VALUE", words->options, "may be given several times");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Learn(session, *words); });

  words = std::make_shared<Words>();
  command = skill.Add("list", "Lists all skills", {"exemplar skill list --format json"});
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return List(session, *words); });

  words = std::make_shared<Words>();
  command = AddOne(skill, "show", "Shows what learning found: trials, markers, methods, warnings",
                   {"exemplar skill show press", "exemplar skill show press --version 2",
                    "exemplar skill show press --figures figures"},
                   words);
  AddVersion(command, *words);
  AddFormat(command, words->format, {"text", "json"});
  command.Option("--figures", "DIR", words->figures,
                 "also draw the paper's Figs. 4 to 14 for it: SVG files and index.html");
  command.Runs([&session, words] { return Show(session, *words); });

  words = std::make_shared<Words>();
  command = AddOne(skill, "versions", "Lists a skill's versions, oldest first",
                   {"exemplar skill versions press"}, words);
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Versions(session, *words); });

  words = std::make_shared<Words>();
  command = AddOne(
      skill, "suggest",
      "Says where to demonstrate next\n\n"
      "Places of the object, among the trials' and between them, at which the skill's answer "
      "is\n"
      "least certain; metres, in the robot's base frame.",
      {"exemplar skill suggest press", "exemplar skill suggest press --count 5"}, words);
  AddVersion(command, *words);
  command.Option("--count", "N", words->count, "how many places, 1 to 20 (default: 3)");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Suggest(session, *words); });

  words = std::make_shared<Words>();
  command = AddOne(skill, "rollback", "Makes another version the current one; nothing is lost",
                   {"exemplar skill rollback press --version 1"}, words);
  command.Option("--version", "N", words->version, "as versions lists them").Required();
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Rollback(session, *words); });

  words = std::make_shared<Words>();
  command = AddOne(skill, "delete", "Deletes a skill with all of its versions; its trials stay",
                   {"exemplar skill delete press"}, words);
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Delete(session, *words); });

  words = std::make_shared<Words>();
  command = AddOne(skill, "export", "Writes the whole skill, alignment and all, as JSON",
                   {"exemplar skill export press --output press.json"}, words);
  AddVersion(command, *words);
  command.Option("--output", "FILE", words->output, "default: standard output");
  command.Runs([&session, words] { return Export(session, *words); });

  AddMotionCommands(skill, session);
}

}  // namespace exemplar::cli
