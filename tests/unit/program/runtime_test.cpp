#include "exemplar/program/runtime.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>

namespace exemplar::program {
namespace {

std::string Get(int port, const std::string& path) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const std::string request = "GET " + path + " HTTP/1.0\r\n\r\n";
  EXPECT_EQ(send(fd, request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  std::string answer;
  char buffer[4096];
  for (ssize_t n = 0; (n = recv(fd, buffer, sizeof buffer, 0)) > 0;) {
    answer.append(buffer, static_cast<std::size_t>(n));
  }
  close(fd);
  return answer;
}

TEST(MetricsServerTest, ServesWhatItsMetricsSayNow) {
  double messages = 3;
  std::vector<Metric> metrics{
      {.name = "exemplar_messages_total",
       .help = "messages written",
       .counter = true,
       .values = [&] {
         return std::vector<Metric::Value>{{{{"topic", "ircp/suit"}}, messages}};
       }}};
  const auto server = MetricsServer::Create("127.0.0.1:0", metrics);
  ASSERT_TRUE(server.ok());
  messages = 5;
  EXPECT_THAT(Get((*server)->port(), "/metrics"),
              testing::HasSubstr("exemplar_messages_total{topic=\"ircp/suit\"} 5"));
  EXPECT_THAT(Get((*server)->port(), "/healthz"), testing::HasSubstr("200 OK"));
  EXPECT_THAT(Get((*server)->port(), "/secret"), testing::HasSubstr("404"));
}

TEST(MetricsServerTest, IsLeftOutWhereNoAddressIsGiven) {
  const auto none = ServeMetrics({}, {});
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(*none, nullptr);
  CommonOptions options;
  options.metrics = "127.0.0.1:0";
  const auto served = ServeMetrics(
      options, {GaugeOf("exemplar_speed_ratio", "share of full speed", [] { return 0.5; })});
  ASSERT_TRUE(served.ok());
  EXPECT_THAT(Get((*served)->port(), "/metrics"), testing::HasSubstr("exemplar_speed_ratio 0.5"));
}

TEST(MetricsServerTest, RefusesAnAddressThatIsNone) {
  const auto server = MetricsServer::Create("nowhere", {});
  ASSERT_FALSE(server.ok());
  EXPECT_THAT(server.error().message, testing::HasSubstr("\"nowhere\" is not HOST:PORT"));
}

TEST(SignalsTest, TellsItsServiceManagerThatItIsReadyAndAlive) {
  const std::string path = testing::TempDir() + "exemplar_notify_socket";
  unlink(path.c_str());
  const int fd = socket(AF_UNIX, SOCK_DGRAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  setenv("NOTIFY_SOCKET", path.c_str(), 1);
  setenv("WATCHDOG_USEC", "20000000", 1);
  const timeval patience{10, 0};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::multiset<std::string> heard;
  {
    const Signals signals;
    signals.token();
    signals.token();
    for (int message = 0; message < 2; ++message) {
      char buffer[64];
      const ssize_t n = recv(fd, buffer, sizeof buffer, 0);
      ASSERT_GT(n, 0);
      heard.emplace(buffer, static_cast<std::size_t>(n));
    }
  }
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");
  close(fd);
  unlink(path.c_str());
  EXPECT_EQ(heard, (std::multiset<std::string>{"READY=1", "WATCHDOG=1"}));
}

TEST(LogTest, WritesOneJsonObjectALine) {
  CommonOptions options;
  options.log_format = "json";
  testing::internal::CaptureStderr();
  MakeLog(options, "recorder")->Info("recording", {{"file", "a \"b\".mcap"}, {"messages", 12}});
  const nlohmann::json line = nlohmann::json::parse(testing::internal::GetCapturedStderr());
  EXPECT_EQ(line["event"], "recording");
  EXPECT_EQ(line["file"], "a \"b\".mcap");
  EXPECT_EQ(line["messages"], "12");
  EXPECT_EQ(line["level"], "info");
}

TEST(LogTest, LeavesOutWhatIsBelowItsLevel) {
  CommonOptions options;
  options.log_level = "warning";
  testing::internal::CaptureStderr();
  const auto log = MakeLog(options, "recorder");
  log->Info("nothing special");
  log->Warning("disk nearly full", {{"free", "1 GB"}});
  const std::string lines = testing::internal::GetCapturedStderr();
  EXPECT_THAT(lines, testing::Not(testing::HasSubstr("nothing special")));
  EXPECT_THAT(lines, testing::HasSubstr("warning recorder: disk nearly full free=\"1 GB\""));
}

TEST(ExitCodeTest, FollowsTheContract) {
  EXPECT_EQ(ExitCode(ErrorCode::kNotFound), 3);
  EXPECT_EQ(ExitCode(ErrorCode::kFailedPrecondition), 4);
  EXPECT_EQ(ExitCode(ErrorCode::kUnavailable), 5);
  EXPECT_EQ(ExitCode(ErrorCode::kUnauthenticated), 4);
  EXPECT_EQ(ExitCode(ErrorCode::kPermissionDenied), 4);
  EXPECT_EQ(ExitCode(ErrorCode::kInternal), 1);
}

}  // namespace
}  // namespace exemplar::program
