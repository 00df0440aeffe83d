#include "gateway/control.hpp"

#include <map>
#include <string>

namespace exemplar::gateway {
namespace {

std::map<std::string, std::string> ValuesOf(const TopicHub& hub) {
  const TopicHub::Figures figures = hub.figures();
  return {{"received", std::to_string(figures.received)},
          {"missed", std::to_string(figures.missed)},
          {"published", std::to_string(figures.published)},
          {"subscriptions", std::to_string(figures.subscriptions)}};
}

}  // namespace

Result<std::unique_ptr<ircp::ControlServer>> OpenControl(ircp::Bus& bus, const Clock& clock,
                                                         const TopicHub& hub) {
  auto control = ircp::ControlServer::Create(
      bus, clock, "gateway", [&hub](const ircp::CommandSample& command) -> ircp::Answer {
        if (command.action == "status") return {true, "", ValuesOf(hub)};
        return {false, "the gateway knows \"status\" only, not \"" + command.action + "\"", {}};
      });
  if (control) (*control)->SetValues([&hub] { return ValuesOf(hub); });
  return control;
}

}  // namespace exemplar::gateway
