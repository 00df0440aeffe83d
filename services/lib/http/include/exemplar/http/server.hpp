#pragma once
// An HTTP/1.1 and WebSocket server that stays up whatever its clients do: everything that a client
// can make grow is bounded, everything that is refused is counted.

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/log.hpp"
#include "exemplar/base/metric.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/http/message.hpp"

namespace exemplar::http {

/// PEM files of a server that speaks TLS 1.2 or later.
struct TlsFiles {
  std::string certificate;      ///< chain, the server's own first
  std::string key;              ///< of the certificate
  std::string client_ca = {};   ///< whose clients' certificates are taken; empty: none asked for
  bool require_client = false;  ///< refuse clients without a certificate
  /// So often the files are read again, as by ReloadTls; 0: never by itself.
  Duration refresh = std::chrono::seconds(30);
};

/// What a client can make the server hold or wait for.
struct Limits {
  std::size_t connections = 512;
  std::size_t connections_per_peer = 256;
  double accepts_per_second = 400;           ///< of all clients together, after a burst of as many
  double accepts_per_second_per_peer = 200;  ///< of one address, likewise
  std::size_t header_bytes = 16 << 10;
  std::size_t body_bytes = 4 << 20;                     ///< unless the route says otherwise
  Duration request_timeout = std::chrono::seconds(10);  ///< for a whole request, once it began
  Duration idle_timeout = std::chrono::seconds(60);     ///< between requests of a connection
  Duration write_timeout = std::chrono::seconds(20);    ///< in which a client takes something
  std::size_t handlers = 32;             ///< that run at once, each on a thread of its own
  std::size_t waiting_requests = 64;     ///< for one of these; beyond that: 503
  std::size_t stream_bytes = 256 << 10;  ///< that wait in a streamed answer before Write blocks
};

/// Which web pages may use the server (browsers say where a page comes from; others do not).
struct Origins {
  /// "https://app.foxglove.dev", "http://localhost:8080"; "*" is any. A page that this server
  /// itself serves under an address, as localhost, or over TLS may always.
  std::vector<std::string> allowed;
};

/// An answer in pieces, for a handler that runs on a thread of its own.
class Stream {
 public:
  virtual ~Stream() = default;
  /// Sends status and headers; called once, before Write.
  virtual void Begin(int status, Headers headers) = 0;
  /// Sends a piece, and waits while the client is behind by `stream_bytes`; false when it has gone
  /// or took nothing for `write_timeout`: nothing more will be sent.
  virtual bool Write(std::string_view piece) = 0;
};

/// Runs on one of the `handlers` threads and may block.
using Handler = std::function<Response(const Request&)>;
/// The same, answering in pieces; the answer ends when it returns. Without Begin: 500.
using StreamHandler = std::function<void(const Request&, Stream&)>;

struct RouteOptions {
  /// Runs on the network thread, whatever else runs: for what answers from memory (/healthz).
  bool quick = false;
  std::size_t body_bytes = 0;  ///< 0: the server's limit
  /// Answered without asking the gate.
  bool open = false;
};

/// What a client receives. The body may be shared by many clients; head goes before it.
struct Frame {
  bool binary = false;
  std::string head = {};
  std::span<const std::byte> body = {};
  std::shared_ptr<const void> owner = {};  ///< keeps `body`; shared by the clients' queues
  /// May be thrown away, oldest first, when the client is behind; others never are.
  bool droppable = false;
  std::uint64_t tag = 0;  ///< comes back when it is dropped
};

/// A client's connection; whoever holds it may send. Thread-safe.
class WebSocket {
 public:
  struct Sent {
    bool open = true;  ///< false: the connection is closed or closing, nothing was queued
    std::vector<std::uint64_t> dropped =
        {};  ///< tags of frames that went for this one, maybe its own
  };
  virtual ~WebSocket() = default;
  /// Queues a frame; never waits. A client whose queue of frames that must not be dropped is full
  /// is closed (1008).
  virtual Sent Send(Frame frame) = 0;
  Sent SendText(std::string text) { return Send({.binary = false, .head = std::move(text)}); }
  /// Sends what is queued of the frames that must not be dropped, then closes with that code.
  virtual void Close(int code, std::string reason) = 0;

