#include "exemplar/ircp/in_step_bus.hpp"

#include <map>
#include <type_traits>
#include <utility>

#include "exemplar/ircp/sample_header.hpp"
#include "step_mail.hpp"

namespace exemplar::ircp {
namespace {

template <class Sample>
class StepWriter final : public Writer<Sample> {
 public:
  StepWriter(std::unique_ptr<Writer<Sample>> writer, const std::string& topic,
             const std::string& source, NetworkClock& clock)
      : clock_(clock), writer_(std::move(writer)) {
    id_ =
        clock.mail().AddWriter(topic, source, [writer = writer_.get()] { return writer->sent(); });
  }
  ~StepWriter() override { clock_.mail().RemoveWriter(id_); }

  Status Write(Sample sample) override {
    written_at_.store(clock_.Steady().count());
    if (sample.header.stamp == Stamp()) sample.header.stamp = clock_.Now();
    return writer_->Write(std::move(sample));
  }
  std::uint64_t sent() const override { return writer_->sent(); }
  int matched_readers() const override { return writer_->matched_readers(); }
  bool WaitForAcknowledgments(Duration timeout) override {
    const Duration next = Duration(written_at_.load()) + Duration(1);
    return writer_->WaitForAcknowledgments(timeout) && clock_.SleepUntilWithin(next, timeout);
  }

 private:
  NetworkClock& clock_;
  const std::unique_ptr<Writer<Sample>> writer_;
  std::atomic<std::int64_t> written_at_{-1};
  int id_ = 0;
};

/// A reader's place in the mail.
class Place {
 public:
  Place(NetworkClock& clock, const std::string& topic)
      : clock_(clock), id_(clock.mail().AddReader(topic)) {}
  ~Place() { clock_.mail().RemoveReader(id_); }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;

  void Take(StepMail::Kind kind, const Header& header, StepMail::Deliver deliver) const {
    clock_.mail().Take(id_, kind, header, std::move(deliver));
    clock_.Recheck();
  }
  void SetMatched(std::function<int()> matched_writers) const {
    clock_.mail().SetMatched(id_, std::move(matched_writers));
  }

 private:
  NetworkClock& clock_;
  const int id_;
};

class StepReader final : public Reader {
 public:
  StepReader(std::unique_ptr<Place> place, std::unique_ptr<Reader> reader)
      : place_(std::move(place)), reader_(std::move(reader)) {
    place_->SetMatched([reader = reader_.get()] { return reader->matched_writers(); });
  }
  ~StepReader() override { place_->SetMatched(nullptr); }
  int matched_writers() const override { return reader_->matched_writers(); }
  std::vector<SourceCount> counts() const override { return reader_->counts(); }
  std::uint64_t refused() const override { return reader_->refused(); }

 private:
  std::unique_ptr<Place> place_;
  std::unique_ptr<Reader> reader_;  ///< last: calls into place_
};

template <class Sample>
StepMail::Kind KindOf(const Sample& sample) {
  if constexpr (std::is_same_v<Sample, CommandSample>) return StepMail::Kind::kCommand;
  if constexpr (std::is_same_v<Sample, StatusSample>) {
    if (!sample.request_id.empty()) return StepMail::Kind::kAnswer;
  }
  return StepMail::Kind::kSample;
}

class StepTap final : public RawTap {
 public:
  StepTap(NetworkClock& clock, RawTapOptions options)
      : clock_(clock), options_(std::move(options)) {}
  ~StepTap() override {
    for (const auto& [topic, entry] : Topics()) entry.place->SetMatched(nullptr);
    tap_.reset();
  }

  Status Start(RawBus& bus) {
    RawTapOptions options;
    options.wanted = options_.wanted;
    options.on_topic = [this](const RawTopic& topic) { AddTopic(topic); };
    options.on_sample = [this](RawSample&& sample) { Take(std::move(sample)); };
    auto tap = bus.MakeTap(std::move(options));
    if (!tap.ok()) return tap.error();
    const std::lock_guard lock(mutex_);
    tap_ = std::move(*tap);
    for (const auto& [topic, entry] : topics_) SetMatched(topic, *entry.place);
    return {};
  }

