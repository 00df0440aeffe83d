#pragma once

namespace exemplar::bus {

/// Lets one thread at a time begin to greet a newcomer of a secured station; for this whole
/// process, from the program's start. False where the Fast DDS in use goes its own way.
bool GreetingsAreGuarded();

}  // namespace exemplar::bus
