// The parts of the gateway's load: a writer of many topics, a bare reader that relays them over
// TCP, and the clients of both. tests/bench/gateway.py starts them; each is a process of its own.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <fstream>
#include <iostream>

#include "exemplar/bus/participant.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/rpc/client.hpp"

namespace {

using namespace exemplar;

constexpr int kClients = 10;
constexpr int kTopicsOfAClient = 20;
constexpr std::size_t kPayload = 160;
constexpr std::size_t kStampAt = 20;  ///< of the CDR bytes, with the encapsulation header
constexpr const char* kIdl =
    "module bench { @final struct Note { @key string source; unsigned long long seq; "
    "long long stamp_ns; octet payload[160]; }; };";

std::string TopicName(int client, int number) {
  return "bench/" + std::to_string(client) + "/" + std::to_string(number);
}

std::int64_t NowNs() { return SystemClock().Steady().count(); }

/// What a client waited for each sample, as text: one number of microseconds a line.
class Waits {
 public:
  void Add(const std::vector<std::uint8_t>& cdr) {
    std::int64_t stamp = 0;
    if (cdr.size() < kStampAt + sizeof stamp) return;
    std::memcpy(&stamp, cdr.data() + kStampAt, sizeof stamp);
    waits_us_.push_back(static_cast<double>(NowNs() - stamp) / 1e3);
  }
  void Write(const std::string& file) const {
    std::ofstream out(file);
    for (const double wait : waits_us_) out << wait << "\n";
  }

 private:
  std::vector<double> waits_us_;
};

int Publish(bus::Participant& participant, double seconds, double rate_hz) {
  std::vector<std::unique_ptr<ircp::RawWriter>> writers;
  for (int client = 0; client < kClients; ++client) {
    for (int number = 0; number < kTopicsOfAClient; ++number) {
      ircp::RawTopic topic;
      topic.topic = TopicName(client, number);
      topic.type = "bench::Note";
      topic.schema = kIdl;
      topic.keyed = true;
      topic.reliable = true;
      auto writer = participant.MakeRawWriter(topic);
      if (!writer) return program::Fail("bench_gateway", writer.error());
      writers.push_back(std::move(*writer));
    }
  }
  std::vector<std::uint8_t> cdr(kStampAt + 8 + kPayload);
  cdr[1] = 1;
  cdr[4] = 2;  // the source "b" with its zero, then padding to 8
  cdr[8] = 'b';
  const SystemClock clock;
  constexpr auto kTick = std::chrono::milliseconds(1);
  const double each_tick = rate_hz * ToSeconds(kTick);
  double due = 0;
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;
  Duration latest{0};
  Duration tick = clock.Steady();
  const Duration end = tick + FromSeconds(seconds);
  while (tick < end) {
    tick += kTick;
    clock.SleepUntil(tick, {});
    latest = std::max(latest, clock.Steady() - tick);
    for (due += each_tick; due >= 1; --due) {
      const std::uint64_t seq = 1 + sent / writers.size();
      std::memcpy(cdr.data() + 12, &seq, sizeof seq);
      const std::int64_t now = NowNs();
      std::memcpy(cdr.data() + kStampAt, &now, sizeof now);
      if (!writers[sent % writers.size()]->Write(cdr, clock.Now())) ++refused;
      ++sent;
    }
  }
  std::cout << "{\"sent\": " << sent << ", \"refused\": " << refused
            << ", \"latest_ms\": " << 1e3 * ToSeconds(latest) << "}\n";
  return 0;
}

/// Sends every sample to the one client that wants it, from the network's thread.
int Relay(bus::Participant& participant, const std::string& port_file, std::stop_token stop) {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(listener, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      listen(listener, kClients) != 0 ||
      getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    return program::Fail("bench_gateway", Internal("the relay cannot listen"));
  }
  std::array<std::atomic<int>, kClients> clients{};
  auto tap = participant.MakeTap(
      {.wanted = [](const ircp::RawTopic& topic) { return topic.topic.starts_with("bench/"); },
       .on_sample =
           [&clients](ircp::RawSample&& sample) {
             const int client = clients.at(static_cast<std::size_t>(sample.topic[6] - '0')).load();
             if (client == 0) return;
             std::vector<std::uint8_t> frame(4);
             const auto bytes = static_cast<std::uint32_t>(sample.cdr.size());
             std::memcpy(frame.data(), &bytes, sizeof bytes);
             frame.insert(frame.end(), sample.cdr.begin(), sample.cdr.end());
             (void)send(client, frame.data(), frame.size(), MSG_NOSIGNAL);
           }});
  if (!tap) return program::Fail("bench_gateway", tap.error());
  std::ofstream(port_file) << ntohs(address.sin_port) << std::endl;
  const std::stop_callback end(stop, [listener] { shutdown(listener, SHUT_RDWR); });
  for (;;) {
    const int client = accept(listener, nullptr, nullptr);
    if (client < 0) break;
    const int on = 1;
    setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    std::uint8_t index = 0;
    if (recv(client, &index, 1, MSG_WAITALL) == 1 && index < kClients) clients.at(index) = client;
  }
  tap->reset();
  return 0;
}

bool ReadAll(int fd, void* to, std::size_t bytes) {
  return recv(fd, to, bytes, MSG_WAITALL) == static_cast<ssize_t>(bytes);
}

int TcpClient(int port, int index, Duration from, Duration to, Waits& waits) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) return 1;
  const auto which = static_cast<std::uint8_t>(index);
  (void)send(fd, &which, 1, MSG_NOSIGNAL);
  const SystemClock clock;
  std::vector<std::uint8_t> cdr;
  std::uint32_t bytes = 0;
  while (clock.Steady() < to && ReadAll(fd, &bytes, sizeof bytes)) {
    cdr.resize(bytes);
    if (!ReadAll(fd, cdr.data(), bytes)) break;
    if (clock.Steady() >= from) waits.Add(cdr);
  }
  close(fd);
  return 0;
}

