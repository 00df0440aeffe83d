#pragma once
// A raw network within the test: topics appear and samples arrive when the test says so.

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/raw_writer.hpp"

namespace exemplar::gateway {

class MemoryStation final : public ircp::RawBus, public ircp::RawOutlet {
 public:
  Result<std::unique_ptr<ircp::RawTap>> MakeTap(ircp::RawTapOptions options) override {
    options_ = std::move(options);
    return std::unique_ptr<ircp::RawTap>(std::make_unique<Tap>(*this));
  }
  Result<std::unique_ptr<ircp::RawWriter>> MakeRawWriter(const ircp::RawTopic& topic) override {
    opened.push_back(topic);
    return std::unique_ptr<ircp::RawWriter>(std::make_unique<Writer>(*this, opened.size()));
  }

  /// A writer was found.
  void Appear(ircp::RawTopic topic) {
    if (topics_.emplace(topic.topic, topic).second) options_.on_topic(topic);
    options_.wanted(topic);
  }
  void Arrive(const std::string& topic, std::uint64_t number, std::vector<std::uint8_t> cdr = {},
              const std::string& writer = "w") {
    options_.on_sample({.topic = topic,
                        .writer = writer,
                        .sequence = number,
                        .source_stamp = Stamp::FromNanoseconds(static_cast<std::int64_t>(number)),
                        .received = Stamp::FromNanoseconds(1),
                        .cdr = std::move(cdr)});
  }

  /// Of the writer that was opened as number `writer`, from 1.
  static ircp::Guid GuidOf(std::size_t writer) {
    return {7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 0, 0, static_cast<std::uint8_t>(writer), 3};
  }

  std::vector<ircp::RawTopic> opened;
  std::vector<std::vector<std::uint8_t>> written;

 private:
  class Tap final : public ircp::RawTap {
   public:
    explicit Tap(MemoryStation& station) : station_(station) {}
    std::vector<ircp::RawTopic> topics() const override { return {}; }
    int matched_writers(const std::string& topic) const override {
      return static_cast<int>(station_.topics_.count(topic));
    }

   private:
    MemoryStation& station_;
  };
  class Writer final : public ircp::RawWriter {
   public:
    Writer(MemoryStation& station, std::size_t number) : station_(station), number_(number) {}
    Status Write(std::span<const std::uint8_t> cdr, Stamp) override {
      station_.written.emplace_back(cdr.begin(), cdr.end());
      return {};
    }
    int matched_readers() const override { return 1; }
    bool WaitForAcknowledgments(Duration) override { return true; }
    ircp::Guid guid() const override { return GuidOf(number_); }

   private:
    MemoryStation& station_;
    const std::size_t number_;
  };

  ircp::RawTapOptions options_;
  std::map<std::string, ircp::RawTopic> topics_;
};

inline constexpr const char* kScaleIdl =
    "module lab { struct Scale { @key string source; unsigned long long seq; long long stamp_ns; "
    "double mass_kg; }; };";

inline ircp::RawTopic ScaleTopic(const std::string& topic = "scale") {
  ircp::RawTopic raw;
  raw.topic = topic;
  raw.type = "lab::Scale";
  raw.schema = kScaleIdl;
  raw.keyed = true;
  raw.reliable = true;
  return raw;
}

}  // namespace exemplar::gateway
