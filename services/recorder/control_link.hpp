#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "exemplar/api/services.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/control.hpp"

namespace exemplar::recorder {

/// The recorder's commands from the network's topics, and its state to them. Thread-safe but for
/// Open.
class ControlLink {
 public:
  using Values = std::function<std::map<std::string, std::string>()>;

  /// For RecorderOptions::on_change; says nothing until Open has returned.
  void Tell(const std::string& state, const std::string& detail);
  /// Once. `more` are added to the values of each status. All arguments must outlive the link.
  Status Open(ircp::Bus& bus, const Clock& clock, Log& log, api::RecorderApi& recorder,
              Values more);

 private:
  std::unique_ptr<ircp::ControlServer> server_;
  std::atomic<ircp::ControlServer*> told_ = nullptr;  ///< server_, once it is open
};

}  // namespace exemplar::recorder
