#include "exemplar/diagnosis/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "endpoints.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::diagnosis {
namespace {

using ircp::SeenParticipant;

constexpr double kOffsetToMention_s = 0.02;
constexpr double kOffsetToRefuse_s = 1.0;

class Judge {
 public:
  explicit Judge(const Evidence& evidence) : evidence_(evidence), names_(evidence) {
    for (const SeenParticipant& one : evidence.discovery.participants) {
      (one.domain == evidence.domain ? here_ : elsewhere_).push_back(&one);
    }
  }

  Diagnosis Run() {
    JudgeNames();
    JudgeDomains();
    JudgeStations();
    DiagnoseEndpoints(evidence_, names_, diagnosis_);
    JudgeSecurity();
    JudgeTransport();
    JudgeClocks();
    JudgeServices();
    JudgeVersions();
    JudgePair();
    std::stable_sort(diagnosis_.findings.begin(), diagnosis_.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
    return std::move(diagnosis_);
  }

 private:
  void Tell(Severity severity, const std::string& cause, std::string what, std::string remedy,
            std::vector<std::string> participants = {}) {
    diagnosis_.findings.push_back({.severity = severity,
                                   .cause = cause,
                                   .what = std::move(what),
                                   .remedy = std::move(remedy),
                                   .participants = std::move(participants)});
  }

  std::vector<std::string> NamesOf(const std::vector<const SeenParticipant*>& list) const {
    std::set<std::string> names;
    for (const SeenParticipant* one : list) names.insert(names_.Of(one->id));
    return {names.begin(), names.end()};
  }

  /// Participants that are asked about must be there.
  void JudgeNames() {
    for (const std::string& asked : evidence_.names) {
      std::vector<std::string> known;
      bool found = false;
      for (const SeenParticipant& one : evidence_.discovery.participants) {
        found = found || IsCalled(one.name, asked);
        if (!one.name.empty()) known.push_back(one.name);
      }
      if (found) continue;
      std::string remedy = "Start it, and look at its log.";
      if (const auto nearest = NearestName(asked, known)) {
        remedy = "Did you mean \"" + *nearest + "\"?";
      } else if (!known.empty()) {
        remedy += " There are " + Listed(known, 8) + ".";
      }
      Tell(Severity::kProblem, "participant", "no participant is called \"" + asked + "\"", remedy,
           {asked});
    }
  }

  void JudgeDomains() {
    if (elsewhere_.empty()) {
      if (here_.empty() && evidence_.names.empty()) {
        Tell(Severity::kProblem, "domain",
             "nobody is in domain " + std::to_string(evidence_.domain) + ", and no other is heard",
             "Start the programs; with several machines, see whether multicast passes between them "
             "(--peer or --discovery-server help where it does not).");
      }
      return;
    }
    std::map<int, std::vector<const SeenParticipant*>> by_domain;
    for (const SeenParticipant* one : elsewhere_) {
      if (names_.Asked(one->id)) by_domain[one->domain].push_back(one);
    }
    for (const auto& [domain, list] : by_domain) {
      // Two that were asked for and do not share a domain never meet.
      const bool apart =
          here_.empty() ||
          (evidence_.names.size() > 1 &&
           std::any_of(here_.begin(), here_.end(),
                       [this](const SeenParticipant* one) { return names_.Asked(one->id); }));
      const std::vector<std::string> names = NamesOf(list);
      Tell(apart ? Severity::kProblem : Severity::kNote, "domain",
           Listed(names) + (names.size() == 1 ? " is" : " are") + " in domain " +
               std::to_string(domain) + ", not in " + std::to_string(evidence_.domain) +
               (here_.empty() ? ", where nobody is" : ""),
           "Start all programs that shall meet with the same --domain.", names);
    }
  }

  void JudgeStations() {
    std::map<std::string, std::set<std::string>> by_station;
    for (const ircp::SeenEndpoint& endpoint : evidence_.discovery.endpoints) {
      if (endpoint.domain != evidence_.domain) continue;
      for (const std::string& name : endpoint.partitions) {
        by_station[name].insert(names_.Of(endpoint.participant));
      }
    }
    if (by_station.empty() || by_station.count(evidence_.station) != 0) return;
    std::vector<std::string> others;
    others.reserve(by_station.size());
    for (const auto& entry : by_station) others.push_back('"' + entry.first + '"');
    Tell(evidence_.names.empty() ? Severity::kProblem : Severity::kNote, "station",
         "nobody is in station \"" + evidence_.station + "\" of domain " +
             std::to_string(evidence_.domain) + "; there are " + Listed(others, 8),
         "Ask with --station for one of them, or start the programs with the station's name.");
  }

  void JudgeSecurity() {
    for (const std::string& warning : evidence_.identity_warnings) {
      Tell(Severity::kWarning, "security", "the observer's identity: " + warning,
           "exemplar security list says who else is near the end (docs/security.md).");
    }
    std::vector<const SeenParticipant*> secured, open;
    for (const SeenParticipant* one : here_) {
      if (!names_.Asked(one->id)) continue;
      (one->secured ? secured : open).push_back(one);
      if (one->trust == SeenParticipant::Trust::kRefused) {
        Tell(Severity::kProblem, "security",
             names_.Of(one->id) +
                 " and this observer refuse each other: their identities are not "
                 "of one authority, have expired, or their permissions do not "
                 "name this domain",
             "Issue both identities with the same authority (exemplar security), and compare the "
             "clocks of the machines.",
             {names_.Of(one->id)});
      }
      // A refusal need not be told to the one who is refused: he only waits.
      if (evidence_.secured && one->secured && one->trust == SeenParticipant::Trust::kNotAsked) {
        Tell(Severity::kWarning, "security",
             names_.Of(one->id) +
                 " has not answered this observer's greeting: its identity is of another "
                 "authority, or it is slow",
             "Look longer (--seconds); if it stays so, issue both identities with the same "
             "authority (exemplar security).",
             {names_.Of(one->id)});
      }
    }
    if (secured.empty()) return;
    std::vector<std::string> names = NamesOf(secured);
    if (!open.empty()) {
      const std::vector<std::string> open_names = NamesOf(open);
      Tell(Severity::kProblem, "security",
           Listed(names) + (names.size() == 1 ? " talks" : " talk") +
               " only to participants with an identity, and " + Listed(open_names) +
               (open_names.size() == 1 ? " has" : " have") + " none: they never match",
           "Start all with --security, or none.", open_names);
    }
    if (!evidence_.secured) {
      Tell(Severity::kNote, "security",
           "what " + Listed(names) +
               " reads and writes is not shown to an observer without identity",
           "Give the doctor an identity with --security.", names);
    }
  }

  void JudgeTransport() {
    for (const ircp::Reachability& one : evidence_.reachability) {
      if (one.reachable || !names_.Asked(one.participant)) continue;
      const std::string& name = names_.Of(one.participant);
      const bool shared_memory = one.detail.find("shared memory") != std::string::npos;
      Tell(Severity::kProblem, "transport", name + " cannot be reached: " + one.detail,
           shared_memory
               ? "Programs in containers on one machine must share /dev/shm (--ipc), or have "
                 "networks of their own."
               : "Look at the firewall and the routes between the two machines: UDP to the ports "
                 "from 7400 on must pass both ways.",
           {name});
    }
    const auto carries = [](const ircp::SeenInterface& one) { return one.multicast; };
    const auto& interfaces = evidence_.interfaces;
    if (!interfaces.empty() && std::none_of(interfaces.begin(), interfaces.end(), carries)) {
      std::vector<std::string> why;
      why.reserve(interfaces.size());
      for (const ircp::SeenInterface& one : interfaces) why.push_back(one.name + ": " + one.detail);
      Tell(Severity::kWarning, "transport",
           "no interface of this machine carries multicast (" + Listed(why) +
               "): other machines' participants, and more than 24 on this one, are not found",
           "Let multicast to 239.255.0.1 pass, or start the programs with --peer ADDRESS or "
           "--discovery-server HOST:PORT.");
      return;
    }
    for (const ircp::SeenInterface& one : interfaces) {
      if (one.multicast || one.loopback) continue;
      Tell(Severity::kWarning, "transport",
           "multicast does not work on " + one.name + " (" + one.address + "): " + one.detail,
           "Let multicast to 239.255.0.1 pass there, or leave the interface out with --interface.");
    }
    // Announcements come by multicast, everything else by unicast.
    std::set<std::string> talkers;
    for (const ircp::SeenEndpoint& endpoint : evidence_.discovery.endpoints) {
      talkers.insert(endpoint.participant);
    }
    for (const SeenParticipant* one : here_) {
      if (one->secured || talkers.count(one->id) != 0 || !names_.Asked(one->id) ||
          one->name.ends_with("-tap")) {
        continue;
      }
      Tell(Severity::kWarning, "transport",
           names_.Of(one->id) +
               " announces itself but told of no topic: it has none, or UDP "
               "between its machine and this one passes in one direction only",
           "Look at the firewalls of both machines; then at the program's log.",
           {names_.Of(one->id)});
    }
  }

  void JudgeClocks() {
    for (const ircp::ClockRelation& clock : evidence_.clocks) {
      const double offset = ToSeconds(clock.offset);
      const double certain = std::abs(offset) - ToSeconds(clock.uncertainty);
      if (!names_.Asked(clock.participant) || certain < kOffsetToMention_s) continue;
      Tell(certain >= kOffsetToRefuse_s ? Severity::kProblem : Severity::kWarning, "clock",
           "the clock of " + clock.program + " is " + FormatFixed(std::abs(offset), 3) + " s " +
               (offset > 0 ? "ahead of" : "behind") + " this machine's",
           "Let both machines follow one time server (chrony); programs that follow simulated time "
           "must all be started with --clock network.",
           {clock.program});
    }
  }

  void JudgeServices() {
    for (const ServiceAnswer& service : evidence_.services) {
      if (!service.reachable) {
        Tell(Severity::kProblem, "service",
             "nobody answers at " + service.address +
                 (service.detail.empty() ? "" : " (" + service.detail + ")"),
             "Start the service, or give its address with --server.");
      } else if (!service.serving) {
        Tell(Severity::kProblem, "service",
             "the service at " + service.address + " is not ready: " + service.detail,
             "Look at its log.");
      }
    }
  }

  void JudgeVersions() {
    std::map<std::string, std::vector<std::string>> by_version;
    if (!evidence_.version.empty()) by_version[evidence_.version].push_back("this command");
    for (const SeenParticipant& one : evidence_.discovery.participants) {
      const auto version = one.properties.find("exemplar.version");
      if (version == one.properties.end() || !names_.Asked(one.id)) continue;
      std::vector<std::string>& list = by_version[version->second];
      if (std::find(list.begin(), list.end(), one.name) == list.end()) list.push_back(one.name);
    }
    for (const ServiceAnswer& service : evidence_.services) {
      if (!service.version.empty()) by_version[service.version].push_back(service.address);
    }
    if (by_version.size() < 2) return;
    std::vector<std::string> parts, who;
    for (const auto& [version, list] : by_version) {
      parts.push_back(version + ": " + Listed(list));
      who.insert(who.end(), list.begin(), list.end());
    }
    Tell(Severity::kWarning, "version",
         "programs of different versions are together (" + Join(parts, "; ") + ")",
         "Bring all of them to one version.", who);
  }

  /// Two that are there, with nothing in the way, and yet nothing between them.
  void JudgePair() {
    if (evidence_.names.size() < 2 || !diagnosis_.flows.empty()) return;
    const bool explained =
        std::any_of(diagnosis_.findings.begin(), diagnosis_.findings.end(),
                    [](const Finding& finding) { return finding.severity == Severity::kProblem; });
    if (explained) return;
    Tell(Severity::kWarning, "topic",
         "no topic of " + Join(evidence_.names, " and ") + " is written by one and read by another",
         "Compare what each writes and reads (docs/topics.md).", evidence_.names);
  }

  const Evidence& evidence_;
  const Names names_;
  std::vector<const SeenParticipant*> here_, elsewhere_;
  Diagnosis diagnosis_;
};

}  // namespace

std::string_view ToString(Severity severity) {
  switch (severity) {
    case Severity::kNote:
      return "note";
    case Severity::kWarning:
      return "warning";
    case Severity::kProblem:
      return "problem";
  }
  return "problem";
}

Diagnosis Diagnose(const Evidence& evidence) { return Judge(evidence).Run(); }

}  // namespace exemplar::diagnosis
