#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "exemplar/base/ids.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/ircp/clock_watch.hpp"
#include "exemplar/ircp/control.hpp"

namespace exemplar::ircp {
namespace {

constexpr std::size_t kAnswersKept = 256;
constexpr std::size_t kLongestQueue = 64;
constexpr std::size_t kRivalsKept = 64;
constexpr Duration kStatusPeriod = std::chrono::seconds(1);

/// In the values of each status: tells one server of a program from another.
constexpr const char* kInstance = "instance";

struct Received {
  CommandSample command;
  Duration at{0};
  std::optional<Answer> answer;  ///< known already: only to be given (again)
};

class Server final : public ControlServer {
 public:
  Server(const Clock& clock, std::string program, Handler handler)
      : clock_(clock), program_(std::move(program)), handler_(std::move(handler)) {
    Rng rng(static_cast<std::uint64_t>(clock.Now().nanoseconds()) ^
            reinterpret_cast<std::uintptr_t>(this));
    instance_ = MakeId("instance", rng);
  }

  ~Server() override {
    clock_responder_.reset();
    others_.reset();
    reader_.reset();  // no command comes any more
    heartbeat_ = {};
    worker_ = {};
  }

  Status Start(Bus& bus) {
    auto writer = bus.MakeWriterOn<StatusSample>(StatusTopic(program_), program_);
    if (!writer) return writer.error();
    writer_ = std::move(*writer);
    auto reader = bus.MakeReaderOn<CommandSample>(
        CommandTopic(program_),
        [this](const CommandSample& command, const Reception&) { Take(command); });
    if (!reader) return reader.error();
    reader_ = std::move(*reader);
    auto others = bus.MakeReaderOn<StatusSample>(
        StatusTopic(program_),
        [this](const StatusSample& status, const Reception& from) { Meet(status, from); });
    if (!others) return others.error();
    others_ = std::move(*others);
    auto clock_responder = ClockResponder::Create(bus, clock_, program_);
    if (!clock_responder) return clock_responder.error();
    clock_responder_ = std::move(*clock_responder);
    worker_ = std::jthread([this](const std::stop_token& stop) { Work(stop); });
    heartbeat_ = std::jthread([this](const std::stop_token& stop) {
      do {
        Publish({}, {});
      } while (clock_.SleepFor(kStatusPeriod, stop));
    });
    return {};
  }

  void SetState(std::string state, std::string detail) override {
    {
      const std::lock_guard lock(mutex_);
      state_ = std::move(state);
      detail_ = std::move(detail);
    }
    Publish({}, {});
  }

  void SetSentCounts(std::function<std::vector<TopicCount>()> counts) override {
    const std::lock_guard lock(mutex_);
    counts_ = std::move(counts);
  }

  void SetValues(std::function<std::map<std::string, std::string>()> values) override {
    const std::lock_guard lock(mutex_);
    values_ = std::move(values);
  }

  void SetOnRival(std::function<void(const std::string&)> on_rival) override {
    std::set<std::string> met;
    {
      const std::lock_guard lock(mutex_);
      on_rival_ = on_rival;
      met = rivals_;
    }
    for (const std::string& writer : met) on_rival(writer);
  }

 private:
  /// On a thread of the network: a status of this program, ours or another's.
  void Meet(const StatusSample& status, const Reception& from) {
    const auto other = status.values.find(kInstance);
    if (other == status.values.end() || other->second == instance_) return;
    if (status.state == "stopped") return;
    std::function<void(const std::string&)> on_rival;
    {
      const std::lock_guard lock(mutex_);
      if (rivals_.size() >= kRivalsKept || !rivals_.insert(from.writer).second) return;
      on_rival = on_rival_;
    }
    if (on_rival) on_rival(from.writer);
  }

