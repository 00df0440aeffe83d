#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "data_services.hpp"
#include "exemplar/backup/backup_file.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/program/runtime.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

constexpr double kMega = 1e-6;

struct Words {
  std::string file, only, format, erased_in;
  bool recordings = false;
  bool merge = false;
  bool replace = false;
  bool dry_run = false;
  bool needed_too = false;
  std::optional<double> keep_days, keep_versions_days;

  /// Of the services, for a backup; empty: all.
  std::string Chosen() const {
    if (!only.empty()) return only;
    return recordings ? "" : "learning";
  }
};

backup::BytesProgress Showing(ProgressDisplay& display, std::string step) {
  return [&display, step = std::move(step)](std::uint64_t done, std::uint64_t all) {
    const double fraction = all > 0 ? static_cast<double>(done) / static_cast<double>(all) : 0;
    display.Show(fraction, step,
                 FormatFixed(kMega * static_cast<double>(done), 0) + " of " +
                     FormatFixed(kMega * static_cast<double>(all), 0) + " MB");
  };
}

nlohmann::json ToJson(const backup::Manifest& manifest) {
  nlohmann::json services = nlohmann::json::array();
  for (const api::BackupPlan& plan : manifest.services) {
    services.push_back({{"service", plan.service},
                        {"schema", plan.schema},
                        {"parts", plan.parts},
                        {"bytes", plan.bytes},
                        {"counts", plan.counts},
                        {"notices", plan.notices}});
  }
  return {
      {"made", ToIso8601(manifest.made)}, {"program", manifest.program}, {"services", services}};
}

void PrintManifest(const Words& words, const backup::Manifest& manifest) {
  if (words.format == "json") {
    nlohmann::json json = ToJson(manifest);
    json["file"] = words.file;
    Print(json);
    return;
  }
  for (const api::BackupPlan& plan : manifest.services) {
    std::cout << plan.service << ": " << FormatFixed(kMega * static_cast<double>(plan.bytes), 2)
              << " MB";
    for (const auto& [name, count] : plan.counts) std::cout << ", " << count << ' ' << name;
    std::cout << '\n';
    for (const std::string& notice : plan.notices) std::cout << "  " << notice << '\n';
  }
  std::cout << "made " << TimeText(manifest.made) << " by exemplar " << manifest.program << '\n';
}

int Create(const Session& session, const Words& words) {
  if (words.file.empty()) return FailUsage(InvalidArgument("FILE is missing", "FILE"));
  const program::Signals signals;
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const auto writer = backup::Writer::Create(words.file, SystemClock().Now(), program::Version());
  if (!writer) return Fail(writer.error());
  ProgressDisplay display;
  for (const DataService& service : DataServices(*clients, words.Chosen())) {
    const auto sink = (*writer)->NextService(Showing(display, "copying " + service.name));
    const Status copied = service.api->Backup(*sink, signals.token());
    display.Clear();
    if (!copied) {
      return FailOrInterrupted(OfService(copied.error(), service.name), signals.token(),
                               "there is no " + words.file);
    }
  }
  const Result<backup::Manifest> manifest = (*writer)->Finish();
  if (!manifest) return Fail(manifest.error());
  PrintManifest(words, *manifest);
  return 0;
}

Result<backup::Manifest> VerifyShown(const std::string& file) {
  ProgressDisplay display;
  Result<backup::Manifest> manifest = backup::Verify(file, Showing(display, "verifying"));
  display.Clear();
  return manifest;
}

int Verify(const Words& words) {
  const Result<backup::Manifest> manifest = VerifyShown(words.file);
  if (!manifest) return Fail(manifest.error());
  PrintManifest(words, *manifest);
  return 0;
}

/// How many of a kind had something done.
std::string Summary(const std::string& service, const api::DataReport& report) {
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  std::string text;
  for (const api::DataItem& item : report.items) {
    ++counts[{item.kind, item.action}];
    if (item.action == "restored") continue;
    text += service + ": " + item.kind + " " + item.name + " " + item.action;
    text += item.detail.empty() ? "\n" : " (" + item.detail + ")\n";
  }
  for (const auto& [what, count] : counts) {
    text += service + ": " + std::to_string(count) + " x " + what.first + " " + what.second + '\n';
  }
  for (const std::string& notice : report.notices) text += service + ": " + notice + '\n';
  return text;
}

int Restore(const Session& session, const Words& words) {
  if (words.merge && words.replace) {
    return FailUsage(InvalidArgument("--merge and --replace exclude each other", "--merge"));
  }
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<backup::Manifest> manifest = VerifyShown(words.file);
  if (!manifest) return Fail(manifest.error());
  api::RestoreRequest request;
  request.mode = words.merge     ? api::RestoreMode::kMerge
                 : words.replace ? api::RestoreMode::kReplace
                                 : api::RestoreMode::kEmptyOnly;
  if (!words.erased_in.empty()) {
    const Result<backup::Manifest> newer = VerifyShown(words.erased_in);
    if (!newer) return Fail(newer.error());
    auto erased = backup::ReadErased(words.erased_in, *newer);
    if (!erased) return Fail(erased.error());
    request.erased = *std::move(erased);
  }
  ProgressDisplay display;
  nlohmann::json services = nlohmann::json::array();
  for (const DataService& service : DataServices(*clients, words.only)) {
    const api::BackupPlan* plan = manifest->Find(service.name);
    if (plan == nullptr) {
      if (words.only.empty()) continue;
      return Fail(NotFound(words.file + " holds nothing of " + service.name, "--only"));
    }
    request.plan = *plan;
    const auto source = backup::OpenService(words.file, *manifest, service.name,
                                            Showing(display, "restoring " + service.name));
    if (!source) return Fail(source.error());
    const Result<api::DataReport> report = service.api->Restore(request, **source);
    display.Clear();
    if (!report) return Fail(OfService(report.error(), service.name));
    if (words.format == "json") {
      nlohmann::json json = cli::ToJson(*report);
      json["service"] = service.name;
      services.push_back(std::move(json));
    } else {
      std::cout << Summary(service.name, *report);
    }
  }
  if (words.format == "json") Print({{"services", services}});
  return 0;
}

