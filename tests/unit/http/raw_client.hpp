#pragma once
// A client that writes the bytes that a test wants, good or bad.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace exemplar::http::testing {

class RawClient {
 public:
  /// From the loopback address that ends in `from`.
  explicit RawClient(int port, int receive_buffer = 0, std::uint8_t from = 1)
      : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) {
      setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(0x7f000000U | from);
    (void)bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    connected_ = connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~RawClient() { close(fd_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  bool connected() const { return connected_; }
  int fd() const { return fd_; }
  bool Send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t n = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  void SendNoMore() { shutdown(fd_, SHUT_WR); }

  /// Everything up to and with `end`; what has come when the server closes or says nothing for
  /// long.
  std::string ReadTo(std::string_view end) {
    while (read_.find(end) == std::string::npos && More()) {
    }
    const std::size_t at = read_.find(end);
    return Cut(at == std::string::npos ? read_.size() : at + end.size());
  }
  std::string Read(std::size_t bytes) {
    while (read_.size() < bytes && More()) {
    }
    return Cut(std::min(bytes, read_.size()));
  }
  std::string ReadAll() {
    while (More()) {
    }
    return Cut(read_.size());
  }
  /// The server has closed; what came before is thrown away.
  bool Closed() {
    ReadAll();
    return ended_;
  }

  /// One answer with Content-Length.
  std::string ReadAnswer() {
    const std::string head = ReadTo("\r\n\r\n");
    const std::size_t at = head.find("Content-Length: ");
    if (at == std::string::npos) return head;
    return head + Read(static_cast<std::size_t>(std::stoul(head.substr(at + 16))));
  }

  // WebSocket.

  std::string Upgrade(const std::string& path, const std::string& more = {}) {
    Send("GET " + path +
         " HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n" +
         more + "\r\n");
    return ReadTo("\r\n\r\n");
  }
  /// `first` is the first byte: 0x81 text, 0x82 binary, 0x88 close, 0x89 ping. The mask is zeros.
  bool SendFrame(std::uint8_t first, std::string_view payload) {
    std::string frame(1, static_cast<char>(first));
    if (payload.size() < 126) {
      frame += static_cast<char>(0x80U | payload.size());
    } else {
      frame += static_cast<char>(0x80U | 127U);
      for (int shift = 56; shift >= 0; shift -= 8) {
        frame += static_cast<char>(payload.size() >> shift & 0xffU);
      }
    }
    frame += std::string(4, '\0');
    return Send(frame) && Send(payload);
  }
  struct Frame {
    int first = -1;
    std::string payload;
  };
  Frame ReadFrame() {
    const std::string head = Read(2);
    if (head.size() < 2) return {};
    std::size_t size = static_cast<std::uint8_t>(head[1]);
    if (size >= 126) {
      std::size_t longer = 0;
      for (const char c : Read(size == 126 ? 2 : 8)) {
        longer = longer << 8 | static_cast<std::uint8_t>(c);
      }
      size = longer;
    }
    return {static_cast<std::uint8_t>(head[0]), Read(size)};
  }

 private:
  bool More() {
    constexpr int kPatienceMs = 10'000;
    pollfd ready{fd_, POLLIN, 0};
    if (ended_ || poll(&ready, 1, kPatienceMs) <= 0) return false;
    char buffer[65536];
    const ssize_t n = recv(fd_, buffer, sizeof buffer, 0);
    if (n <= 0) {
      ended_ = true;
      return false;
    }
    read_.append(buffer, static_cast<std::size_t>(n));
    return true;
  }
  std::string Cut(std::size_t bytes) {
    std::string cut = read_.substr(0, bytes);
    read_.erase(0, bytes);
    return cut;
  }

  int fd_;
  bool connected_ = false;
  bool ended_ = false;
  std::string read_;
};

struct Reply {
  int status = 0;
  std::string head;
  std::string body;
};

/// One request on a connection of its own. `line` is method and target, `fields` are whole lines.
inline Reply Ask(int port, const std::string& line, const std::string& fields = {},
                 const std::string& body = {}) {
  RawClient client(port);
  client.Send(line + " HTTP/1.1\r\nHost: a\r\nConnection: close\r\n" + fields +
              "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  Reply reply;
  reply.head = client.ReadTo("\r\n\r\n");
  reply.body = client.ReadAll();
  if (reply.head.size() > 12) reply.status = std::stoi(reply.head.substr(9, 3));
  return reply;
}

}  // namespace exemplar::http::testing
