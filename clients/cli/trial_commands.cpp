#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

struct SubmitWords {
  std::string skill, person;
  std::vector<std::string> files;
  std::string format;
};

/// All files are tried; the exit code is that of the first that failed.
int Submit(const Session& session, const SubmitWords& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  int code = 0;
  nlohmann::json submitted = nlohmann::json::array();
  for (const std::string& path : words.files) {
    Result<std::string> file = ReadFile(path);
    const Result<api::SubmitResult> result =
        file ? clients->trials->Submit(words.skill, FileName(path), *std::move(file), words.person)
             : Result<api::SubmitResult>(file.error());
    if (!result) {
      const int failed = Fail(result.error());
      if (code == 0) code = failed;
      // The others would fail alike.
      const ErrorCode why = result.error().code;
      if (why == ErrorCode::kUnavailable || why == ErrorCode::kUnauthenticated ||
          why == ErrorCode::kPermissionDenied) {
        break;
      }
      continue;
    }
    if (words.format == "json") {
      nlohmann::json trial = ToJson(result->info);
      trial["duplicate"] = result->duplicate;
      submitted.push_back(std::move(trial));
      continue;
    }
    std::cout << result->info.id << std::endl;
    if (result->duplicate) std::cerr << path << ": was there already\n";
    for (const std::string& notice : result->info.notices)
      std::cerr << "notice: " << notice << '\n';
  }
  if (words.format == "json") Print(submitted);
  return code;
}

int List(const Session& session, const std::string& skill, const std::string& person,
         const std::string& format) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<std::vector<api::TrialInfo>> trials = clients->trials->List(skill, person);
  if (!trials) return Fail(trials.error());
  if (format == "json") {
    nlohmann::json list = nlohmann::json::array();
    for (const api::TrialInfo& info : *trials) list.push_back(ToJson(info));
    Print(list);
    return 0;
  }
  if (trials->empty()) Hint("no trials yet: `exemplar trial submit --skill NAME FILE...`");
  Table table({"TRIAL", "SKILL", "PERSON", "SECONDS", "SAMPLES", "NOTICES", "SUBMITTED", "SOURCE"});
  for (const api::TrialInfo& info : *trials) {
    table.Add({info.id, info.skill, info.person, FormatFixed(info.duration_s, 2),
               std::to_string(info.samples), std::to_string(info.notices.size()),
               TimeText(info.submitted), info.source});
  }
  std::cout << table.Text();
  return 0;
}

int Show(const Session& session, const std::string& id, const std::string& format) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<api::TrialInfo> info = clients->trials->Get(id);
  if (!info) return Fail(info.error());
  if (format == "json") {
    Print(ToJson(*info));
    return 0;
  }
  std::cout << "trial      " << info->id << "\nskill      " << info->skill << "\nsource     "
            << info->source << "\nperson     " << (info->person.empty() ? "unknown" : info->person)
            << "\nsubmitted  " << TimeText(info->submitted) << "\nduration   "
            << FormatFixed(info->duration_s, 3) << " s\nsamples    " << info->samples
            << "\nstreams    " << Join(info->streams, ", ") << '\n';
  for (const std::string& notice : info->notices) std::cout << "notice     " << notice << '\n';
  return 0;
}

struct SegmentsWords {
  std::string trial;
  std::vector<std::string> options;
  std::string format;
};

bool LooksLikePath(const std::string& word) {
  return word.find('/') != std::string::npos || word.find('.') != std::string::npos;
}

Result<api::TrialSegments> FetchSegments(api::TrialApi& trials, const std::string& trial,
                                         const std::map<std::string, std::string>& options) {
  if (!std::filesystem::exists(trial) && !LooksLikePath(trial)) {
    return trials.Segments(trial, options);
  }
  Result<std::string> file = ReadFile(trial);
  if (!file) return file.error();
  return trials.SegmentsOfFile(FileName(trial), *std::move(file), options);
}

int Segments(const Session& session, const SegmentsWords& words) {
  const auto options = ParsePairs(words.options, "--option");
  if (!options) return FailUsage(options.error());
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<api::TrialSegments> segments =
      FetchSegments(*clients->trials, words.trial, *options);
  if (!segments) return Fail(segments.error());
  if (words.format == "json") {
    Print(ToJson(*segments));
    return 0;
  }
  const learning::Segmentation& found = segments->segmentation;
  const auto kind = [](const learning::Marker& marker) {
    return marker.kind == learning::MarkerKind::kBeginning ? "beginning" : "ending";
  };
  if (words.format == "csv") {
    std::string csv = "time_s,cause,score,kind,frame\n";
    for (const learning::Marker& marker : found.markers) {
      csv += FormatDouble(marker.time_s) + ',' + marker.cause + ',' + FormatDouble(marker.score) +
             ',' + kind(marker) + ',' + std::to_string(marker.frame) + '\n';
    }
    std::cout << csv;
    return 0;
  }
  std::cout << "c = " << FormatFixed(found.c, 6) << (found.c_replaced ? " (from the data)" : "")
            << ", k = " << FormatFixed(found.k, 2)
            << ", c_tactile = " << FormatFixed(found.c_tactile, 6) << '\n';
  Table table({"SECONDS", "KIND", "CAUSE", "SCORE"});
  for (const learning::Marker& marker : found.markers) {
    table.Add(
        {FormatFixed(marker.time_s, 3), kind(marker), marker.cause, FormatFixed(marker.score, 2)});
  }
  std::cout << table.Text();
  return 0;
}

int Export(const Session& session, const std::string& id, const std::string& output) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<std::string> csv = clients->trials->ExportCsv(id);
  if (!csv) return Fail(csv.error());
  const Status written = Write(*csv, output);
  return written ? 0 : Fail(written.error());
}