  virtual std::uint64_t id() const = 0;  ///< unlike any other of this server
  virtual const std::string& subprotocol() const = 0;
  virtual const Request& request() const = 0;  ///< that it began with
  virtual std::size_t queued_bytes() const = 0;
  virtual std::uint64_t dropped() const = 0;
  /// In total, since it was opened.
  virtual std::uint64_t sent() const = 0;
};

/// What one client's messages do. Called on the network thread, one call at a time, and must
/// return quickly: what takes time goes to another thread.
class WebSocketSession {
 public:
  virtual ~WebSocketSession() = default;
  virtual void OnText(std::string_view text) = 0;
  virtual void OnBinary(std::span<const std::byte> bytes) = 0;
  /// Called once, last.
  virtual void OnClose() = 0;
};

struct WebSocketEndpoint {
  /// In the order of preference. A client that offers none of them is refused (400).
  std::vector<std::string> subprotocols = {};
  std::size_t message_bytes = 1 << 20;  ///< the longest that a client may send
  std::size_t queue_bytes = 16 << 20;   ///< of droppable frames that wait for one client
  std::size_t queue_frames = 4096;
  std::size_t firm_bytes = 32 << 20;            ///< of frames that must not be dropped
  Duration silence = std::chrono::seconds(20);  ///< then a ping; as long again: closed
  std::size_t clients = 128;
  /// Makes the session of a client that has just connected; nullptr refuses it (1013).
  std::function<std::unique_ptr<WebSocketSession>(std::shared_ptr<WebSocket>)> open = {};
};

/// Since the server was made.
struct Counters {
  std::atomic<std::uint64_t> accepted{0};
  std::atomic<std::uint64_t> refused_connections{0};  ///< too many or too fast
  std::atomic<std::uint64_t> requests{0};
  std::atomic<std::uint64_t> bad_requests{0};      ///< not HTTP, too long, broken target
  std::atomic<std::uint64_t> refused_requests{0};  ///< no route, gate, no handler free
  std::atomic<std::uint64_t> refused_origins{0};
  std::atomic<std::uint64_t> timeouts{0};          ///< a request or a client that stopped halfway
  std::atomic<std::uint64_t> handler_failures{0};  ///< answers of 500 and above
  std::atomic<std::uint64_t> websockets{0};        ///< opened
  std::atomic<std::uint64_t> bad_frames{0};        ///< not WebSocket, too long
  std::atomic<std::uint64_t> frames_in{0};
  std::atomic<std::uint64_t> frames_out{0};
  std::atomic<std::uint64_t> frames_dropped{0};
  std::atomic<std::uint64_t> tls_failures{0};
};

struct ServerOptions {
  std::string listen = "127.0.0.1:0";  ///< HOST:PORT, [::1]:PORT; port 0 picks a free one
  Limits limits = {};
  Origins origins = {};
  std::optional<TlsFiles> tls = {};
  /// Asked before every handler and endpoint, on the network thread: an answer refuses the request;
  /// it may set `identity`. Null: all may.
  std::function<std::optional<Response>(Request&)> gate = {};
  Duration grace = std::chrono::seconds(2);  ///< for what is underway when the server stops
};

/// Routes are added before Start; everything else is thread-safe.
class Server {
 public:
  /// Listens; answers nothing before Start. kInvalidArgument: no address, TLS files that cannot be
  /// used; kUnavailable: the address is taken. The log outlives the server.
  static Result<std::unique_ptr<Server>> Create(ServerOptions options, Log& log);
  /// Stops.
  virtual ~Server() = default;

  /// kInvalidArgument for a pattern that is none or there already.
  virtual Status Route(Method method, std::string_view pattern, Handler handler,
                       RouteOptions options = {}) = 0;
  virtual Status RouteStream(Method method, std::string_view pattern, StreamHandler handler,
                             RouteOptions options = {}) = 0;
  virtual Status RouteWebSocket(std::string_view pattern, WebSocketEndpoint endpoint) = 0;

  virtual void Start() = 0;
  /// Takes no more connections, asks what runs to end (`Request::gone`), tells WebSockets that it
  /// goes (1001), and cuts what is left after `grace`. Handlers have returned afterwards.
  virtual void Stop() = 0;
  /// Reads the TLS files again for connections to come; the old ones stay if these cannot be used.
  virtual Status ReloadTls() = 0;

  virtual int port() const = 0;
  virtual std::size_t connections() const = 0;
  virtual const Counters& counters() const = 0;
};

/// The counters and gauges as metrics "exemplar_http_...". The server outlives them.
std::vector<Metric> MetricsOf(const Server& server);

}  // namespace exemplar::http
