#pragma once
// The services that keep people's data, as the commands on all of them see them.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "exemplar/api/data.hpp"
#include "session.hpp"

namespace exemplar::cli {

struct DataService {
  std::string name;  ///< "learning", "recorder"
  api::DataApi* api;
};

/// All of them, the recorder first; `only` (empty: all) names one.
std::vector<DataService> DataServices(const rpc::Clients& clients, const std::string& only);
/// Adds `--only`.
void AddOnly(Command& command, std::string& only);

/// Whether the server does not serve this at all: one service was named where the gateway was
/// meant.
bool IsNotServed(const Error& error);
/// Says whose error it is, and what helps where that service is not served.
Error OfService(const Error& error, const std::string& service);

nlohmann::json ToJson(const api::DataReport& report);
/// A line an item, behind the service's name.
std::string ReportText(const std::string& service, const api::DataReport& report);

}  // namespace exemplar::cli
