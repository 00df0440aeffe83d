// A few lines of HTTP/1.0 over a listening socket: prometheus-cpp's own server takes 2 s to stop.

#include <arpa/inet.h>
#include <netdb.h>
#include <poll.h>
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>
#include <utility>

#include "exemplar/program/runtime.hpp"

namespace exemplar::program {
namespace {

constexpr int kRequestTimeoutMs = 1000;
constexpr std::size_t kLongestRequest = 8192;

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) close(fd_);
  }
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&&) = delete;
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

std::string MetricsText(const std::vector<Metric>& metrics) {
  std::vector<prometheus::MetricFamily> families;
  for (const Metric& metric : metrics) {
    prometheus::MetricFamily family;
    family.name = metric.name;
    family.help = metric.help;
    family.type = metric.counter ? prometheus::MetricType::Counter : prometheus::MetricType::Gauge;
    for (const Metric::Value& value : metric.values()) {
      prometheus::ClientMetric point;
      for (const auto& [name, text] : value.labels) point.label.push_back({name, text});
      if (metric.counter) {
        point.counter.value = value.value;
      } else {
        point.gauge.value = value.value;
      }
      family.metric.push_back(std::move(point));
    }
    families.push_back(std::move(family));
  }
  return prometheus::TextSerializer().Serialize(families);
}

namespace {

bool ReadHead(int fd, std::string& head) {
  char buffer[1024];
  const auto deadline =
      std::chrono::steady_clock::now() + std::chrono::milliseconds(kRequestTimeoutMs);
  while (head.find("\r\n") == std::string::npos && head.size() < kLongestRequest) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        deadline - std::chrono::steady_clock::now());
    pollfd ready{fd, POLLIN, 0};
    if (left.count() <= 0 || poll(&ready, 1, static_cast<int>(left.count())) <= 0) return false;
    const ssize_t n = recv(fd, buffer, sizeof buffer, 0);
    if (n <= 0) return false;
    head.append(buffer, static_cast<std::size_t>(n));
  }
  return true;
}

class SocketMetricsServer final : public MetricsServer {
 public:
  SocketMetricsServer(FileDescriptor listener, int port, std::vector<Metric> metrics)
      : listener_(std::move(listener)), port_(port), metrics_(std::move(metrics)) {
    thread_ = std::jthread([this](const std::stop_token& stop) { Serve(stop); });
  }

  int port() const override { return port_; }

 private:
  void Serve(const std::stop_token& stop) {
    constexpr int kStopCheckMs = 100;
    while (!stop.stop_requested()) {
      pollfd ready{listener_.get(), POLLIN, 0};
      if (poll(&ready, 1, kStopCheckMs) <= 0) continue;
      const FileDescriptor client(accept(listener_.get(), nullptr, nullptr));
      if (client.get() >= 0) Answer(client.get());
    }
  }

  void Answer(int fd) {
    std::string head;
    if (!ReadHead(fd, head)) return;
    std::string status = "200 OK";
    std::string body;
    if (head.starts_with("GET /metrics ")) {
      body = MetricsText(metrics_);
    } else if (head.starts_with("GET /healthz ")) {
      body = "ok\n";
    } else {
      status = "404 Not Found";
      body = "only /metrics and /healthz are here\n";
    }
    const std::string answer = "HTTP/1.0 " + status +
                               "\r\nContent-Type: text/plain; version=0.0.4\r\nContent-Length: " +
                               std::to_string(body.size()) + "\r\nConnection: close\r\n\r\n" + body;
    std::size_t sent = 0;
    while (sent < answer.size()) {
      const ssize_t n = send(fd, answer.data() + sent, answer.size() - sent, MSG_NOSIGNAL);
      if (n <= 0) return;
      sent += static_cast<std::size_t>(n);
    }
  }

  FileDescriptor listener_;
  int port_;
  std::vector<Metric> metrics_;
  std::jthread thread_;
};

}  // namespace

Result<std::unique_ptr<MetricsServer>> MetricsServer::Create(const std::string& address,
                                                             std::vector<Metric> metrics) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos) {
    return InvalidArgument("--metrics: \"" + address + "\" is not HOST:PORT", "metrics");
  }
  const std::string host = address.substr(0, colon);
  const std::string port = address.substr(colon + 1);
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int code =
          getaddrinfo(host.empty() ? nullptr : host.c_str(), port.c_str(), &hints, &found);
      code != 0) {
    return InvalidArgument("--metrics: \"" + address + "\": " + gai_strerror(code), "metrics");
  }
  FileDescriptor listener(socket(found->ai_family, found->ai_socktype, 0));
  const int on = 1;
  setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const bool bound = bind(listener.get(), found->ai_addr, found->ai_addrlen) == 0 &&
                     ::listen(listener.get(), 16) == 0;
  const int reason = errno;
  freeaddrinfo(found);
  if (!bound)
    return Unavailable("--metrics: cannot listen on " + address + ": " + std::strerror(reason));

  sockaddr_storage local{};
  socklen_t size = sizeof local;
  getsockname(listener.get(), reinterpret_cast<sockaddr*>(&local), &size);
  const int actual =
      ntohs(local.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(local).sin6_port
                                        : reinterpret_cast<const sockaddr_in&>(local).sin_port);
  return std::unique_ptr<MetricsServer>(
      std::make_unique<SocketMetricsServer>(std::move(listener), actual, std::move(metrics)));
}

Result<std::unique_ptr<MetricsServer>> ServeMetrics(const CommonOptions& options,
                                                    std::vector<Metric> metrics) {
  if (options.metrics.empty()) return std::unique_ptr<MetricsServer>();
  return MetricsServer::Create(options.metrics, std::move(metrics));
}

}  // namespace exemplar::program
