#include "exemplar/http/server.hpp"

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/steady_timer.hpp>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include "core.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::http {
namespace {

using boost::asio::ip::tcp;

struct Address {
  std::string host;
  std::string port;
};

Result<Address> ParseAddress(const std::string& text) {
  constexpr long long kLastPort = 65535;
  const std::size_t colon = text.rfind(':');
  const auto port =
      colon == std::string::npos ? std::nullopt : ParseInteger(text.substr(colon + 1));
  if (!port || *port < 0 || *port > kLastPort) {
    return InvalidArgument("\"" + text + "\" is not HOST:PORT", "listen");
  }
  std::string host = text.substr(0, colon);
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  return Address{host.empty() ? "0.0.0.0" : host, std::to_string(*port)};
}

Status Listen(tcp::acceptor& acceptor, boost::asio::io_context& network,
              const std::string& listen) {
  const Result<Address> address = ParseAddress(listen);
  if (!address.ok()) return address.error();
  boost::system::error_code error;
  const auto found = tcp::resolver(network).resolve(
      address->host, address->port, tcp::resolver::passive | tcp::resolver::numeric_service, error);
  if (error || found.empty()) {
    return InvalidArgument("\"" + listen + "\": " + error.message(), "listen");
  }
  const tcp::endpoint endpoint = found.begin()->endpoint();
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(boost::asio::socket_base::max_listen_connections, error);
  if (error) return Unavailable("cannot listen on " + listen + ": " + error.message());
  return {};
}

class BeastServer final : public Server {
 public:
  BeastServer(ServerOptions options, Log& log, TlsContext tls)
      : core_(std::move(options), log),
        tls_(std::move(tls)),
        acceptor_(core_.network),
        pause_(core_.network),
        refresh_(core_.network) {}

  ~BeastServer() override { Stop(); }

  Status Open() {
    Status open = Listen(acceptor_, core_.network, core_.options.listen);
    if (open.ok()) port_ = acceptor_.local_endpoint().port();
    return open;
  }

  Status Route(Method method, std::string_view pattern, Handler handler,
               RouteOptions options) override {
    return Add(method, pattern, std::move(handler), options);
  }

  Status RouteStream(Method method, std::string_view pattern, StreamHandler handler,
                     RouteOptions options) override {
    return Add(method, pattern, std::move(handler), options);
  }

  Status RouteWebSocket(std::string_view pattern, WebSocketEndpoint endpoint) override {
    return Add(Method::kGet, pattern, std::move(endpoint), {});
  }

  void Start() override {
    work_.emplace(core_.network.get_executor());
    boost::asio::post(core_.network, [this] {
      Accept();
      RefreshTls();
    });
    thread_ = std::thread([this] { core_.network.run(); });
  }

  void Stop() override {
    const std::lock_guard lock(stop_);
    if (!thread_.joinable()) return;
    OnNetwork([this] {
      core_.stopping = true;
      boost::system::error_code ignored;
      acceptor_.close(ignored);
      pause_.cancel();
      refresh_.cancel();
      ForEach(&Connection::Finish);
    });
    AwaitEnd(core_.options.grace);
    OnNetwork([this] { ForEach(&Connection::Cut); });
    core_.pool.reset();
    work_.reset();
    thread_.join();
  }

  Status ReloadTls() override {
    if (!core_.options.tls) return FailedPrecondition("this server speaks no TLS");
    Result<TlsContext> tls = MakeTlsContext(*core_.options.tls);
    if (!tls.ok()) return tls.error();
    const std::lock_guard lock(tls_mutex_);
    tls_ = std::move(*tls);
    return {};
  }

  int port() const override { return port_; }
  std::size_t connections() const override { return core_.open_connections; }
  const Counters& counters() const override { return core_.counters; }

 private:
  template <class AnyHandler>
  Status Add(Method method, std::string_view text, AnyHandler handler, RouteOptions options) {
    Result<PathPattern> pattern = PathPattern::Parse(text);
    if (!pattern.ok()) return pattern.error();
    return core_.routes.Add({std::move(*pattern), method, options, std::move(handler),
                             std::make_shared<std::atomic<std::size_t>>(0)});
  }

  void Accept() {
    acceptor_.async_accept([this](boost::system::error_code error, tcp::socket socket) {
      if (core_.stopping) return;
      if (error) {  // no file descriptors left, say: the next try may do
        core_.log.Warning("cannot accept a connection", {{"why", error.message()}});
        pause_.expires_after(std::chrono::milliseconds(100));
        pause_.async_wait([this](boost::system::error_code stopped) {
          if (!stopped) Accept();
        });
        return;
      }
      Take(std::move(socket));
      Accept();
    });
  }

