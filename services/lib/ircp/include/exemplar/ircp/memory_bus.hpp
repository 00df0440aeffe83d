#pragma once
// A network within one process: for tests of what talks over a Bus.

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/bus_of.hpp"
#include "exemplar/ircp/check.hpp"
#include "exemplar/ircp/sequence_set.hpp"

namespace exemplar::ircp {

/// As the real one, but a sample is delivered within Write, on the writing thread, so that nothing
/// is left to wait for. Readers of status topics get the last samples from before they came.
/// Thread-safe; endpoints may outlive the bus.
class MemoryBus final : public BusOf<MemoryBus> {
 public:
  /// `clock` outlives all endpoints.
  explicit MemoryBus(const Clock& clock) : clock_(clock) {}

  /// From now on samples for which `lose` is true reach nobody; their numbers are used up.
  void LoseWhere(std::function<bool(const std::string& topic, const Header& header)> lose) {
    const std::lock_guard lock(network_->mutex);
    network_->lose = std::move(lose);
  }

  template <class Sample>
  Result<std::unique_ptr<Writer<Sample>>> OpenWriter(const std::string& topic,
                                                     const std::string& source) {
    if (source.empty() || source.size() > kMaxKeyBytes) {
      return InvalidArgument("source \"" + source + "\" must have 1 to 255 bytes", "source");
    }
    auto channel = FindOrMake<Sample>(topic);
    if (!channel.ok()) return channel.error();
    return std::unique_ptr<Writer<Sample>>(
        std::make_unique<MemoryWriter<Sample>>(*channel, network_, topic, source, clock_));
  }

  template <class Sample>
  Result<std::unique_ptr<Reader>> OpenReader(const std::string& topic, Callback<Sample> callback) {
    auto channel = FindOrMake<Sample>(topic);
    if (!channel.ok()) return channel.error();
    return std::unique_ptr<Reader>(
        std::make_unique<MemoryReader<Sample>>(*channel, std::move(callback), clock_));
  }

 private:
  static constexpr std::size_t kStatusesKept = 64;

  struct ChannelBase {
    virtual ~ChannelBase() = default;
  };

  struct Network {
    std::mutex mutex;
    std::map<std::string, std::shared_ptr<ChannelBase>> channels;
    std::function<bool(const std::string&, const Header&)> lose;
    int writers = 0;  ///< made so far: names them
  };

  /// Where a reader's samples go; survives the reader while a delivery is under way.
  template <class Sample>
  struct Outlet {
    std::recursive_mutex mutex;  ///< held during the callback, which may write in its turn
    Callback<Sample> callback;   ///< null once the reader has gone
    std::map<std::pair<std::string, std::string>, SequenceSet> numbers;  ///< by source and writer

    void Deliver(const Sample& sample, const Reception& reception) {
      const std::lock_guard lock(mutex);
      if (callback == nullptr) return;
      numbers[{sample.header.source, reception.writer}].Insert(sample.header.seq);
      callback(sample, reception);
    }
  };

  template <class Sample>
  struct Channel final : ChannelBase {
    std::mutex mutex;
    std::vector<std::shared_ptr<Outlet<Sample>>> outlets;
    std::deque<std::pair<Sample, Reception>> kept;
    std::size_t keep = 0;
    int writers = 0;
  };

  template <class Sample>
  class MemoryWriter final : public Writer<Sample> {
   public:
    MemoryWriter(std::shared_ptr<Channel<Sample>> channel, std::shared_ptr<Network> network,
                 std::string topic, std::string source, const Clock& clock)
        : channel_(std::move(channel)),
          network_(std::move(network)),
          topic_(std::move(topic)),
          source_(std::move(source)),
          clock_(clock) {
      {
        const std::lock_guard lock(network_->mutex);
        name_ = "writer-" + std::to_string(++network_->writers);
      }
      const std::lock_guard lock(channel_->mutex);
      ++channel_->writers;
    }

    ~MemoryWriter() override {
      const std::lock_guard lock(channel_->mutex);
      --channel_->writers;
    }

