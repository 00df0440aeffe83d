// Any bytes go through the readers of Foxglove clients' messages, as text and as binary, and
// through the reader of request targets. What is read stays within what was sent.

#include <cstdlib>
#include <string>
#include <string_view>

#include "exemplar/http/message.hpp"
#include "gateway/foxglove/protocol.hpp"

namespace {

void Require(bool condition) {
  if (!condition) std::abort();
}

bool Within(std::span<const std::byte> part, std::span<const std::byte> whole) {
  return part.empty() ||
         (part.data() >= whole.data() && part.data() + part.size() <= whole.data() + whole.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace exemplar::gateway::foxglove;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::span<const std::byte> bytes(reinterpret_cast<const std::byte*>(data), size);

  const auto message = ParseText(text);
  Require(message.ok() || !message.error().message.empty());
  Require(!message.ok() || CheckJson(text).ok());
  if (message.ok()) {
    if (const auto* op = std::get_if<AdvertiseOp>(&*message)) Require(op->channels.size() <= size);
    if (const auto* op = std::get_if<SubscribeOp>(&*message)) {
      Require(op->subscriptions.size() <= size);
    }
  }
  const auto binary = ParseBinary(bytes);
  if (binary.ok()) {
    if (const auto* sent = std::get_if<ClientData>(&*binary)) Require(Within(sent->payload, bytes));
    if (const auto* call = std::get_if<ServiceCall>(&*binary)) {
      Require(Within(call->payload, bytes) && call->encoding.size() < size);
    }
    if (const auto* control = std::get_if<PlaybackControl>(&*binary)) {
      Require(control->request_id.size() < size);
    }
  }
  const auto target = exemplar::http::ParseTarget(text);
  if (!target.ok()) return 0;
  Require(text.front() == '/' && !target->segments.empty());
  for (const std::string& segment : target->segments) {
    Require(segment != ".." && segment.find('\0') == std::string::npos);
  }
  const auto pattern = exemplar::http::PathPattern::Parse(text);
  if (pattern.ok()) (void)pattern->Match(target->segments);
  return 0;
}
