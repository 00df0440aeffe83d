#include <unistd.h>

#include <algorithm>
#include <future>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "commands.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/discovery.hpp"
#include "exemplar/diagnosis/diagnose.hpp"
#include "exemplar/ircp/clock_watch.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/health.hpp"
#include "exemplar/security/station.hpp"
#include "network_options.hpp"
#include "screen.hpp"

namespace exemplar::cli {
namespace {

using diagnosis::Evidence;
using diagnosis::Finding;
using diagnosis::Severity;

constexpr double kDefaultSeconds = 4;
/// Other domains that are looked into; of further ones only the participants' names are known.
constexpr std::size_t kMostDomains = 6;

struct Words {
  std::vector<std::string> names, services;
  std::string format;
  std::optional<double> seconds;
  bool all = false;
  NetworkWords network;
};

bool IsOwn(const ircp::SeenParticipant& participant) {
  return participant.name.starts_with("exemplar-doctor");
}

template <class... Samples>
std::map<std::string, std::string, std::less<>> SchemasOf() {
  return {{std::string(bus::TypeNameOf<Samples>()), std::string(bus::SchemaOf<Samples>())}...};
}

/// Writers carry the members of their type; of readers they are taken to be as this version has
/// them.
void AddSchemas(std::vector<ircp::SeenEndpoint>& endpoints) {
  const auto schemas =
      SchemasOf<ircp::SuitSample, ircp::EndEffectorSample, ircp::TactileSample, ircp::CameraSample,
                ircp::ObjectSample, ircp::JointStateSample, ircp::JointCommandSample,
                ircp::CommandSample, ircp::StatusSample, ircp::SafetySample, ircp::ClockSample>();
  for (ircp::SeenEndpoint& endpoint : endpoints) {
    const auto known = schemas.find(endpoint.type);
    if (!endpoint.writer && endpoint.schema.empty() && known != schemas.end()) {
      endpoint.schema = known->second;
    }
  }
}

/// Adds participants that only their announcements told of.
void AddHeard(std::vector<ircp::SeenParticipant> heard, ircp::Discovery& discovery) {
  for (ircp::SeenParticipant& one : heard) {
    const bool known =
        std::any_of(discovery.participants.begin(), discovery.participants.end(),
                    [&](const ircp::SeenParticipant& other) { return other.id == one.id; });
    if (!known) discovery.participants.push_back(std::move(one));
  }
}

/// Looks around for as long as `words` say.
Result<Evidence> Observe(const bus::ParticipantOptions& network, const Words& words,
                         const std::stop_token& stop) {
  const Duration duration = FromSeconds(words.seconds.value_or(kDefaultSeconds));
  Evidence evidence{.domain = network.domain,
                    .station = network.station,
                    .secured = !network.security.empty(),
                    .version = program::Version(),
                    .names = words.names};
  if (evidence.secured) {
    evidence.identity_warnings =
        security::MemberFolderWarnings(network.security, SystemClock().Now());
  }
  // Before there is anything of our own.
  std::set<int> domains = bus::DomainsOfThisMachine();
  domains.erase(network.domain);
  auto heard =
      std::async(std::launch::async, [&] { return bus::HearAnnouncements(duration, stop); });

  std::vector<std::unique_ptr<bus::DiscoveryObserver>> observers;
  std::set<int> observed;
  const auto look_into = [&](int domain) -> Status {
    bus::ParticipantOptions options = network;
    options.domain = domain;
    auto observer = bus::DiscoveryObserver::Create(options);
    if (!observer) return observer.error();
    observers.push_back(std::move(*observer));
    observed.insert(domain);
    return {};
  };
  Status looking = look_into(network.domain);
  for (const int domain : domains) {
    if (looking && observers.size() <= kMostDomains) looking = look_into(domain);
  }
  const SystemClock clock;
  NullLog log;
  bus::ParticipantOptions asking = network;
  asking.name += "-clock";
  const auto participant = bus::Participant::Create(asking);
  std::unique_ptr<ircp::ClockWatch> watch;
  if (participant) {
    if (auto made = ircp::ClockWatch::Create(**participant, clock, log, "doctor")) {
      watch = std::move(*made);
    }
  }
  clock.SleepFor(duration, stop);
  const Result<std::vector<ircp::SeenParticipant>> announced = heard.get();
  if (!looking) return looking.error();
  for (const auto& observer : observers) {
    ircp::Discovery now = observer->Now();
    auto& all = evidence.discovery;
    all.participants.insert(all.participants.end(), now.participants.begin(),
                            now.participants.end());
    all.endpoints.insert(all.endpoints.end(), now.endpoints.begin(), now.endpoints.end());
  }
  if (announced) AddHeard(*announced, evidence.discovery);
  if (watch != nullptr) evidence.clocks = watch->relations();

  std::set<std::string> own;
  for (const ircp::SeenParticipant& one : evidence.discovery.participants) {
    if (IsOwn(one)) own.insert(one.id);
  }
  std::erase_if(evidence.discovery.participants, IsOwn);
  std::erase_if(evidence.discovery.endpoints, [&](const ircp::SeenEndpoint& endpoint) {
    return own.count(endpoint.participant) != 0;
  });
  AddSchemas(evidence.discovery.endpoints);
  evidence.interfaces = bus::TryMulticast();
  std::vector<ircp::SeenParticipant> here;
  for (const ircp::SeenParticipant& one : evidence.discovery.participants) {
    if (one.domain == network.domain) here.push_back(one);
  }
  evidence.reachability = bus::TryToReach(here);
  return evidence;
}

diagnosis::ServiceAnswer AskService(const Session& session, const std::string& address) {
  diagnosis::ServiceAnswer answer{.address = address};
  Session asked = session;
  asked.server = address;
  constexpr double kPatienceS = 3;
  if (!asked.timeout_s) asked.timeout_s = kPatienceS;
  const Result<rpc::ClientOptions> options = asked.Options();
  const Result<bool> serving = options ? rpc::AskHealth(*options) : options.error();
  answer.reachable = serving.ok();
  answer.serving = serving.ok() && *serving;
  answer.detail = serving.ok() ? "its health service says NOT_SERVING" : serving.error().message;
  return answer;
}

nlohmann::json ToJson(const Finding& finding) {
  return {{"severity", diagnosis::ToString(finding.severity)},
          {"cause", finding.cause},
          {"what", finding.what},
          {"remedy", finding.remedy},
          {"topic", finding.topic},
          {"policy", finding.policy},
          {"participants", finding.participants}};
}

const char* NameOf(ircp::SeenParticipant::Trust trust) {
  switch (trust) {
    case ircp::SeenParticipant::Trust::kTrusted:
      return "trusted";
    case ircp::SeenParticipant::Trust::kRefused:
      return "refused";
    case ircp::SeenParticipant::Trust::kNotAsked:
      break;
  }
  return "not_asked";
}

void PrintJson(const Evidence& evidence, const diagnosis::Diagnosis& diagnosis) {
  nlohmann::json participants = nlohmann::json::array();
  for (const ircp::SeenParticipant& one : evidence.discovery.participants) {
    participants.push_back({{"name", one.name},
                            {"id", one.id},
                            {"domain", one.domain},
                            {"vendor", one.vendor},
                            {"secured", one.secured},
                            {"trust", NameOf(one.trust)},
                            {"properties", one.properties}});
  }
  nlohmann::json flows = nlohmann::json::array();
  for (const diagnosis::Flow& flow : diagnosis.flows) {
    flows.push_back(
        {{"topic", flow.topic}, {"domain", flow.domain}, {"from", flow.from}, {"to", flow.to}});
  }
  nlohmann::json findings = nlohmann::json::array();
  for (const Finding& finding : diagnosis.findings) findings.push_back(ToJson(finding));
  nlohmann::json services = nlohmann::json::array();
  for (const diagnosis::ServiceAnswer& one : evidence.services) {
    services.push_back(
        {{"address", one.address}, {"reachable", one.reachable}, {"serving", one.serving}});
  }
  nlohmann::json clocks = nlohmann::json::array();
  for (const ircp::ClockRelation& clock : evidence.clocks) {
    clocks.push_back({{"program", clock.program},
                      {"offset_s", ToSeconds(clock.offset)},
                      {"uncertainty_s", ToSeconds(clock.uncertainty)}});
  }
  Print({{"domain", evidence.domain},
         {"station", evidence.station},
         {"participants", std::move(participants)},
         {"flows", std::move(flows)},
         {"clocks", std::move(clocks)},
         {"services", std::move(services)},
         {"findings", std::move(findings)}});
}

void PrintText(const Evidence& evidence, const diagnosis::Diagnosis& diagnosis, bool all) {
  Table participants({"PARTICIPANT", "DOMAIN", "VENDOR", "VERSION", "HOST", "SECURED"});
  for (const ircp::SeenParticipant& one : evidence.discovery.participants) {
    const auto property = [&one](const char* name) {
      const auto found = one.properties.find(name);
      return found == one.properties.end() ? std::string("-") : found->second;
    };
    // "machine:number", as Fast DDS tells it of all its participants.
    const std::string host = property("fastdds.physical_data.host");
    participants.Add({one.name, std::to_string(one.domain), one.vendor,
                      property("exemplar.version"), host.substr(0, host.rfind(':')),
                      one.secured ? "yes" : "no"});
  }
  std::cout << participants.Text();
  if (diagnosis.flows.empty()) {
    std::cout << "no topic has a writer and a reader that hear each other\n";
  } else if (all || !evidence.names.empty()) {
    Table flows({"TOPIC", "FROM", "TO"});
    for (const diagnosis::Flow& flow : diagnosis.flows) {
      flows.Add({flow.topic, exemplar::Join(flow.from, ", "), exemplar::Join(flow.to, ", ")});
    }
    std::cout << '\n' << flows.Text();
  } else {
    std::cout << diagnosis.flows.size()
              << (diagnosis.flows.size() == 1 ? " topic has" : " topics have")
              << " a writer and a reader that hear each other (--all lists them)\n";
  }
  for (const Finding& finding : diagnosis.findings) {
    const Colour colour = finding.severity == Severity::kProblem   ? Colour::kRed
                          : finding.severity == Severity::kWarning ? Colour::kYellow
                                                                   : Colour::kFaint;
    std::cout << '\n'
              << Paint(diagnosis::ToString(finding.severity), colour, STDOUT_FILENO) << " ("
              << finding.cause << "): " << finding.what << "\n  " << finding.remedy << '\n';
  }
  const auto problems =
      std::count_if(diagnosis.findings.begin(), diagnosis.findings.end(),
                    [](const Finding& finding) { return finding.severity == Severity::kProblem; });
  std::cout << '\n'
            << (problems == 0
                    ? Paint("no problem found", Colour::kGreen, STDOUT_FILENO)
                    : std::to_string(problems) + (problems == 1 ? " problem" : " problems"))
            << '\n';
}

int Doctor(const Session& session, const Words& words) {
  constexpr double kMostSeconds = 600;
  if (words.seconds && !(*words.seconds >= 0.1 && *words.seconds <= kMostSeconds)) {
    return FailUsage(InvalidArgument(
        "--seconds is " + FormatDouble(*words.seconds) + ", must lie between 0.1 and 600",
        "--seconds"));
  }
  const program::Signals signals;
  const Result<bus::ParticipantOptions> network = NetworkOf(words.network, "exemplar-doctor");
  if (!network) return FailUsage(network.error());
  ProgressDisplay display;
  display.Show(0, "looking around",
               FormatDouble(words.seconds.value_or(kDefaultSeconds)) + " s, domain " +
                   std::to_string(network->domain));
  Result<Evidence> evidence = Observe(*network, words, signals.token());
  if (!evidence) {
    display.Clear();
    return evidence.error().code == ErrorCode::kInvalidArgument ? FailUsage(evidence.error())
                                                                : Fail(evidence.error());
  }
  if (signals.token().stop_requested()) {
    display.Clear();
    return Interrupted("nothing was looked at for long enough");
  }
  std::vector<std::string> services = words.services;
  if (!session.server.empty()) services.insert(services.begin(), session.server);
  for (const std::string& address : services) {
    evidence->services.push_back(AskService(session, address));
  }
  display.Clear();
  const diagnosis::Diagnosis diagnosis = diagnosis::Diagnose(*evidence);
  if (words.format == "json") {
    PrintJson(*evidence, diagnosis);
  } else {
    PrintText(*evidence, diagnosis, words.all);
  }
  const bool ill =
      std::any_of(diagnosis.findings.begin(), diagnosis.findings.end(),
                  [](const Finding& finding) { return finding.severity == Severity::kProblem; });
  return ill ? 1 : 0;
}

}  // namespace

void AddDoctorCommand(Command& root, const Session& session) {
  const auto words = std::make_shared<Words>();
  Command command = root.Add(
      "doctor",
      "Says why participants do not see or hear each other\n\n"
      "Domain, station, QoS, type, security, transport, clock, services. Looks around on this "
      "machine's\nnetwork for some seconds; exit code 1 where it finds a problem. Names limit it "
      "to "
      "what concerns them.",
      {"exemplar doctor", "exemplar doctor exemplar-recorder exemplar-capture-suit --station lab",
       "exemplar doctor --server 127.0.0.1:50051 --service 127.0.0.1:50053 --format json"});
  command
      .OptionalArguments("PARTICIPANT", words->names,
                         "programs that are asked about; two: only what lies between them")
      .Completes(Names::kParticipants);
  command.Option("--service", "HOST:PORT", words->services,
                 "a service whose health is asked, beside --server; several times");
  command.Option("--seconds", "S", words->seconds, "how long to look around (default: 4)");
  command.Flag("--all", words->all, "also list the topics that flow");
  AddNetworkOptions(command, words->network);
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Doctor(session, *words); });
}

}  // namespace exemplar::cli
