#include "exemplar/bus/qos_table.hpp"

#include <algorithm>
#include <cassert>

namespace exemplar::bus {
namespace {

using std::chrono::milliseconds;

// Depths: 30 s of the expected rate for what demonstrations are made of, so that a link may be cut
// that long; 30 s of a 1 kHz robot's state; 2 s of commands, since older ones move nothing.
constexpr TopicQos kTable[] = {
    {.topic = "ircp/suit",
     .type = "Suit",
     .rate = "60 Hz",
     .depth = 1800,
     .max_instances = 64,
     .deadline = milliseconds(500)},
    {.topic = "ircp/end_effector",
     .type = "EndEffector",
     .rate = "60 to 100 Hz",
     .depth = 3000,
     .max_instances = 64,
     .deadline = milliseconds(500)},
    {.topic = "ircp/tactile",
     .type = "Tactile",
     .rate = "60 Hz",
     .depth = 1800,
     .max_instances = 64,
     .deadline = milliseconds(500)},
    {.topic = "ircp/camera",
     .type = "Camera",
     .rate = "10 to 30 Hz",
     .reliable = false,
     .depth = 30,
     .max_instances = 16,
     .asynchronous = true},
    {.topic = "ircp/objects",
     .type = "ObjectPose",
     .rate = "10 to 100 Hz",
     .depth = 3000,
     .max_instances = 256},
    {.topic = "ircp/joint_state",
     .type = "JointState",
     .rate = "125 Hz to 1 kHz",
     .depth = 30000,
     .max_instances = 16},
    {.topic = "ircp/joint_command",
     .type = "JointCommand",
     .rate = "60 Hz to 1 kHz",
     .depth = 2000,
     .max_instances = 16},
    {.topic = "ircp/plan",
     .type = "Plan",
     .rate = "each plan",
     .depth = 1,
     .max_instances = 16,
     .transient_local = true,
     .asynchronous = true},
    {.topic = "ircp/safety",
     .type = "Safety",
     .rate = "20 Hz",
     .depth = 600,
     .max_instances = 16,
     .deadline = milliseconds(200)},
    {.topic = "ircp/clock",
     .type = "Clock",
     .rate = "1 Hz; each step in simulation",
     .depth = 2000,
     .max_instances = 64},
    {.topic = "ircp/<program>/command",
     .type = "Command",
     .rate = "on demand",
     .depth = 256,
     .max_instances = 64},
    {.topic = "ircp/<program>/status",
     .type = "Status",
     .rate = "on change and 1 Hz",
     .depth = 64,
     .max_instances = 64,
     .transient_local = true},
};

}  // namespace

std::span<const TopicQos> QosTable() { return kTable; }

const TopicQos& QosOfType(std::string_view type) {
  const auto* row = std::find_if(std::begin(kTable), std::end(kTable),
                                 [&](const TopicQos& qos) { return qos.type == type; });
  assert(row != std::end(kTable));
  return *row;
}

}  // namespace exemplar::bus
