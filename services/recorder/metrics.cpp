#include "recorder/metrics.hpp"

namespace exemplar::recorder {
namespace {

using Values = std::vector<program::Metric::Value>;

program::Metric OfFile(api::RecorderApi& recorder, const char* name, const char* help,
                       double (*figure)(const api::RecorderStatus&)) {
  return {name, help, false, [&recorder, figure] {
            const Result<api::RecorderStatus> status = recorder.GetStatus();
            return status.ok() ? Values{{{}, figure(*status)}} : Values();
          }};
}

program::Metric OfTopics(api::RecorderApi& recorder, const char* name, const char* help,
                         double (*figure)(const api::TopicFigures&)) {
  return {name, help, true, [&recorder, figure] {
            Values values;
            const Result<api::RecorderStatus> status = recorder.GetStatus();
            if (!status.ok()) return values;
            for (const api::TopicFigures& topic : status->topics) {
              values.push_back({{{"topic", topic.topic}}, figure(topic)});
            }
            return values;
          }};
}

}  // namespace

std::vector<program::Metric> MetricsOf(api::RecorderApi& recorder) {
  return {
      OfFile(recorder, "exemplar_recorder_file_messages", "Messages in the present or last file",
             [](const api::RecorderStatus& s) { return static_cast<double>(s.messages); }),
      OfFile(recorder, "exemplar_recorder_file_bytes", "Bytes of the present or last file",
             [](const api::RecorderStatus& s) { return static_cast<double>(s.bytes); }),
      OfFile(recorder, "exemplar_recorder_recording", "1 while a file is written",
             [](const api::RecorderStatus& s) { return s.state == "recording" ? 1.0 : 0.0; }),
      OfTopics(recorder, "exemplar_recorder_sent_total", "Samples sent, as far as is known",
               [](const api::TopicFigures& t) { return static_cast<double>(t.sent); }),
      OfTopics(recorder, "exemplar_recorder_received_total", "Samples received",
               [](const api::TopicFigures& t) { return static_cast<double>(t.received); }),
      OfTopics(recorder, "exemplar_recorder_lost_total", "Samples lost by network or queue",
               [](const api::TopicFigures& t) { return static_cast<double>(t.lost); })};
}

}  // namespace exemplar::recorder
