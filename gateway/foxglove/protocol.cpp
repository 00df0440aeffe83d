#include "gateway/foxglove/protocol.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>

#include "exemplar/base/json_check.hpp"

namespace exemplar::gateway::foxglove {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostEntries = 10'000;
constexpr int kDeepest = 32;

/// The members of one JSON object; remembers the first that is not as it must be.
class Members {
 public:
  Members(const Json& object, std::string place) : object_(object), place_(std::move(place)) {
    if (!object.is_object()) Fail(place_.empty() ? "the message" : place_, "an object");
  }

  std::uint32_t Number(const char* name) {
    const Json* value = Find(name);
    if (value == nullptr) {
      Fail(place_ + name, "there");
      return 0;
    }
    if (value->is_number_unsigned() &&
        value->get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max()) {
      return value->get<std::uint32_t>();
    }
    Fail(place_ + name, "a whole number from 0 to 4294967295");
    return 0;
  }

  std::string Text(const char* name, bool needed) {
    const Json* value = Find(name);
    if (value == nullptr || (value->is_null() && !needed)) {
      if (needed) Fail(place_ + name, "there");
      return {};
    }
    if (value->is_string()) return value->get<std::string>();
    Fail(place_ + name, "a string");
    return {};
  }

  /// Each entry of an array.
  template <class Visit>
  void Each(const char* name, Visit visit) {
    const Json* value = Find(name);
    if (value == nullptr || !value->is_array()) {
      Fail(place_ + name, "an array");
      return;
    }
    if (value->size() > kMostEntries) {
      Fail(place_ + name, "no longer than " + std::to_string(kMostEntries) + " entries");
      return;
    }
    for (std::size_t i = 0; i < value->size() && error_.empty(); ++i) {
      visit((*value)[i], place_ + name + "[" + std::to_string(i) + "]");
    }
  }

  std::vector<std::uint32_t> Numbers(const char* name) {
    std::vector<std::uint32_t> numbers;
    Each(name, [&](const Json& entry, const std::string& place) {
      if (entry.is_number_unsigned() &&
          entry.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max()) {
        numbers.push_back(entry.get<std::uint32_t>());
      } else {
        Fail(place, "a whole number from 0 to 4294967295");
      }
    });
    return numbers;
  }

  void Fail(const std::string& place, const std::string& must_be) {
    if (error_.empty()) error_ = place + " must be " + must_be;
  }
  /// What is wrong with a part is wrong with the whole.
  void Adopt(const Members& part) {
    if (error_.empty()) error_ = part.error_;
  }
  const std::string& error() const { return error_; }

 private:
  const Json* Find(const char* name) const {
    if (!object_.is_object()) return nullptr;
    const auto found = object_.find(name);
    return found == object_.end() ? nullptr : &*found;
  }

  const Json& object_;
  std::string place_;
  std::string error_;
};

Result<ClientMessage> Whole(Members& members, ClientMessage message) {
  if (!members.error().empty()) return InvalidArgument(members.error());
  return message;
}

ClientMessage ReadSubscribe(Members& members) {
  SubscribeOp op;
  members.Each("subscriptions", [&](const Json& entry, const std::string& place) {
    Members one(entry, place + ".");
    op.subscriptions.push_back({one.Number("id"), one.Number("channelId")});
    members.Adopt(one);
  });
  return op;
}

ClientMessage ReadAdvertise(Members& members) {
  AdvertiseOp op;
  members.Each("channels", [&](const Json& entry, const std::string& place) {
    Members one(entry, place + ".");
    op.channels.push_back({one.Number("id"), one.Text("topic", true), one.Text("encoding", true),
                           one.Text("schemaName", true), one.Text("schema", false)});
    members.Adopt(one);
  });
  return op;
}

/// Little-endian numbers from the front.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class Number>
  Number Take() {
    Number number{};
    if (bytes_.size() < sizeof(Number)) {
      whole_ = false;
      bytes_ = {};
      return number;
    }
    static_assert(std::endian::native == std::endian::little);
    std::memcpy(&number, bytes_.data(), sizeof(Number));
    bytes_ = bytes_.subspan(sizeof(Number));
    return number;
  }
  std::string TakeText() {
    const auto size = Take<std::uint32_t>();
    if (size > bytes_.size()) {
      whole_ = false;
      return {};
    }
    std::string text(reinterpret_cast<const char*>(bytes_.data()), size);
    bytes_ = bytes_.subspan(size);
    return text;
  }
  std::span<const std::byte> rest() const { return bytes_; }
  bool whole() const { return whole_; }

