#include "gateway/metrics.hpp"

namespace exemplar::gateway {

std::vector<Metric> MetricsOf(const TopicHub& hub) {
  const auto each = [&hub](double (*number)(const api::TopicInfo&)) {
    return [&hub, number] {
      std::vector<Metric::Value> values;
      for (const api::TopicInfo& info : hub.topics()) {
        values.push_back({{{"topic", info.topic}}, number(info)});
      }
      return values;
    };
  };
  return {
      CounterOf("exemplar_gateway_samples_total", "Samples that came from the station's topics",
                [&hub] { return hub.figures().received; }),
      CounterOf("exemplar_gateway_delivered_total", "Samples handed to subscriptions",
                [&hub] { return hub.figures().delivered; }),
      CounterOf("exemplar_gateway_missed_total", "Samples that slow subscriptions missed",
                [&hub] { return hub.figures().missed; }),
      CounterOf("exemplar_gateway_published_total", "Samples that clients published",
                [&hub] { return hub.figures().published; }),
      CounterOf("exemplar_gateway_publications_refused_total",
                "Samples of clients that were refused", [&hub] { return hub.figures().refused; }),
      GaugeOf("exemplar_gateway_subscriptions", "Subscriptions now",
              [&hub] { return hub.figures().subscriptions; }),
      {"exemplar_gateway_topic_lost_total", "Samples missing by their numbers, by topic", true,
       each([](const api::TopicInfo& info) { return static_cast<double>(info.lost); })},
      {"exemplar_gateway_topic_rate_hz", "Samples a second, by topic", false,
       each([](const api::TopicInfo& info) { return info.rate_hz; })}};
}

std::vector<Metric> MetricsOf(const rpc::Server& server) {
  return {{"exemplar_gateway_backend_serving", "1 where the server behind says that it serves",
           false, [&server] {
             std::vector<Metric::Value> values;
             for (const rpc::BackendState& state : server.backends()) {
               values.push_back({{{"backend", state.name}, {"address", state.address}},
                                 state.serving ? 1.0 : 0.0});
             }
             return values;
           }}};
}

}  // namespace exemplar::gateway
