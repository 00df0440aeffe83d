// Secured, Fast DDS 2.9.1 decrypts what is encrypted, and then believes all that it reads:
//  - a message in clear, whatever the governance says: a stranger who saw a member's GUID writes
//    samples, gaps and heartbeats in its name, or tells that it goes (CVE-2023-50257);
//  - in an encrypted message, a submessage that names another source than the message does;
//  - a message without any receiver's proof of origin, where the governance asks for one.
// The functions that these pass have symbols of their own, so the definitions here stand before the
// library's: they call those, and refuse what should have been refused.

#include "message_guard.hpp"

#include <dlfcn.h>
#include <fastdds/rtps/common/CDRMessage_t.h>
#include <fastdds/rtps/security/accesscontrol/ParticipantSecurityAttributes.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <fastdds/rtps/common/GuidPrefix_t.hpp>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <span>

#include "rtps_messages.hpp"

#define EXEMPLAR_MANAGER "N8eprosima8fastrtps4rtps8security15SecurityManager"
#define EXEMPLAR_MANAGER_CONST "NK8eprosima8fastrtps4rtps8security15SecurityManager"
#define EXEMPLAR_INIT \
  "_Z" EXEMPLAR_MANAGER "4initERNS2_29ParticipantSecurityAttributesERKNS1_14PropertyPolicyE"
#define EXEMPLAR_DECODE_MESSAGE                                        \
  "_Z" EXEMPLAR_MANAGER_CONST                                          \
  "19decode_rtps_messageERKNS1_12CDRMessage_tERS4_RKNS1_12GuidPrefix_" \
  "tE"
#define EXEMPLAR_DECODE_SUBMESSAGE \
  "_Z" EXEMPLAR_MANAGER_CONST      \
  "22decode_rtps_submessageERNS1_12CDRMessage_tES5_RKNS1_12GuidPrefix_tE"
#define EXEMPLAR_READ_TAG                                                                     \
  "_ZN8eprosima8fastrtps4rtps8security20AESGCMGMAC_Transform25deserialize_SecureDataTagERNS_" \
  "7fastcdr3CdrERNS2_13SecureDataTagERKSt5arrayIhLm4EESC_RKS9_IhLm32EESF_RKS9_IhLm12EEjRNS2_" \
  "17SecurityExceptionE"

namespace {

using eprosima::fastrtps::rtps::CDRMessage_t;
using eprosima::fastrtps::rtps::GuidPrefix_t;
using eprosima::fastrtps::rtps::security::ParticipantSecurityAttributes;

using KeyId = std::array<std::uint8_t, 4>;
/// As Fast DDS has it.
struct SecureDataTag {
  std::array<std::uint8_t, 16> common_mac;
  KeyId receiver_mac_key_id;
  std::array<std::uint8_t, 16> receiver_mac;
};

// What the decoders return.
constexpr int kDecoded = 0;
constexpr int kRefused = -1;

/// The library's own function.
template <class Function>
Function* Next(const char* symbol) {
  const auto found = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, symbol));
  if (found == nullptr) std::abort();  // whoever calls it, has it
  return found;
}

/// The security managers of participants whose messages must be encrypted.
class Guarded {
 public:
  void Set(const void* manager, bool guarded) {
    const std::lock_guard lock(mutex_);
    if (guarded) {
      managers_.insert(manager);
    } else {
      managers_.erase(manager);
    }
    any_ = !managers_.empty();
  }
  bool Has(const void* manager) const {
    if (!any_) return false;
    const std::shared_lock lock(mutex_);
    return managers_.count(manager) != 0;
  }

 private:
  mutable std::shared_mutex mutex_;
  std::set<const void*> managers_;
  std::atomic<bool> any_{false};
};

Guarded& TheGuarded() {
  static Guarded guarded;
  return guarded;
}

std::atomic<std::uint64_t> refused{0};

/// Whether the message that this thread reads came in clear to one who should have it encrypted.
thread_local bool came_in_clear = false;

std::span<const std::uint8_t> BytesOf(const CDRMessage_t& message) {
  if (message.pos >= message.length) return {};
  return {message.buffer + message.pos, message.length - message.pos};
}

int Refuse() {
  ++refused;
  return kRefused;
}

}  // namespace

