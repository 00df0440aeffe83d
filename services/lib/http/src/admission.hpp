#pragma once
// Who may connect: how many at once, and how fast.

#include <list>
#include <string>
#include <unordered_map>

#include "exemplar/base/stamp.hpp"
#include "exemplar/http/server.hpp"

namespace exemplar::http {

/// So many a second on average, after a burst of one second's worth. Thread-compatible.
class Allowance {
 public:
  Allowance(double per_second, Duration now)
      : per_second_(per_second), left_(per_second), as_of_(now) {}
  bool Take(Duration now);

 private:
  double per_second_;
  double left_;
  Duration as_of_;
};

/// Thread-compatible. `now` is any steady time.
class Admission {
 public:
  Admission(const Limits& limits, Duration now);

  /// Whether one more connection of that address may be; Leave follows when it ends.
  bool Enter(const std::string& peer, Duration now);
  void Leave(const std::string& peer);
  std::size_t connections() const { return connections_; }

 private:
  struct Peer {
    Allowance rate;
    std::size_t connections = 0;
    std::list<std::string>::iterator age;
  };
  Peer& Known(const std::string& peer, Duration now);

  Limits limits_;
  Allowance rate_;
  std::size_t connections_ = 0;
  std::unordered_map<std::string, Peer> peers_;
  std::list<std::string> ages_;  ///< of addresses, the one heard of last first
};

}  // namespace exemplar::http
