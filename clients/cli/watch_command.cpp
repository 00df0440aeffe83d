#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <tuple>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/bus/codec.hpp"
#include "exemplar/program/runtime.hpp"
#include "gateway/topic_server.hpp"
#include "network_options.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

struct Words {
  std::vector<std::string> topics;
  std::string format;
  std::optional<double> interval_s, wait_s, count, rate_hz;
  NetworkWords network;
};

/// For a list of topics, which cannot be cancelled.
constexpr Duration kLongestList = std::chrono::seconds(4);

/// The topics of a gateway, or read from the network by this program itself.
class Source {
 public:
  static Result<std::unique_ptr<Source>> Open(const Session& session, const Words& words) {
    auto source = std::make_unique<Source>();
    if (!session.server.empty() && !words.network.given()) {
      Result<rpc::ClientOptions> server = session.Options();
      if (!server) return server.error();
      if (!session.timeout_s) server->timeout = kLongestList;
      Result<rpc::Clients> clients = rpc::Connect(*server);
      if (!clients) return clients.error();
      source->clients_ = std::move(*clients);
      source->topics_ = source->clients_.topics.get();
      return source;
    }
    Result<bus::ParticipantOptions> options = NetworkOf(words.network, "exemplar-watch");
    if (!options) return options.error();
    options->clock = &source->clock_;
    source->place_ =
        " in station \"" + options->station + "\" of domain " + std::to_string(options->domain);
    auto participant = bus::Participant::Create(*options);
    if (!participant) return participant.error();
    source->participant_ = std::move(*participant);
    auto hub =
        gateway::TopicHub::Create(*source->participant_, *source->participant_, source->clock_,
                                  {.decode_status = bus::Decode<ircp::StatusSample>});
    if (!hub) return hub.error();
    source->hub_ = std::move(*hub);
    source->server_ =
        std::make_unique<gateway::TopicServer>(*source->hub_, gateway::TopicServerOptions{});
    source->topics_ = source->server_.get();
    return source;
  }

  api::TopicApi& topics() { return *topics_; }
  /// " in station "lab" of domain 3", where it looks itself.
  std::string place() const { return place_; }
  const Clock& clock() const { return clock_; }

 private:
  SystemClock clock_;
  rpc::Clients clients_;
  std::unique_ptr<bus::Participant> participant_;
  std::unique_ptr<gateway::TopicHub> hub_;
  std::unique_ptr<gateway::TopicServer> server_;
  api::TopicApi* topics_ = nullptr;
  std::string place_;
};

/// Where nobody is, others may be next door.
constexpr const char* kWhereElse = ", nor anything else; `exemplar doctor` says who is where";

constexpr Duration kAgain = std::chrono::milliseconds(100);

/// How long topics are waited for that nobody writes yet.
Duration PatienceOf(const Words& words) {
  constexpr double kDefaultWaitS = 4;
  return FromSeconds(words.wait_s.value_or(kDefaultWaitS));
}

bool IsPattern(const std::string& topic) { return topic.find('*') != std::string::npos; }

/// Waits until each topic that is named is there; kNotFound, with the name that may be meant, for
/// one that does not come.
Status WaitForTopics(Source& source, const Words& words, const std::stop_token& stop) {
  const Duration end = source.clock().Steady() + PatienceOf(words);
  for (const std::string& topic : words.topics) {
    if (IsPattern(topic)) continue;
    for (;;) {
      const auto known = source.topics().List({});
      if (!known) return known.error();
      std::vector<std::string> names;
      for (const api::TopicInfo& info : *known) names.push_back(info.topic);
      if (std::find(names.begin(), names.end(), topic) != names.end()) break;
      if (source.clock().Steady() >= end || !source.clock().SleepFor(kAgain, stop)) {
        std::string what = "nobody writes \"" + topic + "\"" + source.place();
        if (const auto nearest = NearestName(topic, names)) {
          what += "; did you mean \"" + *nearest + "\"?";
        } else if (!names.empty()) {
          what += "; there are " + Join(names, ", ");
        } else {
          what += kWhereElse;
        }
        return NotFound(what, "TOPIC");
      }
    }
  }
  return {};
}

nlohmann::json ToJson(const api::TopicInfo& info, const std::string& time) {
  return {{"time", time},
          {"topic", info.topic},
          {"type", info.type},
          {"rate_hz", info.rate_hz},
          {"bytes_per_s", info.bytes_per_s},
          {"received", info.received},
          {"lost", info.lost},
          {"writers", info.writers},
          {"reliable", info.reliable},
          {"has_schema", !info.schema.empty()}};
}

std::string TableOf(const std::vector<api::TopicInfo>& topics) {
  constexpr double kKilo = 1e-3;
  Table table({"TOPIC", "HZ", "KB/S", "RECEIVED", "LOST", "WRITERS", "TYPE"});
  for (const api::TopicInfo& info : topics) {
    table.Add({info.topic, FormatFixed(info.rate_hz, 1), FormatFixed(kKilo * info.bytes_per_s, 1),
               std::to_string(info.received), std::to_string(info.lost),
               std::to_string(info.writers),
               info.type + (info.schema.empty() ? " (no schema)" : "")});
  }
  return table.Text();
}