// Called by Fast DDS: the object and its arguments, as its headers have them.
extern "C" {
__attribute__((visibility("default"))) bool ExemplarInitSecurity(
    void* manager, ParticipantSecurityAttributes& attributes,
    const void* properties) __asm__(EXEMPLAR_INIT);
__attribute__((visibility("default"))) int ExemplarDecodeMessage(
    const void* manager, const CDRMessage_t& message, CDRMessage_t& decoded,
    const GuidPrefix_t& source) __asm__(EXEMPLAR_DECODE_MESSAGE);
__attribute__((visibility("default"))) int ExemplarDecodeSubmessage(
    const void* manager, CDRMessage_t& message, CDRMessage_t& decoded,
    const GuidPrefix_t& source) __asm__(EXEMPLAR_DECODE_SUBMESSAGE);
__attribute__((visibility("default"))) bool ExemplarReadTag(
    void* transform, void* decoder, SecureDataTag& tag, const KeyId& kind, const KeyId& own_key,
    const void* key, const void* salt, const void* vector, std::uint32_t session,
    void* exception) __asm__(EXEMPLAR_READ_TAG);
}

bool ExemplarInitSecurity(void* manager, ParticipantSecurityAttributes& attributes,
                          const void* properties) {
  static const auto next = Next<decltype(ExemplarInitSecurity)>(EXEMPLAR_INIT);
  const bool made = next(manager, attributes, properties);
  TheGuarded().Set(manager, made && attributes.is_rtps_protected);
  return made;
}

int ExemplarDecodeMessage(const void* manager, const CDRMessage_t& message, CDRMessage_t& decoded,
                          const GuidPrefix_t& source) {
  static const auto next = Next<decltype(ExemplarDecodeMessage)>(EXEMPLAR_DECODE_MESSAGE);
  const int result = next(manager, message, decoded, source);
  came_in_clear = false;
  if (result < 0 || !TheGuarded().Has(manager)) return result;
  if (result == kDecoded) {
    exemplar::bus::RtpsSource named{};
    std::copy_n(source.value, named.size(), named.begin());
    return exemplar::bus::SpeaksForItself(BytesOf(decoded), named) ? result : Refuse();
  }
  came_in_clear = true;
  return exemplar::bus::OnlyGreets(BytesOf(message)) ? result : Refuse();
}

int ExemplarDecodeSubmessage(const void* manager, CDRMessage_t& message, CDRMessage_t& decoded,
                             const GuidPrefix_t& source) {
  static const auto next = Next<decltype(ExemplarDecodeSubmessage)>(EXEMPLAR_DECODE_SUBMESSAGE);
  const int result = next(manager, message, decoded, source);
  if (result != kDecoded || !came_in_clear) return result;
  return exemplar::bus::OnlyExchangesKeys(BytesOf(decoded)) ? result : Refuse();
}

bool ExemplarReadTag(void* transform, void* decoder, SecureDataTag& tag, const KeyId& kind,
                     const KeyId& own_key, const void* key, const void* salt, const void* vector,
                     std::uint32_t session, void* exception) {
  static const auto next = Next<decltype(ExemplarReadTag)>(EXEMPLAR_READ_TAG);
  constexpr KeyId kNone{};
  tag.receiver_mac_key_id = kNone;
  if (!next(transform, decoder, tag, kind, own_key, key, salt, vector, session, exception)) {
    return false;
  }
  // Who needs a proof has a key for it.
  if (own_key == kNone || own_key == tag.receiver_mac_key_id) return true;
  ++refused;
  return false;
}

namespace exemplar::bus {

bool MessagesAreGuarded() {
  const auto guarded = [](const char* symbol, auto* ours) {
    return dlsym(RTLD_DEFAULT, symbol) == reinterpret_cast<void*>(ours) &&
           dlsym(RTLD_NEXT, symbol) != nullptr;
  };
  return guarded(EXEMPLAR_INIT, &ExemplarInitSecurity) &&
         guarded(EXEMPLAR_DECODE_MESSAGE, &ExemplarDecodeMessage) &&
         guarded(EXEMPLAR_DECODE_SUBMESSAGE, &ExemplarDecodeSubmessage) &&
         guarded(EXEMPLAR_READ_TAG, &ExemplarReadTag);
}

std::uint64_t RefusedMessages() { return refused; }

}  // namespace exemplar::bus
