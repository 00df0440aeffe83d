#include "gateway/known_topics.hpp"

#include <string>

#include "exemplar/bus/codec.hpp"
#include "exemplar/bus/qos_table.hpp"

namespace exemplar::gateway {
namespace {

template <class Sample>
ircp::RawTopic TopicOf() {
  const std::string_view type = bus::TypeNameOf<Sample>();
  const bus::TopicQos& qos = bus::QosOfType(type.substr(type.rfind(':') + 1));
  return {.topic = Sample::kTopic,
          .type = std::string(type),
          .schema = std::string(bus::SchemaOf<Sample>()),
          .partition = {},
          .keyed = true,
          .reliable = qos.reliable,
          .transient_local = qos.transient_local};
}

}  // namespace

std::vector<ircp::RawTopic> KnownTopics() {
  return {TopicOf<ircp::SuitSample>(),    TopicOf<ircp::EndEffectorSample>(),
          TopicOf<ircp::TactileSample>(), TopicOf<ircp::CameraSample>(),
          TopicOf<ircp::ObjectSample>(),  TopicOf<ircp::JointStateSample>(),
          TopicOf<ircp::SafetySample>()};
}

}  // namespace exemplar::gateway