/// All topics, again and again.
int WatchTable(Source& source, const Words& words, const std::stop_token& stop) {
  const bool live = words.format == "text" && IsTerminal(STDOUT_FILENO);
  const Duration interval = FromSeconds(words.interval_s.value_or(1));
  LiveText screen;
  double left = words.count.value_or(0);
  // On the network itself, topics come up one after the other, and their first rates a second
  // later.
  constexpr Duration kFirstRates = std::chrono::milliseconds(1200);
  const Duration end = source.clock().Steady() + PatienceOf(words);
  for (auto topics = source.topics().List(words.topics);
       topics && topics->empty() && source.clock().Steady() < end;
       topics = source.topics().List(words.topics)) {
    if (!source.clock().SleepFor(kAgain, stop)) return 0;
  }
  if (!source.clock().SleepFor(std::max(interval, kFirstRates), stop)) return 0;
  bool warned = false;
  for (;;) {
    const auto topics = source.topics().List(words.topics);
    if (!topics) return stop.stop_requested() ? 0 : Fail(topics.error());
    if (topics->empty() && !warned) {
      Warn({"nobody writes any topic" + source.place() + "; `exemplar doctor` says who is where"});
      warned = true;
    }
    const std::string time = ToIso8601(source.clock().Now());
    if (words.format == "json") {
      for (const api::TopicInfo& info : *topics) PrintLine(ToJson(info, time));
    } else if (live) {
      screen.Show(time + ", " + std::to_string(topics->size()) + " topics; Ctrl-C ends\n" +
                  TableOf(*topics));
    } else {
      for (const api::TopicInfo& info : *topics) {
        std::cout << time << ' ' << info.topic << ' ' << FormatFixed(info.rate_hz, 1) << " Hz, "
                  << info.received << " received, " << info.lost << " lost, " << info.writers
                  << (info.writers == 1 ? " writer, " : " writers, ") << info.type << '\n';
      }
      std::cout << std::flush;
    }
    if (--left == 0 || !source.clock().SleepFor(interval, stop)) return 0;
  }
}

void PrintSample(const api::TopicSample& sample, const std::string& format) {
  const auto content = nlohmann::json::parse(sample.json, nullptr, false);
  if (format == "json") {
    nlohmann::json line{{"topic", sample.topic},
                        {"writer", sample.writer},
                        {"sequence", sample.sequence},
                        {"source_time", ToIso8601(sample.source_stamp)},
                        {"received", ToIso8601(sample.received)}};
    if (content.is_discarded()) {
      line["error"] = sample.json_error;
    } else {
      line["sample"] = content;
    }
    PrintLine(line);
    return;
  }
  std::cout << Paint(ToIso8601(sample.received), Colour::kFaint, STDOUT_FILENO) << ' '
            << Paint(sample.topic, Colour::kBold, STDOUT_FILENO) << ' '
            << (content.is_discarded() ? '(' + sample.json_error + ')' : sample.json) << std::endl;
}

/// The samples of the topics that were named.
int WatchSamples(Source& source, const Words& words, const std::stop_token& stop) {
  if (const Status there = WaitForTopics(source, words, stop); !there) {
    return stop.stop_requested() ? 0 : Fail(there.error());
  }
  const double most = words.count.value_or(0);
  double shown = 0;
  std::uint64_t missed = 0;
  const Status watched = source.topics().Subscribe(
      {.topics = words.topics,
       .max_rate_hz = words.rate_hz.value_or(0),
       .cdr = false,
       .json = true},
      [&](const api::TopicBatch& batch) {
        if (batch.missed > missed) {
          Warn({std::to_string(batch.missed - missed) + " samples missed: too slow"});
          missed = batch.missed;
        }
        for (const api::TopicSample& sample : batch.samples) {
          PrintSample(sample, words.format);
          if (++shown == most) return false;
        }
        return static_cast<bool>(std::cout);
      },
      stop);
  return watched || stop.stop_requested() ? 0 : Fail(watched.error());
}

int Watch(const Session& session, const Words& words) {
  constexpr double kMost = 1e9;
  for (const auto& [name, value, least] :
       {std::tuple("--interval", words.interval_s, 0.05), std::tuple("--wait", words.wait_s, 0.0),
        std::tuple("--count", words.count, 1.0), std::tuple("--rate", words.rate_hz, 1e-3)}) {
    if (value && !(*value >= least && *value <= kMost)) {
      return FailUsage(InvalidArgument(std::string(name) + " is " + FormatDouble(*value) +
                                           ", must lie between " + FormatDouble(least) + " and 1e9",
                                       name));
    }
  }
  const program::Signals signals;
  const auto source = Source::Open(session, words);
  if (!source) {
    return source.error().code == ErrorCode::kInvalidArgument ? FailUsage(source.error())
                                                              : Fail(source.error());
  }
  return words.topics.empty() ? WatchTable(**source, words, signals.token())
                              : WatchSamples(**source, words, signals.token());
}

}  // namespace

void AddWatchCommand(Command& root, const Session& session) {
  const auto words = std::make_shared<Words>();
  Command command = root.Add(
      "watch",
      "Shows a station's topics as they flow, or the samples of those that are named\n\n"
      "Of topics: rates, losses and writers. Through the gateway that --server or EXEMPLAR_SERVER\n"
      "names; without one, or with --domain or --station, on the network itself.",
      {"exemplar watch", "exemplar watch ircp/joint_state --rate 2 --format json",
       "exemplar watch --domain 3 --station lab 'ircp/*'"});
  command.OptionalArguments("TOPIC", words->topics,
                            "whose samples are shown; * stands for any text");
  command.Option("--count", "N", words->count,
                 "ends after so many samples, or updates of the table (default: never)");
  command.Option("--interval", "SECONDS", words->interval_s,
                 "between two updates of the table (default: 1)");
  command.Option("--rate", "HZ", words->rate_hz, "at most so many samples of each writer");
  command.Option("--wait", "SECONDS", words->wait_s,
                 "how long to wait for a topic that nobody writes yet (default: 4)");
  AddNetworkOptions(command, words->network);
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] { return Watch(session, *words); });
}

}  // namespace exemplar::cli