  /// Files that are being replaced may not fit together for a moment.
  void RefreshTls() {
    if (!core_.options.tls || core_.options.tls->refresh <= Duration::zero()) return;
    refresh_.expires_after(core_.options.tls->refresh);
    refresh_.async_wait([this](boost::system::error_code stopped) {
      if (stopped || core_.stopping) return;
      const Status done = ReloadTls();
      const std::string problem = done.ok() ? std::string() : done.error().message;
      if (!problem.empty() && problem != tls_problem_) {
        core_.log.Warning("TLS files not read again; the old ones stay", {{"why", problem}});
      }
      tls_problem_ = problem;
      RefreshTls();
    });
  }

  void Take(tcp::socket socket) {
    boost::system::error_code error;
    const tcp::endpoint remote = socket.remote_endpoint(error);
    if (error) return;
    std::string peer = remote.address().to_string();
    if (!core_.admission.Enter(peer, core_.clock.Steady())) {
      ++core_.counters.refused_connections;
      socket.set_option(boost::asio::socket_base::linger(true, 0), error);
      return;
    }
    ++core_.counters.accepted;
    socket.set_option(tcp::no_delay(true), error);
    auto admitted = std::make_unique<Admitted>(core_, std::move(peer));
    TlsContext tls;
    {
      const std::lock_guard lock(tls_mutex_);
      tls = tls_;
    }
    if (tls) {
      ServeTls(core_, std::move(socket), std::move(admitted), std::move(tls));
    } else {
      ServePlain(core_, std::move(socket), std::move(admitted));
    }
  }

  template <class Task>
  void OnNetwork(Task task) {
    std::promise<void> done;
    boost::asio::post(core_.network, [&] {
      task();
      done.set_value();
    });
    done.get_future().wait();
  }

  /// A connection may leave the map while it is asked.
  void ForEach(void (Connection::*ask)()) {
    std::vector<std::shared_ptr<Connection>> open;
    for (const auto& entry : core_.connections) {
      if (auto connection = entry.second.lock()) open.push_back(std::move(connection));
    }
    for (const auto& connection : open) (connection.get()->*ask)();
  }

  void AwaitEnd(Duration grace) {
    constexpr Duration kStep = std::chrono::milliseconds(5);
    const Duration end = core_.clock.Steady() + grace;
    while (core_.open_connections > 0 && core_.clock.Steady() < end) core_.clock.SleepFor(kStep);
  }

  std::mutex tls_mutex_;
  std::mutex stop_;
  Core core_;
  TlsContext tls_;
  tcp::acceptor acceptor_;
  boost::asio::steady_timer pause_;
  boost::asio::steady_timer refresh_;
  std::string tls_problem_;  ///< of the last refresh; empty: none
  std::optional<boost::asio::executor_work_guard<boost::asio::io_context::executor_type>> work_;
  std::thread thread_;
  int port_ = 0;
};

}  // namespace

Result<std::unique_ptr<Server>> Server::Create(ServerOptions options, Log& log) {
  TlsContext tls;
  if (options.tls) {
    Result<TlsContext> made = MakeTlsContext(*options.tls);
    if (!made.ok()) return made.error();
    tls = std::move(*made);
  }
  auto server = std::make_unique<BeastServer>(std::move(options), log, std::move(tls));
  if (Status open = server->Open(); !open.ok()) return open.error();
  return std::unique_ptr<Server>(std::move(server));
}

std::vector<Metric> MetricsOf(const Server& server) {
  const Counters& counters = server.counters();
  std::vector<Metric> metrics;
  const auto add = [&](const char* name, const char* help,
                       const std::atomic<std::uint64_t>& counter) {
    metrics.push_back(CounterOf(std::string("exemplar_http_") + name + "_total", help,
                                [&counter] { return counter.load(); }));
  };
  add("connections", "Connections that were let in.", counters.accepted);
  add("refused_connections", "Connections beyond the number or rate allowed.",
      counters.refused_connections);
  add("requests", "Requests whose head was read.", counters.requests);
  add("bad_requests", "Requests that were not HTTP, too long, or of a broken target.",
      counters.bad_requests);
  add("refused_requests", "Requests without route, permission or free handler.",
      counters.refused_requests);
  add("refused_origins", "Requests of web pages that may not use this server.",
      counters.refused_origins);
  add("timeouts", "Clients that stopped halfway.", counters.timeouts);
  add("handler_failures", "Answers of status 500 and above by a handler.",
      counters.handler_failures);
  add("websockets", "WebSockets opened.", counters.websockets);
  add("bad_frames", "WebSockets closed for what they sent.", counters.bad_frames);
  add("frames_in", "WebSocket messages received.", counters.frames_in);
  add("frames_out", "WebSocket messages sent.", counters.frames_out);
  add("frames_dropped", "WebSocket messages dropped for slow clients.", counters.frames_dropped);
  add("tls_failures", "TLS handshakes that failed.", counters.tls_failures);
  metrics.push_back(GaugeOf("exemplar_http_open_connections", "Connections there are now.",
                            [&server] { return server.connections(); }));
  return metrics;
}

}  // namespace exemplar::http
