#include "recorder/control_commands.hpp"

#include "exemplar/base/text.hpp"

namespace exemplar::recorder {
namespace {

constexpr std::string_view kMetaPrefix = "meta.";

Result<api::RecordStart> ParseStart(const std::map<std::string, std::string>& arguments) {
  api::RecordStart start;
  for (const auto& [name, value] : arguments) {
    if (name == "name") {
      start.name = value;
    } else if (name == "expect") {
      for (const std::string_view topic : Split(value, ',')) {
        if (!Trim(topic).empty()) start.expected_topics.emplace_back(Trim(topic));
      }
    } else if (name == "timeout_s" || name == "split_s" || name == "split_bytes") {
      const std::optional<double> number = ParseDouble(value);
      constexpr double kLargest = 1e15;
      if (!number || !(*number >= 0 && *number <= kLargest)) {
        return InvalidArgument(name + ": \"" + value + "\" is not a number from 0 to 1e15", name);
      }
      if (name == "timeout_s") start.timeout_s = *number;
      if (name == "split_s") start.split_s = *number;
      if (name == "split_bytes") start.split_bytes = static_cast<std::uint64_t>(*number);
    } else {
      const bool prefixed = name.starts_with(kMetaPrefix) && name.size() > kMetaPrefix.size();
      start.metadata[prefixed ? name.substr(kMetaPrefix.size()) : name] = value;
    }
  }
  return start;
}

api::RecordEvent ParseEvent(const std::map<std::string, std::string>& arguments) {
  api::RecordEvent event;
  for (const auto& [name, value] : arguments) {
    if (name == "name") {
      event.name = value;
    } else if (name == "note") {
      event.note = value;
    } else {
      const bool prefixed = name.starts_with(kMetaPrefix) && name.size() > kMetaPrefix.size();
      event.metadata[prefixed ? name.substr(kMetaPrefix.size()) : name] = value;
    }
  }
  return event;
}

Result<api::RecorderStatus> Do(api::RecorderApi& recorder, const ircp::CommandSample& command) {
  if (command.action == "start") {
    const Result<api::RecordStart> start = ParseStart(command.arguments);
    if (!start.ok()) return start.error();
    return recorder.Start(*start);
  }
  if (command.action == "stop") return recorder.Stop();
  if (command.action == "pause") return recorder.Pause();
  if (command.action == "resume") return recorder.Resume();
  if (command.action == "event") return recorder.MarkEvent(ParseEvent(command.arguments));
  if (command.action == "status") return recorder.GetStatus();
  return InvalidArgument(
      "action \"" + command.action +
          "\" is unknown; start, stop, pause, resume, event and status are known",
      "action");
}

}  // namespace

std::map<std::string, std::string> StatusValues(const api::RecorderStatus& status) {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  for (const api::TopicFigures& topic : status.topics) {
    sent += topic.sent;
    received += topic.received;
    lost += topic.lost;
  }
  return {{"state", status.state},
          {"file", status.file},
          {"messages", std::to_string(status.messages)},
          {"bytes", std::to_string(status.bytes)},
          {"duration_s", FormatFixed(status.duration_s, 3)},
          {"sent", std::to_string(sent)},
          {"received", std::to_string(received)},
          {"lost", std::to_string(lost)},
          {"rate_hz", FormatFixed(status.rate_hz, 1)},
          {"bytes_per_s", FormatFixed(status.bytes_per_s, 0)},
          {"disk_free_bytes", std::to_string(status.disk_free_bytes)},
          {"part", std::to_string(status.part)},
          {"pauses", std::to_string(status.pauses)},
          {"left_out", std::to_string(status.left_out)}};
}

ircp::Answer AnswerCommand(api::RecorderApi& recorder, const ircp::CommandSample& command) {
  const Result<api::RecorderStatus> done = Do(recorder, command);
  if (!done.ok()) {
    return {.ok = false,
            .detail = done.error().message,
            .values = {{"error", std::string(ToString(done.error().code))}}};
  }
  return {.ok = true, .detail = done->detail, .values = StatusValues(*done)};
}

}  // namespace exemplar::recorder
