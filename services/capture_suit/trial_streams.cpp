#include "capture_suit/trial_streams.hpp"

#include <utility>

namespace exemplar::capture_suit {
namespace {

constexpr const char* kSource = "replay";

/// Calls visit(writer, topic) for each writer that is there.
template <class Writers, class Visit>
void ForEachWriter(Writers& writers, Visit&& visit) {
  const auto one = [&]<class Sample>(const std::unique_ptr<ircp::Writer<Sample>>& writer) {
    if (writer != nullptr) visit(*writer, Sample::kTopic);
  };
  std::apply([&](const auto&... each) { (one(each), ...); }, writers);
}

}  // namespace

Result<TrialStreams> TrialStreams::Create(ircp::Bus& bus,
                                          const std::vector<ircp::TrialSamples>& trials) {
  TrialStreams streams;
  for (const ircp::TrialSamples& trial : trials) {
    for (const ircp::TrialSample& sample : trial.samples) {
      if (Status status = streams.Open(bus, sample); !status) return status.error();
    }
  }
  return streams;
}

Status TrialStreams::Open(ircp::Bus& bus, const ircp::TrialSample& sample) {
  return std::visit(
      [&]<class Sample>(const Sample&) -> Status {
        WriterPtr<Sample>& writer = std::get<WriterPtr<Sample>>(writers_);
        if (writer != nullptr) return {};
        auto made = bus.MakeWriter<Sample>(kSource);
        if (!made) return made.error();
        writer = std::move(*made);
        return {};
      },
      sample);
}

Status TrialStreams::Play(const ircp::TrialSamples& trial, double rate, const Clock& clock,
                          const std::stop_token& stop) {
  if (trial.samples.empty()) return {};
  const Duration start = clock.Steady();
  const Stamp first = ircp::StampOf(trial.samples.front());
  for (const ircp::TrialSample& sample : trial.samples) {
    const double since_first = ToSeconds(ircp::StampOf(sample) - first);
    if (!clock.SleepUntil(start + FromSeconds(since_first / rate), stop)) {
      return Error{ErrorCode::kCancelled, "stopped before the trial had ended"};
    }
    Status written = std::visit(
        [&]<class Sample>(const Sample& value) {
          return std::get<WriterPtr<Sample>>(writers_)->Write(value);
        },
        sample);
    if (!written) return written;
  }
  return {};
}

std::vector<ircp::TopicCount> TrialStreams::sent() const {
  std::vector<ircp::TopicCount> counts;
  ForEachWriter(writers_, [&](const auto& writer, const char* topic) {
    counts.push_back({topic, kSource, writer.sent()});
  });
  return counts;
}

std::map<std::string, int> TrialStreams::readers() const {
  std::map<std::string, int> readers;
  ForEachWriter(writers_, [&](const auto& writer, const char* topic) {
    readers[topic] = writer.matched_readers();
  });
  return readers;
}

bool TrialStreams::WaitForAcknowledgments(Duration timeout) {
  bool all = true;
  ForEachWriter(writers_, [&](auto& writer, const char*) {
    all = all && writer.WaitForAcknowledgments(timeout);
  });
  return all;
}

}  // namespace exemplar::capture_suit
