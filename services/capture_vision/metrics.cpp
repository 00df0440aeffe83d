#include "capture_vision/metrics.hpp"

#include "exemplar/ircp/metrics.hpp"

namespace exemplar::capture_vision {

std::vector<Metric> MetricsOf(const Session& session) {
  const std::string prefix = "exemplar_capture_vision";
  const auto count = [&](const char* name, const char* help, std::uint64_t Counts::*number) {
    return CounterOf(prefix + name, help, [&session, number] { return session.counts().*number; });
  };
  std::vector<Metric> metrics =
      ircp::ReceivedMetrics(prefix, {{ircp::CameraSample::kTopic, &session.reader()}});
  metrics.push_back(ircp::SentMetric(prefix, [&session] { return session.sent(); }));
  metrics.push_back(count("_pictures_total", "Stereo pairs received", &Counts::pictures));
  metrics.push_back(count("_pictures_skipped_total", "Pairs left out because a newer one had come",
                          &Counts::skipped));
  metrics.push_back(
      count("_pictures_unreadable_total", "Pairs that could not be used", &Counts::unreadable));
  metrics.push_back(count("_pictures_unknown_camera_total",
                          "Pairs of cameras that the scene does not have",
                          &Counts::unknown_camera));
  metrics.push_back(count("_objects_found_total", "Objects found in pairs", &Counts::found));
  metrics.push_back(count("_objects_one_eyed_total",
                          "Objects that only one picture of a pair shows", &Counts::one_eyed));
  metrics.push_back(
      count("_objects_implausible_total", "Objects found where none can be", &Counts::implausible));
  metrics.push_back(
      {prefix + "_search_seconds_total", "Time spent on looking for objects", true, [&session] {
         return std::vector<Metric::Value>{{{}, session.search_seconds()}};
       }});
  return metrics;
}

}  // namespace exemplar::capture_vision
