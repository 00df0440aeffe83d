#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.hpp"
#include "exemplar/base/text.hpp"
#include "screen.hpp"
#include "values.hpp"

namespace exemplar::cli {
namespace {

/// The topics' figures count since the recorder started, not since its file began.
std::string StatusText(const api::RecorderStatus& status, bool with_topics) {
  std::string text = "state     " + status.state +
                     (status.detail.empty() ? "" : " (" + status.detail + ")") + '\n';
  if (!status.file.empty()) {
    text += "file      " + status.file + "\nrecorded  " + FormatFixed(status.duration_s, 2) +
            " s, " + std::to_string(status.messages) + " messages, " +
            FormatFixed(1e-6 * static_cast<double>(status.bytes), 2) + " MB\n";
  }
  constexpr double kMega = 1e-6;
  text += "rate      " + FormatFixed(status.rate_hz, 1) + " samples/s, " +
          FormatFixed(kMega * status.bytes_per_s, 3) + " MB/s, " + std::to_string(status.lost) +
          " lost\ndisk      " +
          FormatFixed(kMega * static_cast<double>(status.disk_free_bytes), 0) + " MB free\n";
  if (status.part > 0) text += "part      " + std::to_string(status.part) + '\n';
  if (status.pauses > 0) {
    text += "paused    " + std::to_string(status.pauses) + " times, " +
            std::to_string(status.left_out) + " samples left out\n";
  }
  if (status.buffered_s > 0) {
    text += "buffered  " + FormatFixed(status.buffered_s, 1) + " s before an event\n";
  }
  if (!with_topics || status.topics.empty()) return text;
  Table topics({"TOPIC", "SENT", "RECEIVED", "LOST", "HZ", "WRITERS", "TYPE"});
  for (const api::TopicFigures& topic : status.topics) {
    topics.Add({topic.topic, std::to_string(topic.sent), std::to_string(topic.received),
                std::to_string(topic.lost), FormatFixed(topic.rate_hz, 1),
                std::to_string(topic.writers),
                topic.type + (topic.has_schema ? "" : " (no schema)")});
  }
  return text + topics.Text();
}

int Do(const Session& session, const std::string& format,
       const std::function<Result<api::RecorderStatus>(api::RecorderApi&)>& action,
       bool with_topics = false) {
  const Result<rpc::Clients> clients = session.Connect();
  if (!clients) return FailUsage(clients.error());
  const Result<api::RecorderStatus> status = action(*clients->recorder);
  if (!status) return Fail(status.error());
  if (format == "json") {
    Print(ToJson(*status));
  } else {
    std::cout << StatusText(*status, with_topics);
  }
  return 0;
}

/// Begins a file; a topic that nobody writes is answered with the one that may be meant.
Result<api::RecorderStatus> Start(api::RecorderApi& recorder, const api::RecordStart& start) {
  Result<api::RecorderStatus> started = recorder.Start(start);
  if (started || started.error().field != "expected_topics") return started;
  const Result<api::RecorderStatus> now = recorder.GetStatus();
  if (!now) return started;
  std::vector<std::string> names;
  for (const api::TopicFigures& topic : now->topics) names.push_back(topic.topic);
  Error error = started.error();
  for (const std::string& topic : start.expected_topics) {
    if (std::find(names.begin(), names.end(), topic) != names.end()) continue;
    if (const auto nearest = NearestName(topic, names)) {
      error.message += "; did you mean \"" + *nearest + "\"?";
    }
  }
  return error;
}

}  // namespace

void AddRecordCommands(Command& root, const Session& session) {
  Command record = root.Add("record", "Recordings of a station's topics, as MCAP files");

  struct StartWords {
    std::string name, person, format;
    std::vector<std::string> metadata, topics;
    std::optional<double> wait_s, split_s, split_mb;
  };
  const auto words = std::make_shared<StartWords>();
  Command command = record.Add("start", "Begins a file",
                               {"exemplar record start --name trial-001 --person user03",
                                "exemplar record start --topic ircp/suit --topic ircp/objects"});
  command.Option("--name", "NAME", words->name, "of the file (default: made from the time)");
  command.Option("--person", "ID", words->person, "whose demonstration it is: a pseudonymous id");
  command.Option("--meta", "NAME=VALUE", words->metadata, "kept in the file; several times");
  command.Option("--topic", "TOPIC", words->topics, "wait until it has a writer; several times");
  command.Option("--wait", "SECONDS", words->wait_s, "limit of that wait (default: 5)");
  command.Option("--split-s", "SECONDS", words->split_s, "a new file after so long");
  command.Option("--split-mb", "MEGABYTES", words->split_mb, "a new file after so much");
  AddFormat(command, words->format, {"text", "json"});
  command.Runs([&session, words] {
    const auto metadata = ParsePairs(words->metadata, "--meta");
    if (!metadata) return FailUsage(metadata.error());
    api::RecordStart start;
    start.name = words->name;
    start.metadata = *metadata;
    if (!words->person.empty()) start.metadata["person"] = words->person;
    start.expected_topics = words->topics;
    if (words->wait_s) start.timeout_s = *words->wait_s;
    if (words->split_s) start.split_s = *words->split_s;
    if (words->split_mb) {
      constexpr double kLargestMb = 1e9;
      if (!(*words->split_mb >= 0 && *words->split_mb <= kLargestMb)) {
        return FailUsage(InvalidArgument(
            "--split-mb is " + FormatDouble(*words->split_mb) + ", must lie between 0 and 1e9",
            "--split-mb"));
      }
      start.split_bytes = static_cast<std::uint64_t>(1e6 * *words->split_mb);
    }
    return Do(session, words->format,
              [&](api::RecorderApi& recorder) { return Start(recorder, start); });
  });

  struct EventWords {
    std::string note, name, person, format;
    std::vector<std::string> metadata;
  };
  const auto event = std::make_shared<EventWords>();
  command = record.Add("event",
                       "Marks an event; without a recording, begins one that holds the seconds "
                       "before it as well",
                       {"exemplar record event --note \"the button stuck\"",
                        "exemplar record event --name fault-7"});
  command.Option("--note", "TEXT", event->note, "what happened");
  command.Option("--name", "NAME", event->name, "of a file that begins (default: from the time)");
  command.Option("--person", "ID", event->person, "kept in such a file: whose demonstration it is");
  command.Option("--meta", "NAME=VALUE", event->metadata, "kept in such a file; several times");
  AddFormat(command, event->format, {"text", "json"});
  command.Runs([&session, event] {
    const auto metadata = ParsePairs(event->metadata, "--meta");
    if (!metadata) return FailUsage(metadata.error());
    api::RecordEvent request;
    request.note = event->note;
    request.name = event->name;
    request.metadata = *metadata;
    if (!event->person.empty()) request.metadata["person"] = event->person;
    return Do(session, event->format,
              [&](api::RecorderApi& recorder) { return recorder.MarkEvent(request); });
  });

  struct Action {
    const char* name;
    const char* summary;
    Result<api::RecorderStatus> (api::RecorderApi::*call)();
  };
  for (const Action& action :
       {Action{"stop", "Ends the file: it is whole and on the disk when this returns",
               &api::RecorderApi::Stop},
        Action{"pause", "Leaves out what comes until resume", &api::RecorderApi::Pause},
        Action{"resume", "Goes on with a paused recording", &api::RecorderApi::Resume},
        Action{"status", "Shows state, file, and what each topic sent and lost",
               &api::RecorderApi::GetStatus}}) {
    const auto format = std::make_shared<std::string>();
    command =
        record.Add(action.name, action.summary, {std::string("exemplar record ") + action.name});
    AddFormat(command, *format, {"text", "json"});
    command.Runs([&session, format, call = action.call] {
      return Do(
          session, *format, [call](api::RecorderApi& recorder) { return (recorder.*call)(); },
          call == &api::RecorderApi::GetStatus);
    });
  }
  AddRecordingFileCommands(record);
  AddJoinCommand(record);
  AddReplayCommand(record);
}

}  // namespace exemplar::cli
