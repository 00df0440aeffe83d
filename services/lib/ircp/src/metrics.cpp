#include "exemplar/ircp/metrics.hpp"

#include <utility>

namespace exemplar::ircp {

Metric SentMetric(const std::string& prefix, std::function<std::vector<TopicCount>()> counts) {
  return {prefix + "_sent_total", "Samples sent", true, [counts = std::move(counts)] {
            std::vector<Metric::Value> values;
            for (const TopicCount& count : counts()) {
              values.push_back({{{"topic", count.topic}, {"source", count.source}},
                                static_cast<double>(count.sent)});
            }
            return values;
          }};
}

std::vector<Metric> ReceivedMetrics(const std::string& prefix, std::vector<TopicReader> readers) {
  const auto each = [readers](std::uint64_t SourceCount::*number) {
    return [readers, number] {
      std::vector<Metric::Value> values;
      for (const TopicReader& from : readers) {
        if (from.reader == nullptr) continue;
        for (const SourceCount& count : from.reader->counts()) {
          values.push_back({{{"topic", from.topic}, {"source", count.source}},
                            static_cast<double>(count.*number)});
        }
      }
      return values;
    };
  };
  const auto refused = [readers] {
    std::vector<Metric::Value> values;
    for (const TopicReader& from : readers) {
      if (from.reader == nullptr) continue;
      values.push_back({{{"topic", from.topic}}, static_cast<double>(from.reader->refused())});
    }
    return values;
  };
  return {{prefix + "_received_total", "Samples received", true, each(&SourceCount::received)},
          {prefix + "_lost_total", "Samples that were sent and never came", true,
           each(&SourceCount::lost)},
          {prefix + "_refused_total", "Samples that were malformed", true, refused}};
}

Metric StateMetric(const std::string& prefix, std::vector<std::string> states,
                   std::function<std::string()> current) {
  return {prefix + "_state", "1 for the present state", false,
          [states = std::move(states), current = std::move(current)] {
            std::vector<Metric::Value> values;
            const std::string now = current();
            for (const std::string& state : states) {
              values.push_back({{{"state", state}}, state == now ? 1.0 : 0.0});
            }
            return values;
          }};
}

}  // namespace exemplar::ircp