  std::vector<RawTopic> topics() const override { return tap_->topics(); }
  int matched_writers(const std::string& topic) const override {
    return tap_->matched_writers(topic);
  }

 private:
  struct Entry {
    std::shared_ptr<Place> place;
    std::optional<HeaderLayout> layout;
  };

  std::map<std::string, Entry> Topics() const {
    const std::lock_guard lock(mutex_);
    return topics_;
  }

  void SetMatched(const std::string& topic, const Place& place) const {
    place.SetMatched([tap = tap_.get(), topic] { return tap->matched_writers(topic); });
  }

  void AddTopic(const RawTopic& topic) {
    {
      const std::lock_guard lock(mutex_);
      Entry& entry = topics_[topic.topic];
      entry.place = std::make_shared<Place>(clock_, topic.topic);
      entry.layout = ReadHeaderLayout(topic.schema, topic.type);
      if (tap_) SetMatched(topic.topic, *entry.place);
    }
    options_.on_topic(topic);
  }

  void Take(RawSample&& sample) {
    Entry entry;
    {
      const std::lock_guard lock(mutex_);
      const auto found = topics_.find(sample.topic);
      if (found != topics_.end()) entry = found->second;
    }
    const auto header = entry.layout && sample.valid ? ReadSampleHeader(sample.cdr, *entry.layout)
                                                     : std::optional<SampleHeader>();
    if (!header) {
      options_.on_sample(std::move(sample));
      return;
    }
    const auto shared = std::make_shared<RawSample>(std::move(sample));
    const Header who{.source = header->source, .seq = header->seq, .stamp = {}};
    entry.place->Take(StepMail::Kind::kSample, who, [this, shared] {
      shared->received = clock_.Now();
      options_.on_sample(std::move(*shared));
    });
  }

  NetworkClock& clock_;
  const RawTapOptions options_;
  mutable std::mutex mutex_;  ///< never held while the tap is called
  std::map<std::string, Entry> topics_;
  std::unique_ptr<RawTap> tap_;
};

}  // namespace

template <class Sample>
Result<std::unique_ptr<Writer<Sample>>> InStepBus::OpenWriter(const std::string& topic,
                                                              const std::string& source) {
  if constexpr (std::is_same_v<Sample, ClockSample>) {
    return clock_network_.MakeWriterOn<Sample>(topic, source);
  } else {
    auto writer = network_.MakeWriterOn<Sample>(topic, source);
    if (!writer.ok()) return writer.error();
    return std::unique_ptr<Writer<Sample>>(
        std::make_unique<StepWriter<Sample>>(std::move(*writer), topic, source, clock_));
  }
}

template <class Sample>
Result<std::unique_ptr<Reader>> InStepBus::OpenReader(const std::string& topic,
                                                      Callback<Sample> callback) {
  if constexpr (std::is_same_v<Sample, ClockSample>) {
    return clock_network_.MakeReaderOn<Sample>(topic, std::move(callback));
  } else {
    auto place = std::make_unique<Place>(clock_, topic);
    // The callback is shared by the samples that wait.
    const auto shared = std::make_shared<const Callback<Sample>>(std::move(callback));
    auto reader =
        network_.MakeReaderOn<Sample>(topic, [place = place.get(), shared, clock = &clock_](
                                                 const Sample& sample, const Reception& from) {
          place->Take(KindOf(sample), sample.header, [shared, sample, clock, writer = from.writer] {
            (*shared)(sample, {.writer = writer, .received = clock->Now()});
          });
        });
    if (!reader.ok()) return reader.error();
    return std::unique_ptr<Reader>(
        std::make_unique<StepReader>(std::move(place), std::move(*reader)));
  }
}

Result<std::unique_ptr<RawTap>> InStepBus::MakeTap(RawTapOptions options) {
  if (raw_ == nullptr) return FailedPrecondition("this network has no taps");
  auto tap = std::make_unique<StepTap>(clock_, std::move(options));
  if (Status started = tap->Start(*raw_); !started.ok()) return started.error();
  return std::unique_ptr<RawTap>(std::move(tap));
}

template class BusOf<InStepBus>;

}  // namespace exemplar::ircp