  /// On a thread of the network: only hands over.
  void Take(const CommandSample& command) {
    if (command.program != program_) return;
    Received received{.command = command, .at = clock_.Steady(), .answer = {}};
    {
      const std::lock_guard lock(mutex_);
      if (const auto known = answers_.find(command.request_id); known != answers_.end()) {
        received.answer = known->second;
      } else if (waiting_.count(command.request_id) != 0) {
        return;
      } else if (queue_.size() >= kLongestQueue) {
        received.answer = Answer{false, program_ + " has too many commands waiting", {}};
      } else {
        waiting_.insert(command.request_id);
      }
      // The asker repeats: what does not even find room for a refusal comes again.
      if (queue_.size() >= 2 * kLongestQueue) return;
      queue_.push_back(std::move(received));
    }
    arrived_.notify_one();
  }

  void Work(const std::stop_token& stop) {
    while (true) {
      std::unique_lock lock(mutex_);
      if (!arrived_.wait(lock, stop, [this] { return !queue_.empty(); })) return;
      const Received next = std::move(queue_.front());
      queue_.pop_front();
      lock.unlock();

      const std::string& id = next.command.request_id;
      const Answer answer = next.answer ? *next.answer : Handle(next);
      if (!next.answer) Remember(id, answer);
      Publish(id, answer);
    }
  }

  void Remember(const std::string& id, const Answer& answer) {
    const std::lock_guard lock(mutex_);
    waiting_.erase(id);
    answers_[id] = answer;
    answered_order_.push_back(id);
    if (answered_order_.size() > kAnswersKept) {
      answers_.erase(answered_order_.front());
      answered_order_.pop_front();
    }
  }

  Answer Handle(const Received& received) {
    const Duration validity = received.command.validity;
    if (validity > Duration::zero() && clock_.Steady() - received.at > validity) {
      return {false, "\"" + received.command.action + "\" waited longer than it was valid", {}};
    }
    return handler_(received.command);
  }

  void Publish(const std::string& request_id, const std::optional<Answer>& answer) {
    StatusSample status;
    std::function<std::vector<TopicCount>()> counts;
    std::function<std::map<std::string, std::string>()> values;
    {
      const std::lock_guard lock(mutex_);
      status.program = program_;
      status.state = state_;
      status.detail = detail_;
      counts = counts_;
      values = values_;
    }
    // Asked without our lock: they may take locks of their own.
    if (counts) status.sent = counts();
    if (values) status.values = values();
    status.values[kInstance] = instance_;
    if (answer) {
      status.request_id = request_id;
      status.ok = answer->ok;
      status.detail = answer->detail;
      for (const auto& [name, value] : answer->values) status.values[name] = value;
    }
    // A status that cannot be written is followed by the next one within a second.
    (void)writer_->Write(std::move(status));
  }

  const Clock& clock_;
  const std::string program_;
  const Handler handler_;
  std::string instance_;

  std::mutex mutex_;
  std::condition_variable_any arrived_;
  std::deque<Received> queue_;
  std::set<std::string> waiting_;  ///< request ids in the queue or being done
  std::map<std::string, Answer> answers_;
  std::deque<std::string> answered_order_;
  std::string state_;
  std::string detail_;
  std::function<std::vector<TopicCount>()> counts_;
  std::function<std::map<std::string, std::string>()> values_;

  std::unique_ptr<Writer<StatusSample>> writer_;
  std::function<void(const std::string&)> on_rival_;
  std::set<std::string> rivals_;  ///< their writers

  std::unique_ptr<Reader> reader_;
  std::unique_ptr<Reader> others_;
  std::unique_ptr<ClockResponder> clock_responder_;
  std::jthread worker_;
  std::jthread heartbeat_;
};

}  // namespace

Result<std::unique_ptr<ControlServer>> ControlServer::Create(Bus& bus, const Clock& clock,
                                                             std::string program, Handler handler) {
  auto server = std::make_unique<Server>(clock, std::move(program), std::move(handler));
  if (Status started = server->Start(bus); !started) return started.error();
  return std::unique_ptr<ControlServer>(std::move(server));
}

}  // namespace exemplar::ircp
