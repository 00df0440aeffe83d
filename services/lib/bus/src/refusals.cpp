#include "refusals.hpp"

#include <utility>

namespace exemplar::bus {
namespace {

constexpr Duration kBetweenLines = std::chrono::seconds(1);

}  // namespace

Refusals::Refusals(std::string topic, const Clock& clock, Log& log)
    : topic_(std::move(topic)), clock_(clock), log_(log), next_line_(clock.Steady()) {}

Refusals::~Refusals() {
  next_line_ = clock_.Steady();
  TellIfDue();
}

void Refusals::Add(const std::string& writer, const std::string& error) {
  const std::lock_guard lock(mutex_);
  ++total_;
  last_writer_ = writer;
  last_error_ = error;
  TellIfDue();
}

void Refusals::Tick() {
  const std::lock_guard lock(mutex_);
  TellIfDue();
}

std::uint64_t Refusals::total() const {
  const std::lock_guard lock(mutex_);
  return total_;
}

void Refusals::TellIfDue() {
  if (total_ == told_) return;
  const Duration now = clock_.Steady();
  if (now < next_line_) return;
  log_.Warning("samples refused", {{"topic", topic_},
                                   {"count", total_ - told_},
                                   {"writer", last_writer_},
                                   {"error", last_error_}});
  told_ = total_;
  next_line_ = now + kBetweenLines;
}

}  // namespace exemplar::bus
