#include "recorder/control_link.hpp"

#include <utility>

#include "recorder/control_commands.hpp"

namespace exemplar::recorder {

void ControlLink::Tell(const std::string& state, const std::string& detail) {
  if (ircp::ControlServer* const server = told_) server->SetState(state, detail);
}

Status ControlLink::Open(ircp::Bus& bus, const Clock& clock, Log& log, api::RecorderApi& recorder,
                         Values more) {
  auto server = ircp::ControlServer::Create(
      bus, clock, "recorder",
      [&recorder](const ircp::CommandSample& command) { return AnswerCommand(recorder, command); });
  if (!server.ok()) return server.error();
  server_ = std::move(*server);
  server_->SetValues([&recorder, more = std::move(more)] {
    std::map<std::string, std::string> values = more();
    values.merge(StatusValues(*recorder.GetStatus()));
    return values;
  });
  server_->SetOnRival([&log](const std::string& writer) {
    log.Warning("another recorder runs in this station: both obey the same commands",
                {{"writer", writer}, {"advice", "end one of them, or give it its own --station"}});
  });
  const api::RecorderStatus status = *recorder.GetStatus();
  server_->SetState(status.state, status.detail);
  told_ = server_.get();
  return {};
}

}  // namespace exemplar::recorder
