#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "data_services.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/program/runtime.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

struct Words {
  std::string person, only, format;
  bool yes = false;
  bool dry_run = false;
};

/// Of both services together.
struct Figures {
  std::uint64_t trials = 0;
  std::uint64_t recordings = 0;
  std::uint64_t bytes = 0;
  Stamp first;
  Stamp last;
};

void Add(const api::PersonInfo& info, bool recordings, Figures& sum) {
  (recordings ? sum.recordings : sum.trials) += info.items;
  sum.bytes += info.bytes;
  if (info.items == 0) return;
  sum.first = sum.first == Stamp() ? info.first : std::min(sum.first, info.first);
  sum.last = std::max(sum.last, info.last);
}

int List(const Session& session, const Words& words) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  std::map<std::string, Figures> persons;
  std::vector<std::string> missing;
  std::optional<Error> failure;
  std::size_t heard = 0;
  for (const DataService& service : DataServices(*clients, words.only)) {
    const Result<std::vector<api::PersonInfo>> list = service.api->ListPersons();
    if (!list) {
      if (!failure || IsNotServed(*failure)) failure = list.error();
      missing.push_back(service.name + " is not in this list: " + list.error().message);
      continue;
    }
    ++heard;
    for (const api::PersonInfo& info : *list) {
      Add(info, service.name == "recorder", persons[info.person]);
    }
  }
  if (heard == 0) return Fail(*failure);
  Warn(missing);
  if (words.format == "json") {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& [person, sum] : persons) {
      list.push_back({{"person", person},
                      {"trials", sum.trials},
                      {"recordings", sum.recordings},
                      {"bytes", sum.bytes},
                      {"first", ToIso8601(sum.first)},
                      {"last", ToIso8601(sum.last)}});
    }
    Print(list);
  } else {
    Table table({"PERSON", "TRIALS", "RECORDINGS", "MB", "FIRST", "LAST"});
    for (const auto& [person, sum] : persons) {
      table.Add({person.empty() ? "(unknown)" : person, std::to_string(sum.trials),
                 std::to_string(sum.recordings),
                 FormatFixed(1e-6 * static_cast<double>(sum.bytes), 2), TimeText(sum.first),
                 TimeText(sum.last)});
    }
    std::cout << table.Text();
  }
  // One that this server does not serve is no failure; one that does not answer is.
  return failure && !IsNotServed(*failure) ? program::ExitCode(failure->code) : 0;
}

using Reports = std::vector<std::pair<std::string, api::DataReport>>;

void PrintReports(const Words& words, const Reports& reports) {
  if (words.format == "json") {
    nlohmann::json services = nlohmann::json::array();
    for (const auto& [service, report] : reports) {
      nlohmann::json json = ToJson(report);
      json["service"] = service;
      services.push_back(std::move(json));
    }
    Print({{"dry_run", words.dry_run}, {"services", services}});
    return;
  }
  for (const auto& [service, report] : reports) std::cout << ReportText(service, report);
}

/// Asks on the terminal; a signal is a no.
bool Agreed(const std::string& person, const std::stop_token& stop) {
  std::cerr << "Erase all of this? It cannot be undone. Type the person's id: " << std::flush;
  const int stopped = eventfd(0, EFD_CLOEXEC);
  const std::stop_callback wake(stop, [stopped] { eventfd_write(stopped, 1); });
  std::array<pollfd, 2> both = {{{STDIN_FILENO, POLLIN, 0}, {stopped, POLLIN, 0}}};
  while (poll(both.data(), both.size(), -1) < 0 && errno == EINTR) continue;
  close(stopped);
  if (stop.stop_requested()) return false;
  std::string typed;
  std::getline(std::cin, typed);
  return Trim(typed) == person;
}

int Erase(const Session& session, const Words& words) {
  if (const Status valid = api::CheckPerson(words.person, "ID"); !valid) {
    return FailUsage(valid.error());
  }
  const program::Signals signals;
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const std::vector<DataService> services = DataServices(*clients, words.only);
  // First what there is, in every service: where one does not answer, none is begun with.
  Reports foreseen;
  std::size_t items = 0;
  for (const DataService& service : services) {
    Result<api::DataReport> report =
        service.api->Erase({.person = words.person, .dry_run = true}, {}, signals.token());
    if (!report) {
      return FailOrInterrupted(
          WithPlace(OfService(report.error(), service.name), "nothing was erased"), signals.token(),
          "nothing was erased");
    }
    items += report->items.size();
    foreseen.emplace_back(service.name, *std::move(report));
  }
  if (words.dry_run) PrintReports(words, foreseen);
  if (!words.dry_run && items > 0 && !words.yes) {
    if (!IsTerminal(STDERR_FILENO) || isatty(STDIN_FILENO) == 0) {
      return FailUsage(
          InvalidArgument("nobody can be asked here: say --yes, or --dry-run", "--yes"));
    }
    for (const auto& [service, report] : foreseen) std::cerr << ReportText(service, report);
    if (!Agreed(words.person, signals.token())) {
      if (signals.token().stop_requested()) return Interrupted("nothing was erased");
      std::cerr << "nothing was erased\n";
      return program::ExitCode(ErrorCode::kCancelled);
    }
  }
  Reports done;
  ProgressDisplay display;
  // Also where nothing is found: each service keeps the erasure in mind for restoring, and finishes
  // what a former one has left.
  for (const DataService& service : services) {
    if (words.dry_run) break;
    Result<api::DataReport> report = service.api->Erase(
        {.person = words.person},
        [&](double fraction, std::string_view step) { display.Show(fraction, step, service.name); },
        signals.token());
    display.Clear();
    if (!report) {
      PrintReports(words, done);
      return FailOrInterrupted(WithPlace(OfService(report.error(), service.name),
                                         "the erasure is not complete; run it again"),
                               signals.token(), "the erasure is not complete; run it again");
    }
    items += report->items.size();
    done.emplace_back(service.name, *std::move(report));
  }
  if (!words.dry_run) PrintReports(words, done);
  if (items == 0) {
    return Fail(NotFound("nothing is kept of \"" + words.person + "\"", "ID"));
  }
  std::cerr
      << (words.dry_run ? "nothing was erased; " : "")
      << "backups made before hold this person still; `restore` leaves erased people out where "
         "the services, or a newer backup (--erased-in), know of the erasure\n";
  return 0;
}

}  // namespace

void AddPersonCommands(Command& root, const Session& session) {
  Command person = root.Add("person", "Whose demonstrations there are, and erasing them");

  const auto list = std::make_shared<Words>();
  Command command =
      person.Add("list", "Lists whose trials and recordings there are", {"exemplar person list"});
  AddOnly(command, list->only);
  AddFormat(command, list->format, {"text", "json"});
  command.Runs([&session, list] { return List(session, *list); });

  const auto erase = std::make_shared<Words>();
  command = person.Add(
      "erase",
      "Erases one person's recordings and trials, and every skill version learned from them.\n\n"
      "A skill whose current version goes is learned anew from its other trials where that can be\n"
      "done. The database is rewritten, so that nothing is left in its free pages. Shows what\n"
      "there is and asks first. What broke off is finished by running it again.",
      {"exemplar person erase user03 --dry-run", "exemplar person erase user03 --yes"});
  command.Argument("ID", erase->person, "as `person list` shows it");
  command.Flag("--yes", erase->yes, "do not ask");
  command.Flag("--dry-run", erase->dry_run, "only show what would be done");
  AddOnly(command, erase->only);
  AddFormat(command, erase->format, {"text", "json"});
  command.Runs([&session, erase] { return Erase(session, *erase); });
}

}  // namespace exemplar::cli