/// All are tried; the exit code is that of the first that failed.
int Delete(const Session& session, const std::vector<std::string>& ids, const std::string& format) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  int code = 0;
  std::vector<std::string> deleted;
  for (const std::string& id : ids) {
    if (const Status done = clients->trials->Delete(id); !done) {
      const int failed = Fail(done.error());
      if (code == 0) code = failed;
      continue;
    }
    deleted.push_back(id);
    if (format != "json") std::cout << id << " is deleted\n";
  }
  if (format == "json") Print({{"deleted", deleted}});
  return code;
}

int SetPerson(const Session& session, const std::string& id, const std::string& person,
              const std::string& format) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Status set = clients->trials->SetPerson(id, person);
  if (!set) return Fail(set.error());
  if (format == "json") {
    Print({{"id", id}, {"person", person}});
  } else {
    std::cout << id << ": "
              << (person.empty() ? "nobody knows whose it is" : "demonstrated by " + person)
              << '\n';
  }
  return 0;
}

}  // namespace

void AddTrialCommands(Command& root, const Session& session) {
  Command trial = root.Add("trial", "Demonstrations: CSV or MCAP files, kept for skills");

  const auto submit = std::make_shared<SubmitWords>();
  Command command = trial.Add(
      "submit",
      "Stores trial files for a skill; prints their ids.\n\n"
      "A CSV file has one row a sample, a header, SI units: time_s; <joint>_rad (or _m);\n"
      "<joint>_rad_measured where a robot followed a suit;\n"
      "ee_x_m ee_y_m ee_z_m ee_qx ee_qy ee_qz ee_qw; object_<name>_x_m ... object_<name>_qw;\n"
      "hand_<name>_open; tactile_<sensor>_n; wrench_fx_n ... wrench_tz_nm; label. Only time_s and\n"
      "one of joints or end effector are needed. Poses are in the robot's base frame. The same\n"
      "trial twice in one skill is one trial.",
      {"exemplar trial submit --skill press trial1.csv trial2.csv",
       "exemplar trial submit --skill press recordings/*.mcap --format json"});
  command.Option("--skill", "NAME", submit->skill, "the skill that the trials show")
      .Required()
      .Completes(Names::kSkills);
  command.Option("--person", "ID", submit->person,
                 "whose demonstrations they are (default: as a recording says)");
  command.Arguments("FILE", submit->files, "CSV or MCAP");
  AddFormat(command, submit->format, {"text", "json"});
  command.Runs([&session, submit] { return Submit(session, *submit); });

  struct Words {
    std::string name, person, format, output;
    std::vector<std::string> names;
  };
  const auto list = std::make_shared<Words>();
  command = trial.Add("list", "Lists the trials of a skill, or of all",
                      {"exemplar trial list --skill press", "exemplar trial list --person user03"});
  command.Option("--skill", "NAME", list->name, "only this skill's").Completes(Names::kSkills);
  command.Option("--person", "ID", list->person, "only this person's");
  AddFormat(command, list->format, {"text", "json"});
  command.Runs([&session, list] { return List(session, list->name, list->person, list->format); });

  const auto show = std::make_shared<Words>();
  command = trial.Add("show", "Shows what one trial holds and what was mended in it",
                      {"exemplar trial show trial-0f3c5a7be1d20496"});
  command.Argument("ID", show->name, "as submit printed it");
  AddFormat(command, show->format, {"text", "json"});
  command.Runs([&session, show] { return Show(session, show->name, show->format); });

  const auto segments = std::make_shared<SegmentsWords>();
  command = trial.Add(
      "segments",
      "Shows the candidate markers (episode boundaries) of one trial, with cause and score",
      {"exemplar trial segments trial1.csv --format text",
       "exemplar trial segments trial1.csv --option threshold=local --option cues=extrema",
       "exemplar trial segments trial-0f3c5a7be1d20496 --option rule=literal"});
  command.Argument("FILE|ID", segments->trial, "a file here (it is sent), or a stored trial");
  command.Option("--option", "NAME=VALUE", segments->options,
                 "as skill learn takes them; may be given several times");
  AddFormat(command, segments->format, {"csv", "json", "text"});
  command.Runs([&session, segments] { return Segments(session, *segments); });

  const auto exported = std::make_shared<Words>();
  command = trial.Add("export", "Writes a stored trial as CSV",
                      {"exemplar trial export trial-0f3c5a7be1d20496 --output trial.csv"});
  command.Argument("ID", exported->name, "as submit printed it");
  command.Option("--output", "FILE", exported->output, "default: standard output");
  command.Runs([&session, exported] { return Export(session, exported->name, exported->output); });

  const auto deleted = std::make_shared<Words>();
  command = trial.Add(
      "delete", "Deletes trials. Skills learned from them stay as they are until learned anew",
      {"exemplar trial delete trial-0f3c5a7be1d20496"});
  command.Arguments("ID", deleted->names, "as submit printed them");
  AddFormat(command, deleted->format, {"text", "json"});
  command.Runs([&session, deleted] { return Delete(session, deleted->names, deleted->format); });

  const auto owned = std::make_shared<Words>();
  command = trial.Add(
      "set-person",
      "Says whose demonstration a trial is: a stored one, or one that a skill was learned from",
      {"exemplar trial set-person trial-0f3c5a7be1d20496 user03",
       "exemplar trial set-person trial-0f3c5a7be1d20496"});
  command.Argument("ID", owned->name, "as submit printed it");
  command.OptionalArgument("PERSON", owned->person, "a pseudonymous id; none: unknown");
  AddFormat(command, owned->format, {"text", "json"});
  command.Runs(
      [&session, owned] { return SetPerson(session, owned->name, owned->person, owned->format); });
}

}  // namespace exemplar::cli