int Retain(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  int code = 0;
  std::size_t heard = 0;
  std::vector<std::string> missing;
  nlohmann::json services = nlohmann::json::array();
  for (const DataService& service : DataServices(*clients, words.only)) {
    const Result<api::DataReport> report =
        service.api->ApplyRetention({.dry_run = words.dry_run,
                                     .keep_days = words.keep_days,
                                     .keep_versions_days = words.keep_versions_days,
                                     .needed_too = words.needed_too});
    if (!report && IsNotServed(report.error()) && words.only.empty()) {
      missing.push_back(service.name + ": " + report.error().message);
      continue;
    }
    ++heard;
    if (!report) {
      code = Fail(WithPlace(report.error(), service.name));
    } else if (words.format == "json") {
      nlohmann::json json = cli::ToJson(*report);
      json["service"] = service.name;
      services.push_back(std::move(json));
    } else {
      std::cout << ReportText(service.name, *report);
    }
  }
  Warn(missing);
  if (words.format == "json") Print({{"dry_run", words.dry_run}, {"services", services}});
  return heard > 0 ? code : program::ExitCode(ErrorCode::kUnimplemented);
}

void AddRetention(Command& root, const Session& session) {
  Command retention = root.Add("retention", "What goes once it is old");
  const auto add = [&](const std::string& name, const std::string& summary, bool dry_run) {
    const auto words = std::make_shared<Words>();
    words->dry_run = dry_run;
    Command command = retention.Add(
        name, summary,
        {"exemplar retention " + name, "exemplar retention " + name + " --keep-days 365"});
    command.Option("--keep-days", "DAYS", words->keep_days,
                   "of trials and recordings, in place of the services' own settings");
    command.Option("--keep-versions-days", "DAYS", words->keep_versions_days,
                   "of former skill versions, likewise");
    command.Flag("--expire-needed-trials", words->needed_too,
                 "trials that a current skill version was learned from go as well");
    AddOnly(command, words->only);
    AddFormat(command, words->format, {"text", "json"});
    command.Runs([&session, words] { return Retain(session, *words); });
  };
  add("show", "Shows what would go now", true);
  add("apply", "Takes out what is too old; services do it by themselves each hour where set",
      false);
}

}  // namespace

void AddBackupCommands(Command& root, const Session& session) {
  const auto made = std::make_shared<Words>();
  Command command = root.Add(
      "backup",
      "Copies trials, skills and reports into one file, while the services go on.\n\n"
      "The file is a tar archive; its manifest.json names each part with its SHA-256. It gets its\n"
      "name once it is whole.",
      {"exemplar backup station-2026-11-22.tar", "exemplar backup all.tar --recordings",
       "exemplar backup verify station-2026-11-22.tar"});
  const auto verified = std::make_shared<Words>();
  Command verify = command.Add("verify", "Reads all of a backup and compares it with its manifest",
                               {"exemplar backup verify station-2026-11-22.tar"});
  verify.Argument("FILE", verified->file, "a backup");
  AddFormat(verify, verified->format, {"text", "json"});
  verify.Runs([verified] { return Verify(*verified); });
  command.OptionalArgument("FILE", made->file, "gets the backup; must not be there");
  command.Flag("--recordings", made->recordings, "the recorder's recordings as well");
  AddOnly(command, made->only);
  AddFormat(command, made->format, {"text", "json"});
  command.Runs([&session, made] { return Create(session, *made); });

  const auto restored = std::make_shared<Words>();
  command = root.Add(
      "restore",
      "Puts a backup back into empty services; all or nothing.\n\n"
      "People who were erased after their trials came are left out, with what was learned from\n"
      "them: those whom the services, the backup or --erased-in know.",
      {"exemplar restore station-2026-11-22.tar",
       "exemplar restore old.tar --replace --erased-in new.tar"});
  command.Argument("FILE", restored->file, "a backup");
  command.Flag("--merge", restored->merge,
               "add what is not there; trials and skills that are there stay as they are");
  command.Flag("--replace", restored->replace, "take out what is there first");
  command.Option("--erased-in", "FILE", restored->erased_in,
                 "a newer backup that knows who was erased since");
  AddOnly(command, restored->only);
  AddFormat(command, restored->format, {"text", "json"});
  command.Runs([&session, restored] { return Restore(session, *restored); });

  AddRetention(root, session);
}

}  // namespace exemplar::cli
