#pragma once
#include <cstdint>

namespace exemplar::bus {

/// Whether secured participants of this process refuse messages in another's name; for this whole
/// process, from the program's start. False where the Fast DDS in use goes its own way.
bool MessagesAreGuarded();

/// How many messages this process's secured participants have refused.
std::uint64_t RefusedMessages();

}  // namespace exemplar::bus
