#include "gateway/publisher.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "exemplar/dynamic_data/json.hpp"
#include "gateway/topic_hub.hpp"

namespace exemplar::gateway {
namespace {

/// What programs say of themselves, and what moves the robot: nobody else's to say.
const std::vector<std::string> kNever = {"ircp/joint_command", "ircp/clock", "ircp/*/command",
                                         "ircp/*/status"};

}  // namespace

bool Publisher::MayPublish(const std::string& topic) const {
  return !options_.publish.empty() && MatchesTopic(topic, options_.publish) &&
         !MatchesTopic(topic, kNever);
}

Result<ircp::RawTopic> Publisher::TopicOf(const api::TopicPublication& publication,
                                          const ircp::RawTopic* discovered) const {
  const auto known = std::find_if(options_.known.begin(), options_.known.end(),
                                  [&](const auto& one) { return one.topic == publication.topic; });
  ircp::RawTopic topic;
  if (discovered != nullptr) {
    topic = *discovered;
  } else if (known != options_.known.end()) {
    topic = *known;
  } else {
    if (publication.type.empty()) {
      return InvalidArgument(
          "topic \"" + publication.topic + "\" has no writer: its type must be given", "type");
    }
    topic.topic = publication.topic;
    topic.type = publication.type;
    topic.reliable = true;
  }
  if (!publication.type.empty() && publication.type != topic.type) {
    return InvalidArgument(
        "topic \"" + topic.topic + "\" carries " + topic.type + ", not " + publication.type,
        "type");
  }
  if (topic.schema.empty()) topic.schema = publication.schema;
  topic.deadline = Duration(0);  // clients promise no rate
  return topic;
}

Result<Publisher::Outgoing*> Publisher::Open(const api::TopicPublication& publication,
                                             const ircp::RawTopic* discovered) {
  const std::lock_guard lock(mutex_);
  const auto found = outgoing_.find(publication.topic);
  if (found != outgoing_.end()) {
    Outgoing& open = *found->second;
    if (!publication.type.empty() && publication.type != open.topic.type) {
      return InvalidArgument("topic \"" + open.topic.topic + "\" carries " + open.topic.type +
                                 ", not " + publication.type,
                             "type");
    }
    return &open;
  }
  if (outgoing_.size() >= options_.max_writers) {
    return Error{ErrorCode::kResourceExhausted, "the gateway writes " +
                                                    std::to_string(outgoing_.size()) +
                                                    " topics already, the most that it may"};
  }
  Result<ircp::RawTopic> topic = TopicOf(publication, discovered);
  if (!topic) return topic.error();
  auto outgoing = std::make_unique<Outgoing>();
  if (!topic->schema.empty()) {
    auto type = dynamic_data::ParseType(topic->schema, topic->type);
    if (!type) return InvalidArgument(type.error().message, "schema");
    outgoing->type = std::move(*type);
    topic->keyed = std::any_of(outgoing->type->members.begin(), outgoing->type->members.end(),
                               [](const auto& member) { return member.key; });
  }
  auto writer = outlet_.MakeRawWriter(*topic);
  if (!writer) return writer.error();
  outgoing->topic = std::move(*topic);
  outgoing->writer = std::move(*writer);
  return outgoing_.emplace(publication.topic, std::move(outgoing)).first->second.get();
}

Result<std::vector<std::uint8_t>> Publisher::BytesOf(const api::TopicPublication& publication,
                                                     Outgoing& outgoing, bool& numbered) const {
  if (publication.json.empty()) {
    if (outgoing.type != nullptr) {
      if (const Status checked = dynamic_data::Check(*outgoing.type, publication.cdr); !checked) {
        return InvalidArgument(checked.error().message, "cdr");
      }
    }
    return publication.cdr;
  }
  if (outgoing.type == nullptr) {
    return InvalidArgument("the type of topic \"" + publication.topic +
                               "\" is not known: give its schema, or the sample's bytes",
                           "schema");
  }
  auto bytes = dynamic_data::FromJson(*outgoing.type, publication.json,
                                      [&](const std::string& member) -> std::optional<std::string> {
                                        if (member == "source") return '"' + options_.source + '"';
                                        if (member == "stamp_ns")
                                          return std::to_string(clock_.Now().nanoseconds());
                                        if (member != "seq") return std::nullopt;
                                        numbered = true;
                                        return std::to_string(outgoing.sent + 1);
                                      });
  if (bytes) return bytes;
  Error error = bytes.error();
  error.field = error.field.empty() ? "json" : "json." + error.field;
  return error;
}

Status Publisher::Publish(const api::TopicPublication& publication,
                          const ircp::RawTopic* discovered) {
  if (!MayPublish(publication.topic)) {
    return FailedPrecondition(
        "topic \"" + publication.topic + "\" may not be published on through this gateway",
        "topic");
  }
  Result<Outgoing*> outgoing = Open(publication, discovered);
  if (!outgoing) return outgoing.error();
  Outgoing& out = **outgoing;
  const std::lock_guard lock(out.mutex);
  bool numbered = false;
  const Result<std::vector<std::uint8_t>> bytes = BytesOf(publication, out, numbered);
  if (!bytes) return bytes.error();
  Status written = out.writer->Write(*bytes, clock_.Now());
  if (written && numbered) ++out.sent;
  return written;
}

}  // namespace exemplar::gateway