    Status Write(Sample sample) override {
      const Reception reception{.writer = name_, .received = clock_.Now()};
      sample.header.source = source_;
      if (sample.header.stamp == Stamp()) sample.header.stamp = reception.received;
      if (Status checked = Check(sample); !checked.ok()) return checked;
      std::vector<std::shared_ptr<Outlet<Sample>>> outlets;
      {
        const std::lock_guard lock(channel_->mutex);
        sample.header.seq = ++sent_;
        if (Lost(sample.header)) return {};
        outlets = channel_->outlets;
        channel_->kept.emplace_back(sample, reception);
        while (channel_->kept.size() > channel_->keep) channel_->kept.pop_front();
      }
      for (const auto& outlet : outlets) outlet->Deliver(sample, reception);
      return {};
    }

    std::uint64_t sent() const override {
      const std::lock_guard lock(channel_->mutex);
      return sent_;
    }
    int matched_readers() const override {
      const std::lock_guard lock(channel_->mutex);
      return static_cast<int>(channel_->outlets.size());
    }
    bool WaitForAcknowledgments(Duration) override { return true; }

   private:
    bool Lost(const Header& header) const {
      const std::lock_guard lock(network_->mutex);
      return network_->lose != nullptr && network_->lose(topic_, header);
    }

    const std::shared_ptr<Channel<Sample>> channel_;  ///< shared with the other endpoints
    const std::shared_ptr<Network> network_;          ///< shared with the bus
    const std::string topic_;
    const std::string source_;
    const Clock& clock_;
    std::string name_;
    std::uint64_t sent_ = 0;
  };

  template <class Sample>
  class MemoryReader final : public Reader {
   public:
    MemoryReader(std::shared_ptr<Channel<Sample>> channel, Callback<Sample> callback,
                 const Clock& clock)
        : channel_(std::move(channel)), outlet_(std::make_shared<Outlet<Sample>>()) {
      outlet_->callback = std::move(callback);
      std::deque<std::pair<Sample, Reception>> kept;
      {
        const std::lock_guard lock(channel_->mutex);
        channel_->outlets.push_back(outlet_);
        kept = channel_->kept;
      }
      for (auto& [sample, reception] : kept) {
        reception.received = clock.Now();
        outlet_->Deliver(sample, reception);
      }
    }

    ~MemoryReader() override {
      {
        const std::lock_guard lock(channel_->mutex);
        auto& outlets = channel_->outlets;
        outlets.erase(std::remove(outlets.begin(), outlets.end(), outlet_), outlets.end());
      }
      const std::lock_guard lock(outlet_->mutex);
      outlet_->callback = nullptr;
    }

    int matched_writers() const override {
      const std::lock_guard lock(channel_->mutex);
      return channel_->writers;
    }

    std::vector<SourceCount> counts() const override {
      const std::lock_guard lock(outlet_->mutex);
      std::vector<SourceCount> counts;
      for (const auto& [who, numbers] : outlet_->numbers) {
        if (counts.empty() || counts.back().source != who.first) {
          counts.push_back({.source = who.first});
        }
        counts.back().received += numbers.received();
        counts.back().lost += numbers.lost();
      }
      return counts;
    }

   private:
    const std::shared_ptr<Channel<Sample>> channel_;
    const std::shared_ptr<Outlet<Sample>> outlet_;
  };

  template <class Sample>
  Result<std::shared_ptr<Channel<Sample>>> FindOrMake(const std::string& topic) {
    const std::lock_guard lock(network_->mutex);
    std::shared_ptr<ChannelBase>& known = network_->channels[topic];
    if (known == nullptr) {
      auto made = std::make_shared<Channel<Sample>>();
      made->keep = std::is_same_v<Sample, StatusSample> ? kStatusesKept : 0;
      known = made;
    }
    auto channel = std::dynamic_pointer_cast<Channel<Sample>>(known);
    if (channel == nullptr) return InvalidArgument("topic " + topic + " carries another type");
    return channel;
  }

  const Clock& clock_;
  const std::shared_ptr<Network> network_ = std::make_shared<Network>();
};

// Compiled once, in memory_bus.cpp: eleven sample types take a compiler 15 s.
extern template class BusOf<MemoryBus>;

}  // namespace exemplar::ircp
