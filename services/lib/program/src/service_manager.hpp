#pragma once
// What systemd wants to hear from a service (sd_notify(3)), without its library.

#include <chrono>
#include <string_view>

namespace exemplar::program {

/// Sends "READY=1", "WATCHDOG=1", "STOPPING=1" to whoever started this program; nothing where that
/// asked for nothing ($NOTIFY_SOCKET). Thread-safe.
void NotifyServiceManager(std::string_view state);

/// How often "WATCHDOG=1" is due: half of $WATCHDOG_USEC; zero where nobody waits for it.
std::chrono::microseconds WatchdogPeriod();

}  // namespace exemplar::program
