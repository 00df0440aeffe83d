#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "exemplar/ircp/clock_watch.hpp"

namespace exemplar::ircp {
namespace {

constexpr std::size_t kMostWaiting = 16;  // what comes beyond is not answered: it will ask again

class Responder final : public ClockResponder {
 public:
  explicit Responder(const Clock& clock) : clock_(clock) {}

  ~Responder() override {
    reader_.reset();  // no probe comes any more
    worker_ = {};
  }

  Status Start(Bus& bus, const std::string& source) {
    auto writer = bus.MakeWriter<ClockSample>(source);
    if (!writer.ok()) return writer.error();
    writer_ = std::move(*writer);
    auto reader =
        bus.MakeReader<ClockSample>([this](const ClockSample& sample, const Reception& from) {
          if (sample.mode == "probe") Take(sample, from);
        });
    if (!reader.ok()) return reader.error();
    reader_ = std::move(*reader);
    worker_ = std::jthread([this](const std::stop_token& stop) { Work(stop); });
    return {};
  }

 private:
  /// On a thread of the network: only hands over.
  void Take(const ClockSample& probe, const Reception& from) {
    ClockSample echo;
    echo.mode = "echo";
    echo.peer = from.writer;
    echo.first = probe.first;
    echo.second = clock_.Now();
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMostWaiting) return;
    waiting_.push_back(std::move(echo));
    arrived_.notify_one();
  }

  void Work(const std::stop_token& stop) {
    while (true) {
      std::unique_lock lock(mutex_);
      if (!arrived_.wait(lock, stop, [this] { return !waiting_.empty(); })) return;
      ClockSample echo = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      echo.third = clock_.Now();
      (void)writer_->Write(std::move(echo));  // one that is lost is asked for again
    }
  }

  const Clock& clock_;
  std::mutex mutex_;
  std::condition_variable_any arrived_;
  std::deque<ClockSample> waiting_;
  std::unique_ptr<Writer<ClockSample>> writer_;
  std::unique_ptr<Reader> reader_;
  std::jthread worker_;
};

}  // namespace

Result<std::unique_ptr<ClockResponder>> ClockResponder::Create(Bus& bus, const Clock& clock,
                                                               const std::string& source) {
  auto responder = std::make_unique<Responder>(clock);
  if (Status started = responder->Start(bus, source); !started.ok()) return started.error();
  return std::unique_ptr<ClockResponder>(std::move(responder));
}

}  // namespace exemplar::ircp