 private:
  std::span<const std::byte> bytes_;
  bool whole_ = true;
};

template <class Number>
void Append(std::string& bytes, Number number) {
  const std::size_t at = bytes.size();
  bytes.resize(at + sizeof number);
  std::memcpy(bytes.data() + at, &number, sizeof number);
}

std::uint64_t Nanoseconds(Stamp time) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, time.nanoseconds()));
}

Json TimeJson(Stamp time) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  return {{"sec", Nanoseconds(time) / kSecond}, {"nsec", Nanoseconds(time) % kSecond}};
}

/// Strings may hold bytes that are not UTF-8 (a stranger's schema).
std::string Text(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<ClientMessage> ReadPlaybackControl(ByteReader reader) {
  constexpr std::uint8_t kPause = 1;
  const auto command = reader.Take<std::uint8_t>();
  PlaybackControl control;
  control.play = command == 0;
  control.speed = static_cast<double>(reader.Take<float>());
  const bool seeks = reader.Take<std::uint8_t>() != 0;
  const auto time = reader.Take<std::uint64_t>();
  control.request_id = reader.TakeText();
  if (!reader.whole()) return InvalidArgument("a playback control that is cut");
  if (command > kPause) {
    return InvalidArgument("playback command " + std::to_string(command) + " is none");
  }
  if (!std::isfinite(control.speed)) return InvalidArgument("playback speed is not a number");
  if (seeks) {
    if (time > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
      return InvalidArgument("playback time " + std::to_string(time) + " ns is out of range");
    }
    control.seek = Stamp::FromNanoseconds(static_cast<std::int64_t>(time));
  }
  return ClientMessage(control);
}

}  // namespace

Status CheckJson(std::string_view text) {
  const auto fault = FindJsonFault(text, kDeepest);
  if (!fault) return {};
  return InvalidArgument(fault->too_deep ? "nested deeper than " + std::to_string(kDeepest)
                                         : "not JSON at byte " + std::to_string(fault->byte));
}

Result<ClientMessage> ParseText(std::string_view text) {
  if (const Status json = CheckJson(text); !json.ok()) return json.error();
  const Json message = Json::parse(text.begin(), text.end(), nullptr, false);
  Members members(message, "");
  const std::string op = members.Text("op", true);
  if (!members.error().empty()) return InvalidArgument(members.error());
  if (op == "subscribe") return Whole(members, ReadSubscribe(members));
  if (op == "unsubscribe") {
    return Whole(members, UnsubscribeOp{members.Numbers("subscriptionIds")});
  }
  if (op == "advertise") return Whole(members, ReadAdvertise(members));
  if (op == "unadvertise") return Whole(members, UnadvertiseOp{members.Numbers("channelIds")});
  for (const char* known : {"getParameters", "setParameters", "subscribeParameterUpdates",
                            "unsubscribeParameterUpdates", "fetchAsset", "subscribeConnectionGraph",
                            "unsubscribeConnectionGraph"}) {
    if (op == known) return ClientMessage(UnofferedOp{op});
  }
  constexpr std::size_t kShown = 60;
  return InvalidArgument("op \"" + op.substr(0, kShown) + "\" is not known");
}

