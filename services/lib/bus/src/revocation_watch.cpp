#include "revocation_watch.hpp"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "exemplar/security/certificate.hpp"

namespace exemplar::bus {
namespace {

std::optional<std::vector<std::string>> SerialsOn(const std::filesystem::path& list) {
  std::ifstream in(list, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  auto serials = security::ReadRevocationList(text.str(), list.string());
  if (!in.is_open() || !serials) return std::nullopt;
  return std::move(*serials);
}

/// The first of `now` that is not in `before`, both sorted.
std::optional<std::string> FirstNew(const std::vector<std::string>& before,
                                    const std::vector<std::string>& now) {
  const auto is_new = [&](const std::string& serial) {
    return !std::binary_search(before.begin(), before.end(), serial);
  };
  const auto found = std::find_if(now.begin(), now.end(), is_new);
  if (found == now.end()) return std::nullopt;
  return *found;
}

}  // namespace

RevocationWatch::RevocationWatch(Options options) {
  auto known = SerialsOn(options.list).value_or(std::vector<std::string>());
  thread_ = std::jthread(
      [options = std::move(options), known = std::move(known)](const std::stop_token& stop) {
        std::mutex mutex;
        std::condition_variable_any never;
        std::unique_lock lock(mutex);
        using Clock = std::chrono::steady_clock;
        Clock::time_point next_day = Clock::now() + options.day;
        while (!never.wait_for(lock, stop, options.period, [&] { return stop.stop_requested(); })) {
          if (options.on_day && Clock::now() >= next_day) {
            options.on_day();
            next_day = Clock::now() + options.day;
          }
          const auto now = SerialsOn(options.list);
          if (!now) continue;
          if (const std::optional<std::string> serial = FirstNew(known, *now)) {
            options.on_revoked(*serial);
            return;
          }
        }
      });
}

void EndProcess() { ::kill(::getpid(), SIGTERM); }

}  // namespace exemplar::bus
