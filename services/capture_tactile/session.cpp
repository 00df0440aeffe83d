#include "capture_tactile/session.hpp"

#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/ircp/control.hpp"

namespace exemplar::capture_tactile {
namespace {

class RobotTouch final : public Session {
 public:
  RobotTouch(const Clock& clock, Log& log, const SessionOptions& options)
      : clock_(clock), log_(log), options_(options) {}

  Status Start(ircp::Bus& bus) {
    auto writer = bus.MakeWriter<ircp::TactileSample>("tactile");
    if (!writer) return writer.error();
    writer_ = std::move(*writer);
    auto reader = bus.MakeReader<ircp::JointStateSample>(
        [this](const ircp::JointStateSample& state, const ircp::Reception&) { Take(state); });
    if (!reader) return reader.error();
    reader_ = std::move(*reader);
    auto control = ircp::ControlServer::Create(
        bus, clock_, "capture_tactile", [](const ircp::CommandSample& command) {
          return ircp::Answer{false, "there is no action \"" + command.action + "\"", {}};
        });
    if (!control) return control.error();
    control_ = std::move(*control);
    control_->SetSentCounts([this] { return sent(); });
    control_->SetValues([this] {
      return std::map<std::string, std::string>{{"polls", std::to_string(polls_)},
                                                {"stale", std::to_string(stale_)}};
    });
    return {};
  }

  void Run(std::stop_token stop) override {
    control_->SetState("waiting", "no joint state with touch has come yet");
    const Duration period = FromSeconds(1.0 / options_.rate_hz);
    Duration next = clock_.Steady() + period;
    bool sending = false;
    while (clock_.SleepUntil(next, stop)) {
      next += period;
      ++polls_;
      std::optional<Touch> touch;
      {
        const std::lock_guard lock(mutex_);
        touch = std::exchange(newest_, std::nullopt);
      }
      if (!touch) continue;
      if (clock_.Steady() - touch->received > options_.freshness) {
        ++stale_;
        continue;
      }
      if (!std::exchange(sending, true)) {
        control_->SetState("sending", "touch of the robot's hand");
        log_.Info("touch found", {{"sensors", touch->sample.sensors.size()}});
      }
      if (const Status sent = writer_->Write(std::move(touch->sample)); !sent) {
        log_.Warning("touch not sent", {{"reason", sent.error().message}});
      }
    }
    control_->SetState("stopped", "");
    writer_->WaitForAcknowledgments(std::chrono::seconds(1));
  }

  std::uint64_t polls() const override { return polls_; }
  std::uint64_t stale() const override { return stale_; }
  std::vector<ircp::TopicCount> sent() const override {
    return {{ircp::TactileSample::kTopic, "tactile", writer_->sent()}};
  }
  const ircp::Reader& reader() const override { return *reader_; }
  bool is_settled() const override { return has_heard_ || reader_->matched_writers() > 0; }

 private:
  struct Touch {
    ircp::TactileSample sample;
    Duration received{0};
  };

  /// On a thread of the network.
  void Take(const ircp::JointStateSample& state) {
    has_heard_ = true;
    if (state.touch_sensors.empty()) return;
    Touch touch;
    touch.sample.header.stamp = state.header.stamp;
    touch.sample.sensors = state.touch_sensors;
    touch.sample.forces_n = state.touch_n;
    touch.received = clock_.Steady();
    const std::lock_guard lock(mutex_);
    newest_ = std::move(touch);
  }

  const Clock& clock_;
  Log& log_;
  const SessionOptions options_;
  std::mutex mutex_;
  std::optional<Touch> newest_;
  std::atomic<bool> has_heard_ = false;
  std::atomic<std::uint64_t> polls_ = 0;
  std::atomic<std::uint64_t> stale_ = 0;
  std::unique_ptr<ircp::Writer<ircp::TactileSample>> writer_;
  std::unique_ptr<ircp::Reader> reader_;
  std::unique_ptr<ircp::ControlServer> control_;
};

}  // namespace

Result<std::unique_ptr<Session>> Session::Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                 const SessionOptions& options) {
  if (!(options.rate_hz > 0)) {
    return InvalidArgument("rate_hz is " + FormatDouble(options.rate_hz) + ", must be positive",
                           "rate_hz");
  }
  auto session = std::make_unique<RobotTouch>(clock, log, options);
  if (Status started = session->Start(bus); !started) return started.error();
  return std::unique_ptr<Session>(std::move(session));
}

}  // namespace exemplar::capture_tactile
