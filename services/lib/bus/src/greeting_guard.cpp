// Secured, Fast DDS 2.9.1 finds newcomers on several threads (multicast, unicast, shared memory)
// and prepares the greeting in records that all of them share, without a lock
// (SecurityManager::match_builtin_endpoints). Where two newcomers are found at one moment, the one
// is entered as the other, its handshake is dropped ever after, and the two participants never
// meet: seen with one pair in a hundred on a busy machine. The function has a symbol of its own, so
// the definition here stands before the library's and takes turns.

#include "greeting_guard.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <mutex>

#define EXEMPLAR_MATCH                                                   \
  "_ZN8eprosima8fastrtps4rtps8security15SecurityManager23match_builtin_" \
  "endpointsERKNS1_20ParticipantProxyDataE"

/// Called by Fast DDS: the object and its one argument, a reference.
extern "C" __attribute__((visibility("default"))) void ExemplarMatchInTurn(
    void* manager, const void* newcomer) __asm__(EXEMPLAR_MATCH);

void ExemplarMatchInTurn(void* manager, const void* newcomer) {
  using Match = void (*)(void*, const void*);
  static const auto match = reinterpret_cast<Match>(dlsym(RTLD_NEXT, EXEMPLAR_MATCH));
  static std::mutex turn;
  if (match == nullptr) std::abort();  // whoever calls it, has it
  const std::lock_guard lock(turn);
  match(manager, newcomer);
}

namespace exemplar::bus {

bool GreetingsAreGuarded() {
  return dlsym(RTLD_DEFAULT, EXEMPLAR_MATCH) == reinterpret_cast<void*>(&ExemplarMatchInTurn) &&
         dlsym(RTLD_NEXT, EXEMPLAR_MATCH) != nullptr;
}

}  // namespace exemplar::bus
