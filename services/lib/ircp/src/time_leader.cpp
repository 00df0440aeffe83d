#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <utility>

#include "exemplar/ircp/simulated_time.hpp"

namespace exemplar::ircp {
namespace {

/// Between two sayings of the same time: a follower that came later has not heard the first.
constexpr Duration kAgain = std::chrono::milliseconds(100);

class Leader final : public TimeLeader {
 public:
  Leader(const Clock& clock, const TimeLeaderOptions& options)
      : clock_(clock), patience_(options.patience) {
    for (const std::string& program : options.in_step_with) followers_[program];
  }

  Status Start(Bus& bus, const std::string& program) {
    auto writer = bus.MakeWriter<ClockSample>(program);
    if (!writer.ok()) return writer.error();
    writer_ = std::move(*writer);
    auto reader = bus.MakeReader<ClockSample>([this](const ClockSample& sample, const Reception&) {
      if (sample.mode == "reached") Take(sample);
    });
    if (!reader.ok()) return reader.error();
    reader_ = std::move(*reader);
    return {};
  }

  bool Lead(Duration time, Stamp stamp, const SentInputs& sent,
            const std::function<std::uint64_t(const std::string&)>& taken,
            std::stop_token stop) override {
    const Duration begin = clock_.Steady();
    while (!stop.stop_requested()) {
      ClockSample sample;
      sample.header.stamp = stamp;
      sample.mode = "sim";
      sample.first = Stamp::FromNanoseconds(time.count());
      sample.second = Stamp::FromNanoseconds(static_cast<std::int64_t>(sent.joint_states));
      sample.third = Stamp::FromNanoseconds(static_cast<std::int64_t>(sent.objects));
      (void)writer_->Write(std::move(sample));  // said again below
      std::unique_lock lock(mutex_);
      const bool reached =
          changed_.wait_for(lock, stop, kAgain, [&] { return EverybodyReached(time, taken); });
      if (reached) return true;
      if (clock_.Steady() - begin < patience_) continue;
      for (auto& [name, follower] : followers_) {
        if (!follower.in_step || HasReached(name, follower, time, taken)) continue;
        follower.in_step = false;
        lost_.push_back(name);
      }
    }
    return false;
  }

  void Recheck() override {
    { const std::lock_guard lock(mutex_); }
    changed_.notify_all();
  }

  std::vector<std::string> TakeLost() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(lost_, {});
  }

 private:
  struct Follower {
    bool was_heard = false;  ///< until then it is waited for without end
    bool in_step = false;
    Duration reached{-1};
    std::uint64_t sent = 0;  ///< of its joint commands
  };
  using Taken = std::function<std::uint64_t(const std::string&)>;

  static bool HasReached(const std::string& name, const Follower& follower, Duration time,
                         const Taken& taken) {
    return follower.reached >= time && taken(name) >= follower.sent;
  }

  bool EverybodyReached(Duration time, const Taken& taken) const {
    for (const auto& [name, follower] : followers_) {
      if (follower.was_heard && !follower.in_step) continue;
      if (!HasReached(name, follower, time, taken)) return false;
    }
    return true;
  }

  /// On a thread of the network.
  void Take(const ClockSample& reply) {
    {
      const std::lock_guard lock(mutex_);
      const auto it = followers_.find(reply.header.source);
      if (it == followers_.end() || reply.third.nanoseconds() < 0) return;
      it->second = {.was_heard = true,
                    .in_step = true,
                    .reached = Duration(reply.first.nanoseconds()),
                    .sent = static_cast<std::uint64_t>(reply.third.nanoseconds())};
    }
    changed_.notify_all();
  }

  const Clock& clock_;
  const Duration patience_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::map<std::string, Follower> followers_;  ///< by program
  std::vector<std::string> lost_;
  std::unique_ptr<Writer<ClockSample>> writer_;
  std::unique_ptr<Reader> reader_;
};

}  // namespace

Result<std::unique_ptr<TimeLeader>> TimeLeader::Create(Bus& bus, const Clock& clock,
                                                       const std::string& program,
                                                       const TimeLeaderOptions& options) {
  auto leader = std::make_unique<Leader>(clock, options);
  if (Status started = leader->Start(bus, program); !started.ok()) return started.error();
  return std::unique_ptr<TimeLeader>(std::move(leader));
}

}  // namespace exemplar::ircp
