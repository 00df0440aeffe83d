#include "exemplar/rpc/call_log.hpp"

namespace exemplar::rpc {

void CallLog::Record(const CallRecord& call) {
  const std::string code(!call.outcome.empty() ? call.outcome
                         : call.status         ? "ok"
                                               : ToString(call.status.error().code));
  const double seconds = ToSeconds(call.duration);
  if (call.audited) {
    log_.Info("audit", {{"caller", call.caller.empty() ? "anybody" : call.caller},
                        {"method", call.method},
                        {"target", call.target},
                        {"request_id", call.request_id},
                        {"peer", call.peer},
                        {"outcome", code},
                        {"seconds", seconds}});
  }
  if (call.status) {
    log_.Debug("call", {{"method", call.method},
                        {"request_id", call.request_id},
                        {"peer", call.peer},
                        {"caller", call.caller},
                        {"seconds", seconds}});
  } else {
    log_.Warning("call failed", {{"method", call.method},
                                 {"request_id", call.request_id},
                                 {"peer", call.peer},
                                 {"caller", call.caller},
                                 {"seconds", seconds},
                                 {"code", code},
                                 {"field", call.status.error().field},
                                 {"error", call.status.error().message}});
  }
  const std::lock_guard lock(mutex_);
  Figure& figure = figures_[{std::string(call.method), code}];
  figure.method = call.method;
  figure.code = code;
  ++figure.calls;
  figure.seconds += seconds;
}

std::vector<CallLog::Figure> CallLog::figures() const {
  const std::lock_guard lock(mutex_);
  std::vector<Figure> all;
  for (const auto& [key, figure] : figures_) all.push_back(figure);
  return all;
}

std::vector<Metric> MetricsOf(const CallLog& calls, const std::string& prefix) {
  const auto each = [&calls](double (*number)(const CallLog::Figure&)) {
    return [&calls, number] {
      std::vector<Metric::Value> values;
      for (const CallLog::Figure& figure : calls.figures()) {
        values.push_back({{{"method", figure.method}, {"code", figure.code}}, number(figure)});
      }
      return values;
    };
  };
  return {{prefix + "_calls_total", "Finished gRPC calls", true,
           each([](const CallLog::Figure& figure) { return static_cast<double>(figure.calls); })},
          {prefix + "_call_seconds_total", "Time spent in finished gRPC calls", true,
           each([](const CallLog::Figure& figure) { return figure.seconds; })}};
}

}  // namespace exemplar::rpc
