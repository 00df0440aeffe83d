#pragma once
#include <memory>

#include "exemplar/ircp/control.hpp"
#include "gateway/topic_hub.hpp"

namespace exemplar::gateway {

/// The gateway's own place among the station's programs: its state each second, and the answer to
/// "status" (samples `received`, `missed`, `published`; `subscriptions`). All outlive it.
Result<std::unique_ptr<ircp::ControlServer>> OpenControl(ircp::Bus& bus, const Clock& clock,
                                                         const TopicHub& hub);

}  // namespace exemplar::gateway
