// The asking side of /healthz, for --check.

#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "exemplar/program/runtime.hpp"

namespace exemplar::program {
namespace {

struct Socket {
  explicit Socket(int fd_in) : fd(fd_in) {}
  ~Socket() {
    if (fd >= 0) close(fd);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd;
};

/// Where a server that listens on `host` is reached from its own machine.
std::string Reachable(const std::string& host) {
  if (host.empty() || host == "0.0.0.0") return "127.0.0.1";
  if (host == "::" || host == "[::]") return "::1";
  return host;
}

}  // namespace

Status CheckHealth(const std::string& address, std::chrono::milliseconds patience) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos) {
    return InvalidArgument("--metrics: \"" + address + "\" is not HOST:PORT", "metrics");
  }
  const auto unreachable = [&address](const std::string& why) {
    return Unavailable("no healthy program answers on " + address + ": " + why);
  };
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const std::string host = Reachable(address.substr(0, colon));
  if (const int code = getaddrinfo(host.c_str(), address.substr(colon + 1).c_str(), &hints, &found);
      code != 0) {
    return InvalidArgument("--metrics: \"" + address + "\": " + gai_strerror(code), "metrics");
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> place(found, freeaddrinfo);
  const Socket socket(::socket(place->ai_family, place->ai_socktype | SOCK_CLOEXEC, 0));
  // The limits hold for connect as well.
  const timeval limit{patience.count() / 1000, patience.count() % 1000 * 1000};
  setsockopt(socket.fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  setsockopt(socket.fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  if (connect(socket.fd, place->ai_addr, place->ai_addrlen) != 0) {
    return unreachable(std::strerror(errno));
  }
  const std::string request = "GET /healthz HTTP/1.0\r\n\r\n";
  if (send(socket.fd, request.data(), request.size(), MSG_NOSIGNAL) < 0) {
    return unreachable(std::strerror(errno));
  }
  std::string line;
  char buffer[256];
  while (line.find("\r\n") == std::string::npos && line.size() < sizeof buffer) {
    const ssize_t n = recv(socket.fd, buffer, sizeof buffer, 0);
    if (n < 0) return unreachable(std::strerror(errno));
    if (n == 0) break;
    line.append(buffer, static_cast<std::size_t>(n));
  }
  line.resize(std::min(line.size(), line.find("\r\n")));
  if (line.find(" 200 ") == std::string::npos) return unreachable('"' + line + '"');
  return {};
}

}  // namespace exemplar::program