int GrpcClient(const std::string& server, int index, Duration from, Duration to, Waits& waits) {
  const auto clients = rpc::Connect({.server = server, .wait_for_server = std::chrono::seconds(5)});
  if (!clients) return program::Fail("bench_gateway", clients.error());
  const SystemClock clock;
  const Status done =
      clients->topics->Subscribe({.topics = {"bench/" + std::to_string(index) + "/*"}},
                                 [&](const api::TopicBatch& batch) {
                                   if (clock.Steady() >= from) {
                                     for (const api::TopicSample& sample : batch.samples)
                                       waits.Add(sample.cdr);
                                   }
                                   return clock.Steady() < to;
                                 },
                                 {});
  return done ? 0 : program::Fail("bench_gateway", done.error());
}

/// Asks for everything and takes one message of it.
int StalledClient(const std::string& server, const std::stop_token& stop) {
  const auto clients = rpc::Connect({.server = server, .wait_for_server = std::chrono::seconds(5)});
  if (!clients) return program::Fail("bench_gateway", clients.error());
  const SystemClock clock;
  (void)clients->topics->Subscribe(
      {},
      [&](const api::TopicBatch&) {
        clock.SleepFor(std::chrono::hours(1), stop);
        return false;
      },
      stop);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  constexpr const char* kName = "bench_gateway";
  program::Options options(kName, "Parts of the gateway's load", "see tests/bench/gateway.py",
                           {.bus = true});
  std::string part;
  std::string server;
  std::string file;
  int index = 0;
  double seconds = 5;
  double warm_up = 1;
  double rate_hz = 10000;
  options.Add("--part", part, "what this process is")
      .Required()
      .OneOf({"publish", "relay", "tcp", "grpc", "stalled"});
  options.Add("--server", server, "HOST:PORT of the gateway, or the relay's port");
  options.Add("--file", file, "that gets the relay's port, or the client's waits");
  options.Add("--index", index, "which client").MinMax(0, kClients - 1);
  options.Add("--seconds", seconds, "of publishing or listening");
  options.Add("--warm-up", warm_up, "seconds that a client does not count");
  options.Add("--rate-hz", rate_hz, "of all topics together").MinMax(1, 1e6);
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  program::Signals signals;
  const Duration from = SystemClock().Steady() + FromSeconds(warm_up);
  const Duration to = from + FromSeconds(seconds);
  Waits waits;
  if (part == "stalled") return StalledClient(server, signals.token());
  if (part == "tcp" || part == "grpc") {
    const int code = part == "tcp" ? TcpClient(std::stoi(server), index, from, to, waits)
                                   : GrpcClient(server, index, from, to, waits);
    waits.Write(file);
    return code;
  }
  const program::CommonOptions& common = options.common();
  auto participant =
      bus::Participant::Create({.domain = common.domain, .station = common.station, .name = kName});
  if (!participant) return program::Fail(kName, participant.error());
  return part == "publish" ? Publish(**participant, seconds, rate_hz)
                           : Relay(**participant, file, signals.token());
}
