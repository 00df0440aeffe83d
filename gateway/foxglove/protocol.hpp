#pragma once
// The messages of the Foxglove WebSocket protocol as values
// (github.com/foxglove/ws-protocol, docs/spec.md; "foxglove.sdk.v1" adds the control of playback).

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::gateway::foxglove {

inline constexpr const char* kWebSocketV1 = "foxglove.websocket.v1";
inline constexpr const char* kSdkV1 = "foxglove.sdk.v1";
/// What clients are told who may not look.
inline constexpr const char* kNotLetIn =
    "this needs a token of the role \"observe\": ?token=... behind the address";

// ---------------------------------------------------------------- from clients

struct SubscribeOp {
  struct One {
    std::uint32_t id = 0;  ///< chosen by the client
    std::uint32_t channel = 0;
    friend bool operator==(const One&, const One&) = default;
  };
  std::vector<One> subscriptions;
};
struct UnsubscribeOp {
  std::vector<std::uint32_t> ids;
};
struct AdvertiseOp {
  struct Channel {
    std::uint32_t id = 0;  ///< chosen by the client
    std::string topic;
    std::string encoding;  ///< "cdr", "json"
    std::string schema_name;
    std::string schema;  ///< may be empty
  };
  std::vector<Channel> channels;
};
struct UnadvertiseOp {
  std::vector<std::uint32_t> ids;
};
/// An operation of the protocol that this server does not offer: "getParameters", "fetchAsset".
struct UnofferedOp {
  std::string op;
};
struct ClientData {
  std::uint32_t channel = 0;  ///< of an AdvertiseOp
  std::span<const std::byte> payload;
};
struct ServiceCall {
  std::uint32_t service = 0;
  std::uint32_t call = 0;
  std::string encoding;
  std::span<const std::byte> payload;
};
struct PlaybackControl {
  bool play = true;  ///< else pause
  double speed = 1;
  std::optional<Stamp> seek;
  std::string request_id;
};

using ClientMessage = std::variant<SubscribeOp, UnsubscribeOp, AdvertiseOp, UnadvertiseOp,
                                   UnofferedOp, ClientData, ServiceCall, PlaybackControl>;

/// Errors: kInvalidArgument, naming the member. At most 10,000 entries in a list.
Result<ClientMessage> ParseText(std::string_view text);
/// Payloads point into `bytes`.
Result<ClientMessage> ParseBinary(std::span<const std::byte> bytes);

/// Whether `text` is JSON that nests no deeper than 32; what every reader of clients' JSON here
/// asks first.
Status CheckJson(std::string_view text);

// ---------------------------------------------------------------- to clients

struct ChannelInfo {
  std::uint32_t id = 0;
  std::string topic;
  std::string encoding = "cdr";
  std::string schema_name;
  std::string schema_encoding = "omgidl";
  std::string schema;
};

struct ServiceInfo {
  std::uint32_t id = 0;
  std::string name;            ///< "/recorder/start"
  std::string type;            ///< "exemplar.v1.RecorderService/Start"
  std::string request_schema;  ///< JSON Schema
  std::string response_schema;
};

struct ServerInfo {
  std::string name;
  std::vector<std::string> capabilities;
  std::vector<std::string> encodings = {};  ///< for clients' messages and service calls
  std::map<std::string, std::string> metadata = {};
  std::string session = {};
  /// Of a playback.
  std::optional<std::pair<Stamp, Stamp>> range = {};
};

enum class StatusLevel { kInfo = 0, kWarning = 1, kError = 2 };
enum class PlaybackStatus : std::uint8_t { kPlaying = 0, kPaused = 1, kBuffering = 2, kEnded = 3 };

std::string ServerInfoText(const ServerInfo& info);
/// `id` empty: one of its own; else it replaces the one before of that id.
std::string StatusText(StatusLevel level, const std::string& message, const std::string& id = {});
std::string AdvertiseText(std::span<const ChannelInfo> channels);
std::string UnadvertiseText(std::span<const std::uint32_t> ids);
std::string AdvertiseServicesText(std::span<const ServiceInfo> services);
std::string ServiceFailureText(std::uint32_t service, std::uint32_t call,
                               const std::string& message);

/// What goes before a message's bytes.
std::string MessageHead(std::uint32_t subscription, Stamp time);
std::string TimeBytes(Stamp time);
std::string ServiceResponseBytes(std::uint32_t service, std::uint32_t call,
                                 const std::string& encoding, std::string_view payload);
std::string PlaybackStateBytes(PlaybackStatus status, Stamp now, double speed, bool sought,
                               const std::string& request_id);

}  // namespace exemplar::gateway::foxglove
