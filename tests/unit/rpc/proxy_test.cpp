// What only a gateway does; that it passes every call on is in calls_test.cpp.

#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>
#include <gtest/gtest.h>

#include "exemplar/rpc/client.hpp"
#include "exemplar/rpc/server.hpp"
#include "scripted_services.hpp"

namespace exemplar::rpc {
namespace {

using std::chrono::milliseconds;

const std::vector<std::string> kServices = {"exemplar.v1.TrialService", "exemplar.v1.SkillService"};

/// A call of any method with any bytes, and its metadata.
struct BareCall {
  grpc::ClientContext context;
  grpc::Status status;
  std::string answer;

  void Run(const std::string& address, const std::string& method, const std::string& request) {
    const auto channel = grpc::CreateChannel(address, grpc::InsecureChannelCredentials());
    grpc::CompletionQueue queue;
    const grpc::Slice slice(request);
    const grpc::ByteBuffer sent(&slice, 1);
    grpc::ByteBuffer got;
    const auto call = grpc::GenericStub(channel).PrepareUnaryCall(&context, method, sent, &queue);
    call->StartCall();
    call->Finish(&got, &status, this);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    std::vector<grpc::Slice> slices;
    if (status.ok() && got.Dump(&slices).ok()) {
      for (const grpc::Slice& part : slices) {
        answer.append(reinterpret_cast<const char*>(part.begin()), part.size());
      }
    }
  }
};

/// grpc.health.v1: the status of a service, 1 SERVING, 2 NOT_SERVING.
std::string HealthOf(const std::string& address, const std::string& service) {
  BareCall call;
  call.Run(address, "/grpc.health.v1.Health/Check",
           std::string("\x0a") + static_cast<char>(service.size()) + service);
  return call.status.ok() ? call.answer : call.status.error_message();
}

class ProxyTest : public testing::Test {
 protected:
  std::string StartBackend(const std::string& listen = "127.0.0.1:0") {
    ServerOptions options;
    options.listen = listen;
    options.on_call = [this](const CallRecord& call) { Note("behind", call); };
    backend_ = *Server::Create(options, {.trials = &trials_, .skills = &skills_});
    return backend_->address();
  }
  void StartGateway(const std::string& backend) {
    ServerOptions options;
    options.on_call = [this](const CallRecord& call) { Note("before", call); };
    gateway_ = *Server::Create(options, {.backends = {{.name = "learning",
                                                       .connection = {.server = backend},
                                                       .services = kServices}}});
    clients_ = *Connect({.server = gateway_->address(), .request_id = "mine"});
  }
  void Note(const std::string& where, const CallRecord& call) {
    const std::lock_guard lock(mutex_);
    notes_.push_back(where + " " + std::string(call.method) + " " + std::string(call.request_id));
  }
  bool WaitForServing(bool serving) {
    for (int i = 0; i < 2000; ++i) {
      if (gateway_->backends().at(0).serving == serving) return true;
      std::this_thread::sleep_for(milliseconds(5));
    }
    return false;
  }

  ScriptedTrials trials_;
  ScriptedSkills skills_;
  std::mutex mutex_;
  std::vector<std::string> notes_;
  std::unique_ptr<Server> backend_;
  std::unique_ptr<Server> gateway_;
  Clients clients_;
};

TEST_F(ProxyTest, ABackendThatIsNotThereIsNamed) {
  StartGateway("127.0.0.1:1");
  const auto list = clients_.trials->List("");
  ASSERT_FALSE(list.ok());
  EXPECT_EQ(list.error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(list.error().message.find("learning (127.0.0.1:1) does not answer"), 0U)
      << list.error().message;
}

TEST_F(ProxyTest, TheRequestIdGoesAllTheWay) {
  StartGateway(StartBackend());
  ASSERT_TRUE(clients_.trials->Get("x").ok());
  gateway_.reset();
  backend_.reset();
  std::sort(notes_.begin(), notes_.end());
  EXPECT_EQ(notes_, (std::vector<std::string>{"before exemplar.v1.TrialService/Get mine-1",
                                              "behind exemplar.v1.TrialService/Get mine-1"}));
}

TEST_F(ProxyTest, HealthSpeaksForTheBackend) {
  const std::string address = StartBackend();
  StartGateway(address);
  ASSERT_TRUE(WaitForServing(true));
  EXPECT_EQ(HealthOf(gateway_->address(), "exemplar.v1.TrialService"), "\x08\x01");
  backend_.reset();
  ASSERT_TRUE(WaitForServing(false));
  EXPECT_EQ(HealthOf(gateway_->address(), "exemplar.v1.TrialService"), "\x08\x02");
  EXPECT_EQ(HealthOf(gateway_->address(), ""), "\x08\x01");
  StartBackend(address);
  ASSERT_TRUE(WaitForServing(true));
  EXPECT_TRUE(clients_.trials->Get("x").ok());
}

TEST_F(ProxyTest, MethodsOfANewerVersionReachTheBackend) {
  StartGateway(StartBackend());
  BareCall call;
  call.Run(gateway_->address(), "/exemplar.v1.TrialService/Translate", "");
  EXPECT_EQ(call.status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
  gateway_.reset();
  ASSERT_EQ(notes_.size(), 1U);
  EXPECT_EQ(notes_[0].find("before exemplar.v1.TrialService/(other) "), 0U) << notes_[0];
}

TEST_F(ProxyTest, ServicesOfNobodyAreRefused) {
  StartGateway(StartBackend());
  BareCall call;
  call.Run(gateway_->address(), "/exemplar.v2.Unheard/Of", "");
  EXPECT_EQ(call.status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_NE(call.status.error_message().find("exemplar.v2.Unheard/Of"), std::string::npos);
}

TEST_F(ProxyTest, AMessageThatIsTooLargeIsRefusedAndOthersAreServed) {
  StartGateway(StartBackend());
  BareCall call;
  call.Run(gateway_->address(), "/exemplar.v1.TrialService/Get",
           std::string(std::size_t{65} << 20, 'x'));
  EXPECT_EQ(call.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(clients_.trials->Get("x").ok());
}

TEST_F(ProxyTest, ManyCallsAtOnceAllComeBack) {
  StartGateway(StartBackend());
  std::atomic<int> good = 0;
  std::vector<std::jthread> callers;
  for (int caller = 0; caller < 8; ++caller) {
    callers.emplace_back([&] {
      const Clients own = *Connect({.server = gateway_->address()});
      for (int i = 0; i < 100; ++i) {
        const std::string id = std::to_string(i);
        if (const auto got = own.trials->Get(id); got.ok() && got->id == id) ++good;
      }
    });
  }
  callers.clear();
  EXPECT_EQ(good, 800);
}

TEST_F(ProxyTest, CallersWhoGoAwayLeaveNothingBehind) {
  StartGateway(StartBackend());
  for (int i = 0; i < 50; ++i) {
    std::stop_source stop;
    (void)clients_.skills->Learn(
        "endless", {}, [&](double, std::string_view) { stop.request_stop(); }, stop.get_token());
  }
  EXPECT_TRUE(skills_.learning_stopped.Wait());
  EXPECT_TRUE(clients_.trials->Get("x").ok());
  gateway_.reset();  // returns once no call runs any more
}

TEST_F(ProxyTest, TwoBackendsOfOneServiceAreRefused) {
  const Backend backend{
      .name = "a", .connection = {.server = "127.0.0.1:1"}, .services = kServices};
  const auto gateway = Server::Create({}, {.backends = {backend, backend}});
  ASSERT_FALSE(gateway.ok());
  EXPECT_EQ(gateway.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace exemplar::rpc
