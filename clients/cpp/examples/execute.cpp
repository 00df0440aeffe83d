// Plans a skill, carries it out on the robot and shows how far it is; Ctrl-C slows it down and
// holds it:
//   execute HOST:PORT SKILL OBJECT X Y Z

#include <csignal>
#include <stop_token>
#include <thread>

#include "common.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  if (argc != 7) {
    std::cerr << "usage: execute HOST:PORT SKILL OBJECT X Y Z\n";
    return 2;
  }
  // Before there is another thread: Ctrl-C is then waited for by one of ours alone.
  sigset_t interrupt;
  sigemptyset(&interrupt);
  sigaddset(&interrupt, SIGINT);
  pthread_sigmask(SIG_BLOCK, &interrupt, nullptr);
  std::stop_source stop;
  std::thread([stop, interrupt]() mutable {
    int signal = 0;
    sigwait(&interrupt, &signal);
    stop.request_stop();
  }).detach();

  api::ExecuteRequest request;
  request.skill = argv[2];
  request.objects = {ObjectOf(argv + 3)};
  const auto clients = rpc::Connect(OptionsFor(argv[1]));
  if (!clients) return Fail(clients.error());
  const auto plan = clients->executor->Plan(request);
  if (!plan) return Fail(plan.error());
  std::cout << plan->duration_s << " s, " << 1e3 * plan->clearance_m << " mm clear of "
            << plan->clearance_between << '\n';

  const auto result = clients->executor->Execute(
      request,
      [](const api::ExecutionFeedback& now) {
        std::cout << now.state << ' ' << now.time_s << " of " << now.duration_s << " s, touch "
                  << now.touch_n << " N" << std::endl;
      },
      stop.get_token());
  if (!result) return Fail(result.error());
  std::cout << result->state << ": " << result->detail << '\n';
  if (result->contact_error_m) {
    std::cout << "contact met to " << 1e3 * *result->contact_error_m << " mm\n";
  }
  return result->state == "done" ? 0 : 1;
}
