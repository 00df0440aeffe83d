#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/recording/append.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/replay/player.hpp"
#include "keyboard.hpp"
#include "screen.hpp"

namespace exemplar::cli {
namespace {

constexpr Duration kPoll = std::chrono::milliseconds(20);
constexpr Duration kRedraw = std::chrono::milliseconds(100);
constexpr Duration kLastWords = std::chrono::seconds(5);
constexpr Duration kSeekStep = std::chrono::seconds(5);
constexpr double kFaster = 1.25;

struct Words {
  std::string file, format, station = "default";
  std::vector<std::string> topics;
  std::optional<double> rate, start_s, end_s, wait_s;
  int domain = 0;
  bool loop = false;
  bool paused = false;
  bool all_topics = false;
};

Result<replay::PlayOptions> OptionsOf(const Words& words) {
  constexpr double kLongestS = 1e8;
  for (const auto& [name, value] :
       {std::pair("--start", words.start_s), std::pair("--end", words.end_s),
        std::pair("--wait", words.wait_s)}) {
    if (value && !(*value >= 0 && *value <= kLongestS)) {
      return InvalidArgument(
          std::string(name) + " is " + FormatDouble(*value) + ", must lie between 0 and 1e8 s",
          name);
    }
  }
  replay::PlayOptions options;
  options.rate = words.rate.value_or(1);
  options.start = FromSeconds(words.start_s.value_or(0));
  if (words.end_s) options.end = FromSeconds(*words.end_s);
  options.loop = words.loop;
  options.paused = words.paused;
  if (!words.topics.empty()) {
    options.wanted = [chosen = std::set<std::string>(words.topics.begin(), words.topics.end())](
                         const std::string& topic) { return chosen.contains(topic); };
  } else if (words.all_topics) {
    options.wanted = [](const std::string&) { return true; };
  }
  return options;
}

std::string Milliseconds(Duration d) { return FormatFixed(1e3 * ToSeconds(d), 3); }

std::map<std::string, std::string> ValuesOf(const replay::PlayStatus& status) {
  return {{"position_s", FormatFixed(ToSeconds(status.position), 3)},
          {"length_s", FormatFixed(ToSeconds(status.length), 3)},
          {"rate", FormatDouble(status.rate)},
          {"sent", std::to_string(status.sent)},
          {"refused", std::to_string(status.refused)},
          {"latest_ms", Milliseconds(status.latest)},
          {"mean_lateness_ms", Milliseconds(status.mean_lateness)}};
}

/// Commands of ircp/replay/command: pause, resume, step, seek (`position_s`), rate (`rate`), stop,
/// status.
ircp::Answer Obey(replay::Player& player, const ircp::CommandSample& command,
                  const std::function<void()>& stop) {
  const auto number = [&](const char* name) -> std::optional<double> {
    const auto found = command.arguments.find(name);
    return found == command.arguments.end() ? std::nullopt : ParseDouble(found->second);
  };
  const auto refused = [](std::string why) -> ircp::Answer { return {false, std::move(why), {}}; };
  if (command.action == "pause") {
    player.Pause();
  } else if (command.action == "resume") {
    player.Resume();
  } else if (command.action == "step") {
    player.Step();
  } else if (command.action == "seek") {
    const std::optional<double> position = number("position_s");
    constexpr double kFarthestS = 1e9;
    if (!position || !(std::abs(*position) < kFarthestS)) return refused("seek needs position_s");
    player.Seek(FromSeconds(*position));
  } else if (command.action == "rate") {
    const Status set = player.SetRate(number("rate").value_or(0));
    if (!set) return refused(set.error().message);
  } else if (command.action == "stop") {
    stop();
  } else if (command.action != "status") {
    return refused("action \"" + command.action +
                   "\" is unknown; pause, resume, step, seek, rate, stop and status are known");
  }
  const replay::PlayStatus status = player.status();
  return {true, status.state, ValuesOf(status)};
}

void Press(replay::Player& player, const std::string& key, const std::function<void()>& stop) {
  const replay::PlayStatus status = player.status();
  if (key == " ") {
    status.state == "paused" ? player.Resume() : player.Pause();
  } else if (key == "s") {
    player.Step();
  } else if (key == "left") {
    player.Seek(status.position - kSeekStep);
  } else if (key == "right") {
    player.Seek(status.position + kSeekStep);
  } else if (key == "up") {
    (void)player.SetRate(status.rate * kFaster);  // at the limit it stays as it is
  } else if (key == "down") {
    (void)player.SetRate(status.rate / kFaster);
  } else if (key == "q") {
    stop();
  }
}

void Draw(ProgressDisplay& display, const replay::PlayStatus& status) {
  const double length = ToSeconds(status.length);
  const double position = ToSeconds(status.position);
  std::string detail = FormatFixed(position, 1) + " of " + FormatFixed(length, 1) + " s, " +
                       std::to_string(status.sent) + " sent, at most " +
                       Milliseconds(status.latest) + " ms late";
  if (status.rate != 1) detail += ", rate " + FormatFixed(status.rate, 2);
  display.Show(length > 0 ? position / length : 1, status.state, detail);
}

void WaitForReaders(const replay::Player& player, const Clock& clock, Duration limit,
                    const std::stop_token& stop) {
  const Duration deadline = clock.Steady() + limit;
  while (!player.UnreadTopics().empty() && clock.Steady() < deadline) {
    if (!clock.SleepFor(kPoll, stop)) return;
  }
  std::vector<std::string> unread;
  for (const std::string& topic : player.UnreadTopics()) unread.push_back("nobody reads " + topic);
  Warn(unread);
}

void Report(const Words& words, const replay::Player& player) {
  const replay::PlayStatus status = player.status();
  if (words.format == "json") {
    nlohmann::json topics = nlohmann::json::array();
    for (const replay::TopicPlan& plan : player.topics()) {
      topics.push_back({{"topic", plan.topic},
                        {"type", plan.type},
                        {"messages", plan.messages},
                        {"left_out", plan.left_out}});
    }
    Print({{"file", words.file},
           {"sent", status.sent},
           {"refused", status.refused},
           {"passes", status.passes},
           {"position_s", ToSeconds(status.position)},
           {"length_s", ToSeconds(status.length)},
           {"latest_ms", 1e3 * ToSeconds(status.latest)},
           {"mean_lateness_ms", 1e3 * ToSeconds(status.mean_lateness)},
           {"topics", std::move(topics)}});
    return;
  }
  std::cout << words.file << ": " << status.sent << " messages sent, at most "
            << Milliseconds(status.latest) << " ms late, " << Milliseconds(status.mean_lateness)
            << " ms on average\n";
  if (status.refused > 0) std::cout << status.refused << " were not taken by the network\n";
  for (const replay::TopicPlan& plan : player.topics()) {
    if (!plan.left_out.empty())
      std::cout << "left out: " << plan.topic << ", " << plan.left_out << '\n';
  }
}

int Replay(const Words& words) {
  const program::Signals signals;
  const Result<replay::PlayOptions> options = OptionsOf(words);
  if (!options) return FailUsage(options.error());
  if (const Status whole = recording::FinishAppend(words.file); !whole) return Fail(whole.error());
  const auto file = recording::FileSource::Open(words.file);
  if (!file) return Fail(file.error());
  const SystemClock clock;
  const auto network = bus::Participant::Create({.domain = words.domain,
                                                 .station = words.station,
                                                 .name = "exemplar-replay",
                                                 .clock = &clock});
  if (!network) return Fail(network.error());
  const auto made = replay::Player::Create(**file, **network, clock, *options);
  if (!made) return Fail(WithPlace(made.error(), words.file));
  replay::Player& player = **made;

  std::stop_source finished;
  const std::stop_callback on_signal(signals.token(), [&finished] { finished.request_stop(); });
  const std::function<void()> stop = [&finished] { finished.request_stop(); };
  const auto control = ircp::ControlServer::Create(
      **network, clock, "replay",
      [&](const ircp::CommandSample& command) { return Obey(player, command, stop); });
  if (!control) return Fail(control.error());
  (*control)->SetSentCounts([&player] { return player.sent(); });
  (*control)->SetValues([&player] { return ValuesOf(player.status()); });
  constexpr double kDefaultWaitS = 3;
  WaitForReaders(player, clock, FromSeconds(words.wait_s.value_or(kDefaultWaitS)),
                 finished.get_token());

  (*control)->SetState("playing", words.file);
  Status played;
  {
    ProgressDisplay display;
    const auto keyboard = Keyboard::Open([&](const std::string& key) { Press(player, key, stop); });
    if (keyboard != nullptr) {
      std::cerr << "space: pause, s: one message, left and right: 5 s, up and down: rate, q: end\n";
    }
    std::stop_source ended;
    const std::jthread playing([&] {
      played = player.Run(finished.get_token());
      ended.request_stop();
    });
    do {
      Draw(display, player.status());
    } while (clock.SleepFor(kRedraw, ended.get_token()));
  }
  if (!played) return Fail(WithPlace(played.error(), words.file));
  if (!player.WaitForAcknowledgments(kLastWords)) {
    Warn({"not every reader has acknowledged everything"});
  }
  (*control)->SetState("done", words.file);
  Report(words, player);
  return signals.token().stop_requested() ? kInterrupted : 0;
}

}  // namespace

void AddReplayCommand(Command& record) {
  const auto words = std::make_shared<Words>();
  Command command = record.Add(
      "replay",
      "Sends a recording's messages again, with their intervals; needs no server\n\n"
      "Commands, states, the emergency stop and the clock are left out unless chosen. On a "
      "terminal:\n"
      "space pauses, s sends one message, left and right go back and on by 5 s, up and down "
      "change\n"
      "the rate, q or Ctrl-C ends it.",
      {"exemplar record replay trial-001.mcap --rate 2 --station lab",
       "exemplar record replay trial-001.mcap --topic ircp/suit --start 3 --end 5 --loop"});
  command.Argument("FILE", words->file, "MCAP");
  command.Option("--rate", "FACTOR", words->rate, "so many times faster (default: 1)");
  command.Option("--start", "SECONDS", words->start_s, "begins there (default: 0)");
  command.Option("--end", "SECONDS", words->end_s, "ends there (default: the recording's end)");
  command.Flag("--loop", words->loop, "again and again, until it is stopped");
  command.Flag("--paused", words->paused, "waits for the space bar, or s for one message");
  command.Option("--topic", "TOPIC", words->topics, "only this one; several times");
  command.Flag("--all-topics", words->all_topics, "commands, states, safety and clock as well");
  command.Option("--wait", "SECONDS", words->wait_s, "limit of the wait for readers (default: 3)");
  command.Option("--domain", "N", words->domain, "DDS domain (default: 0)");
  command.Option("--station", "NAME", words->station, "where it is played");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([words] { return Replay(*words); });
}

}  // namespace exemplar::cli
