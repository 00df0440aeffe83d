#include "data_services.hpp"

#include <nlohmann/json.hpp>

#include "exemplar/base/text.hpp"
#include "values.hpp"

namespace exemplar::cli {

std::vector<DataService> DataServices(const rpc::Clients& clients, const std::string& only) {
  std::vector<DataService> services;
  for (const DataService& service : {DataService{"recorder", clients.recorder_data.get()},
                                     DataService{"learning", clients.learning_data.get()}}) {
    if (only.empty() || only == service.name) services.push_back(service);
  }
  return services;
}

void AddOnly(Command& command, std::string& only) {
  command.Option("--only", "SERVICE", only, "one service instead of all")
      .OneOf({"learning", "recorder"});
}

bool IsNotServed(const Error& error) { return error.code == ErrorCode::kUnimplemented; }

Error OfService(const Error& error, const std::string& service) {
  Error named = WithPlace(error, service);
  if (IsNotServed(error)) named.message += " (give the gateway's address, or --only SERVICE)";
  return named;
}

nlohmann::json ToJson(const api::DataReport& report) {
  nlohmann::json items = nlohmann::json::array();
  for (const api::DataItem& item : report.items) {
    nlohmann::json json = {{"kind", item.kind},
                           {"name", item.name},
                           {"action", item.action},
                           {"detail", item.detail},
                           {"bytes", item.bytes}};
    if (item.at != Stamp()) json["at"] = ToIso8601(item.at);
    items.push_back(std::move(json));
  }
  return {{"items", std::move(items)}, {"notices", report.notices}};
}

std::string ReportText(const std::string& service, const api::DataReport& report) {
  std::string text;
  for (const api::DataItem& item : report.items) {
    text += service + ": " + item.kind + " " + item.name + " " + item.action;
    if (!item.detail.empty()) text += " (" + item.detail + ")";
    if (item.at != Stamp()) text += ", of " + TimeText(item.at);
    text += '\n';
  }
  for (const std::string& notice : report.notices) text += service + ": " + notice + '\n';
  return text;
}

}  // namespace exemplar::cli