Result<ClientMessage> ParseBinary(std::span<const std::byte> bytes) {
  if (bytes.empty()) return InvalidArgument("an empty message");
  ByteReader reader(bytes);
  const auto opcode = reader.Take<std::uint8_t>();
  if (opcode == 1) {
    const auto channel = reader.Take<std::uint32_t>();
    if (!reader.whole()) return InvalidArgument("message data that are cut");
    return ClientMessage(ClientData{channel, reader.rest()});
  }
  if (opcode == 2) {
    ServiceCall call;
    call.service = reader.Take<std::uint32_t>();
    call.call = reader.Take<std::uint32_t>();
    call.encoding = reader.TakeText();
    if (!reader.whole()) return InvalidArgument("a service call that is cut");
    call.payload = reader.rest();
    return ClientMessage(call);
  }
  if (opcode == 3) return ReadPlaybackControl(reader);
  return InvalidArgument("opcode " + std::to_string(opcode) + " is not known");
}

std::string ServerInfoText(const ServerInfo& info) {
  Json json = {{"op", "serverInfo"},
               {"name", info.name},
               {"capabilities", info.capabilities},
               {"metadata", info.metadata},
               {"sessionId", info.session}};
  if (!info.encodings.empty()) json["supportedEncodings"] = info.encodings;
  if (info.range) {
    json["dataStartTime"] = TimeJson(info.range->first);
    json["dataEndTime"] = TimeJson(info.range->second);
  }
  return Text(json);
}

std::string StatusText(StatusLevel level, const std::string& message, const std::string& id) {
  Json json = {{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}};
  if (!id.empty()) json["id"] = id;
  return Text(json);
}

std::string AdvertiseText(std::span<const ChannelInfo> channels) {
  Json list = Json::array();
  for (const ChannelInfo& channel : channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", channel.encoding},
                    {"schemaName", channel.schema_name},
                    {"schemaEncoding", channel.schema_encoding},
                    {"schema", channel.schema}});
  }
  return Text({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string UnadvertiseText(std::span<const std::uint32_t> ids) {
  return Text(
      {{"op", "unadvertise"}, {"channelIds", std::vector<std::uint32_t>(ids.begin(), ids.end())}});
}

std::string AdvertiseServicesText(std::span<const ServiceInfo> services) {
  const auto part = [](const std::string& name, const std::string& schema) {
    return Json{{"encoding", "json"},
                {"schemaName", name},
                {"schemaEncoding", "jsonschema"},
                {"schema", schema}};
  };
  Json list = Json::array();
  for (const ServiceInfo& service : services) {
    list.push_back({{"id", service.id},
                    {"name", service.name},
                    {"type", service.type},
                    {"request", part(service.type + "Request", service.request_schema)},
                    {"response", part(service.type + "Response", service.response_schema)}});
  }
  return Text({{"op", "advertiseServices"}, {"services", std::move(list)}});
}

std::string ServiceFailureText(std::uint32_t service, std::uint32_t call,
                               const std::string& message) {
  return Text({{"op", "serviceCallFailure"},
               {"serviceId", service},
               {"callId", call},
               {"message", message}});
}

std::string MessageHead(std::uint32_t subscription, Stamp time) {
  std::string bytes(1, '\x01');
  Append(bytes, subscription);
  Append(bytes, Nanoseconds(time));
  return bytes;
}

std::string TimeBytes(Stamp time) {
  std::string bytes(1, '\x02');
  Append(bytes, Nanoseconds(time));
  return bytes;
}

std::string ServiceResponseBytes(std::uint32_t service, std::uint32_t call,
                                 const std::string& encoding, std::string_view payload) {
  std::string bytes(1, '\x03');
  Append(bytes, service);
  Append(bytes, call);
  Append(bytes, static_cast<std::uint32_t>(encoding.size()));
  bytes += encoding;
  bytes += payload;
  return bytes;
}

std::string PlaybackStateBytes(PlaybackStatus status, Stamp now, double speed, bool sought,
                               const std::string& request_id) {
  std::string bytes(1, '\x05');
  Append(bytes, static_cast<std::uint8_t>(status));
  Append(bytes, Nanoseconds(now));
  Append(bytes, static_cast<float>(speed));
  Append(bytes, static_cast<std::uint8_t>(sought ? 1 : 0));
  Append(bytes, static_cast<std::uint32_t>(request_id.size()));
  bytes += request_id;
  return bytes;
}

}  // namespace exemplar::gateway::foxglove
