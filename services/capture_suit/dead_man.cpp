#include "capture_suit/dead_man.hpp"

#include <utility>

namespace exemplar::capture_suit {
namespace {

constexpr const char* kSource = "suit-dead-man";
constexpr Duration kPeriod = std::chrono::milliseconds(50);

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
        dead_man->followed_.store(status.state == "teleoperating" &&
                                  status.detail.starts_with("following"));
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
}

void DeadMan::Set(bool held) {
  held_.store(held);
  ircp::SafetySample sample;
  sample.dead_man_held = held;
  (void)writer_->Write(sample);  // the next one follows
}

void DeadMan::Run(const std::stop_token& stop) {
  do {
    Set(held_.load());
  } while (clock_.SleepFor(kPeriod, stop));
}

ircp::TopicCount DeadMan::sent() const {
  return {ircp::SafetySample::kTopic, kSource, writer_->sent()};
}

}  // namespace exemplar::capture_suit
