#include "capture_suit/dead_man.hpp"

#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/ircp/status_values.hpp"

namespace exemplar::capture_suit {
namespace {

constexpr const char* kSource = "suit-dead-man";
constexpr Duration kPeriod = std::chrono::milliseconds(20);
constexpr Duration kReleasedFor = std::chrono::milliseconds(500);
/// Without an answer to a press for so long it is pressed anew: whoever had to hear it may not have
/// been there yet.
constexpr Duration kPressedFor = std::chrono::milliseconds(2000);

}  // namespace

DeadMan::DeadMan(const Clock& clock, std::unique_ptr<ircp::Writer<ircp::SafetySample>> writer)
    : clock_(clock), writer_(std::move(writer)) {}

Result<std::unique_ptr<DeadMan>> DeadMan::Create(ircp::Bus& bus, const Clock& clock) {
  auto writer = bus.MakeWriter<ircp::SafetySample>(kSource);
  if (!writer.ok()) return writer.error();
  std::unique_ptr<DeadMan> made(new DeadMan(clock, *std::move(writer)));
  DeadMan* dead_man = made.get();
  auto reader = bus.MakeReaderOn<ircp::StatusSample>(
      ircp::StatusTopic("executor"),
      [dead_man](const ircp::StatusSample& status, const ircp::Reception&) {
        dead_man->Hear(status);
      });
  if (!reader.ok()) return reader.error();
  made->executor_ = *std::move(reader);
  made->thread_ = std::jthread([dead_man](const std::stop_token& stop) { dead_man->Run(stop); });
  return made;
}

DeadMan::~DeadMan() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  Set(false);
  Write(false);
}

void DeadMan::BeginToPress() {
  Set(false);
  answered_.store(false);
  followed_.store(false);
  turn_at_ = clock_.Steady() + kReleasedFor;
}

void DeadMan::GoOnPressing() {
  const Duration now = clock_.Steady();
  if (now < turn_at_ || (held() && answered_.load())) return;
  const bool press = !held();
  Set(press);
  turn_at_ = now + (press ? kPressedFor : kReleasedFor);
}

void DeadMan::Hear(const ircp::StatusSample& status) {
  // Whoever joins is told the executor's last statuses, also those of presses before ours.
  const auto press = status.values.find(ircp::kAnsweredPress);
  const std::optional<long long> stamp_ns =
      press == status.values.end() ? std::nullopt : ParseInteger(press->second);
  bool ours = false;
  {
    const std::lock_guard lock(mutex_);
    ours = held_ && stamp_ns && Stamp::FromNanoseconds(*stamp_ns) >= pressed_;
  }
  followed_.store(ours && status.detail.starts_with("following"));
  if (ours && !status.detail.starts_with("holding")) answered_.store(true);
}

void DeadMan::Set(bool held) {
  const std::lock_guard lock(mutex_);
  const Duration now = clock_.Steady();
  if (now > turned_) held_before_ = held_;
  turned_ = now;
  held_ = held;
  if (held) pressed_ = clock_.Now();
}

bool DeadMan::held() const {
  const std::lock_guard lock(mutex_);
  return held_;
}

bool DeadMan::HeldUntilNow() const {
  const std::lock_guard lock(mutex_);
  return clock_.Steady() > turned_ ? held_ : held_before_;
}

void DeadMan::Write(bool held) {
  ircp::SafetySample sample;
  sample.header.stamp = clock_.Now();
  sample.dead_man_held = held;
  (void)writer_->Write(sample);  // the next one follows
}

void DeadMan::Run(const std::stop_token& stop) {
  do {
    Write(HeldUntilNow());
  } while (clock_.SleepFor(kPeriod, stop));
}

ircp::TopicCount DeadMan::sent() const {
  return {ircp::SafetySample::kTopic, kSource, writer_->sent()};
}

}  // namespace exemplar::capture_suit
