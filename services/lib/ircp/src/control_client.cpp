#include <algorithm>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

#include "exemplar/base/ids.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/ircp/simulated_time.hpp"

namespace exemplar::ircp {
namespace {

constexpr Duration kRepeatPeriod = std::chrono::seconds(1);
constexpr Duration kMatchPeriod = std::chrono::milliseconds(10);
constexpr Duration kLastPatience = std::chrono::milliseconds(500);

/// Two runs of a program with one seed must not repeat each other's request ids: the server would
/// take the second run's commands for repetitions of the first's.
std::uint64_t SeedOfIds(std::uint64_t seed, const Clock& clock) {
  return seed * 0x9e3779b97f4a7c15ULL ^ static_cast<std::uint64_t>(clock.Now().nanoseconds());
}

class Client final : public ControlClient {
 public:
  Client(const Clock& clock, std::string program, std::uint64_t seed)
      : clock_(clock),
        real_(RealTimeOf(clock)),
        program_(std::move(program)),
        rng_(SeedOfIds(seed, clock)) {}

  ~Client() override { reader_.reset(); }

  Status Start(Bus& bus, const std::string& source) {
    auto writer = bus.MakeWriterOn<CommandSample>(CommandTopic(program_), source);
    if (!writer) return writer.error();
    writer_ = std::move(*writer);
    auto reader = bus.MakeReaderOn<StatusSample>(
        StatusTopic(program_),
        [this](const StatusSample& status, const Reception&) { Take(status); });
    if (!reader) return reader.error();
    reader_ = std::move(*reader);
    return {};
  }

  Result<Answer> Call(const std::string& action, std::map<std::string, std::string> arguments,
                      Duration timeout, std::stop_token stop) override {
    Pending pending;
    CommandSample command;
    command.program = program_;
    command.action = action;
    command.arguments = std::move(arguments);
    command.validity = timeout;
    {
      const std::lock_guard lock(mutex_);
      command.request_id = MakeId("request", rng_);
      pending_[command.request_id] = &pending;
    }
    const TimeHold hold(clock_);  // a call takes no simulated time
    const Result<Answer> answer = Ask(command, pending, real_.Steady() + timeout, stop);
    const std::lock_guard lock(mutex_);
    pending_.erase(command.request_id);
    return answer;
  }

 private:
  struct Pending {
    std::optional<Answer> answer;
    std::stop_source answered;
  };

  Error Cancelled(const CommandSample& command) const {
    return {ErrorCode::kCancelled,
            "stopped before " + program_ + " had answered \"" + command.action + '"'};
  }

  Result<Answer> Ask(const CommandSample& command, const Pending& pending, Duration deadline,
                     const std::stop_token& stop) {
    // Commands are volatile: what nobody reads yet is gone.
    while (writer_->matched_readers() == 0) {
      if (real_.Steady() >= deadline) {
        return Unavailable("nobody listens on " + CommandTopic(program_) + ": is " + program_ +
                           " running in this station?");
      }
      if (!real_.SleepUntil(std::min(deadline, real_.Steady() + kMatchPeriod), stop)) {
        return Cancelled(command);
      }
    }
    std::stop_source wake;
    const auto ring = [&wake] { wake.request_stop(); };
    const std::stop_callback on_answer(pending.answered.get_token(), ring);
    const std::stop_callback on_stop(stop, ring);
    bool hurried = false;
    while (true) {
      if (!hurried && stop.stop_requested()) {
        hurried = true;
        deadline = std::min(deadline, real_.Steady() + kLastPatience);
      }
      if (Status sent = writer_->Write(command); !sent) return sent.error();
      const Duration next = std::min(deadline, real_.Steady() + kRepeatPeriod);
      real_.SleepUntil(next, hurried ? pending.answered.get_token() : wake.get_token());
      {
        const std::lock_guard lock(mutex_);
        if (pending.answer) {
          if (pending.answer->ok) return *pending.answer;
          return FailedPrecondition(pending.answer->detail);
        }
      }
      if (real_.Steady() >= deadline) {
        if (stop.stop_requested()) return Cancelled(command);
        return Unavailable(program_ + " did not answer \"" + command.action + "\" on " +
                           StatusTopic(program_) + " in time");
      }
    }
  }

  /// On a thread of the network.
  void Take(const StatusSample& status) {
    if (status.request_id.empty()) return;
    const std::lock_guard lock(mutex_);
    const auto found = pending_.find(status.request_id);
    if (found == pending_.end() || found->second->answer) return;
    found->second->answer = Answer{status.ok, status.detail, status.values};
    found->second->answered.request_stop();
  }

  const Clock& clock_;
  const Clock& real_;  ///< for what the network takes
  const std::string program_;
  std::mutex mutex_;
  Rng rng_;
  std::map<std::string, Pending*> pending_;
  std::unique_ptr<Writer<CommandSample>> writer_;
  std::unique_ptr<Reader> reader_;
};

}  // namespace

Result<std::unique_ptr<ControlClient>> ControlClient::Create(Bus& bus, const Clock& clock,
                                                             std::string program,
                                                             std::string source,
                                                             std::uint64_t seed) {
  auto client = std::make_unique<Client>(clock, std::move(program), seed);
  if (Status started = client->Start(bus, source); !started) return started.error();
  return std::unique_ptr<ControlClient>(std::move(client));
}

}  // namespace exemplar::ircp
