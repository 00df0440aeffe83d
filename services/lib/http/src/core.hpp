#pragma once
// What a server's connections share. Everything but the counters, the pool and Post is touched on
// the network thread only.

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <memory>
#include <unordered_map>

#include "admission.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/http/server.hpp"
#include "handler_pool.hpp"
#include "routes.hpp"

namespace exemplar::http {

/// One client's socket, whatever is spoken on it. On the network thread.
class Connection {
 public:
  virtual ~Connection() = default;
  /// Ends once what is underway has ended; asks it to.
  virtual void Finish() = 0;
  /// Ends now.
  virtual void Cut() = 0;
};

struct Core {
  Core(ServerOptions the_options, Log& the_log)
      : options(std::move(the_options)),
        log(the_log),
        admission(options.limits, clock.Steady()),
        pool(std::make_unique<HandlerPool>(options.limits.handlers,
                                           options.limits.waiting_requests)) {}

  ServerOptions options;
  Log& log;
  SystemClock clock;
  Counters counters;
  Routes routes;
  Admission admission;
  std::atomic<std::size_t> open_connections{0};
  std::atomic<std::uint64_t> next_id{1};
  bool stopping = false;
  std::unordered_map<std::uint64_t, std::weak_ptr<Connection>> connections;
  std::unique_ptr<HandlerPool> pool;
  boost::asio::io_context network{1};
};

/// A place among the connections, given back when it goes.
class Admitted {
 public:
  Admitted(Core& core, std::string peer)
      : core_(core), peer_(std::move(peer)), id_(core.next_id++) {
    ++core_.open_connections;
  }
  ~Admitted() {
    core_.admission.Leave(peer_);
    core_.connections.erase(id_);
    --core_.open_connections;
  }
  Admitted(const Admitted&) = delete;
  Admitted& operator=(const Admitted&) = delete;
  const std::string& peer() const { return peer_; }
  std::uint64_t id() const { return id_; }

 private:
  Core& core_;
  std::string peer_;
  std::uint64_t id_;
};

/// A request that became a WebSocket: what both connections know of it.
struct Upgrade {
  const RouteEntry* route;
  Request request;
  std::string subprotocol;
};

using TlsContext = std::shared_ptr<boost::asio::ssl::context>;

/// Serve a socket that has just been accepted (plain.cpp, tls.cpp).
void ServePlain(Core& core, boost::asio::ip::tcp::socket socket,
                std::unique_ptr<Admitted> admitted);
void ServeTls(Core& core, boost::asio::ip::tcp::socket socket, std::unique_ptr<Admitted> admitted,
              TlsContext context);
/// kInvalidArgument: files that cannot be used.
Result<TlsContext> MakeTlsContext(const TlsFiles& files);

}  // namespace exemplar::http
