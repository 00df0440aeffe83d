#include "answer_stream.hpp"

#include <utility>

namespace exemplar::http {

void AnswerStream::Begin(int status, Headers headers) {
  const std::lock_guard lock(mutex_);
  if (began_ || gone_) return;
  began_ = true;
  head_ = Response{status, std::move(headers)};
  if (!taking_) wake_();
}

bool AnswerStream::Write(std::string_view piece) {
  std::unique_lock lock(mutex_);
  if (!began_) return false;
  room_.wait(lock, [&] { return gone_ || bytes_.size() + in_flight_ < most_bytes_; });
  if (gone_) return false;
  bytes_ += piece;
  if (!taking_) wake_();
  return true;
}

void AnswerStream::End() {
  const std::lock_guard lock(mutex_);
  ended_ = true;
  if (!began_) {
    head_ = Response{500, {{"Content-Type", "text/plain; charset=utf-8"}}};
    bytes_ = "the handler gave no answer\n";
  }
  if (!taking_ && !gone_) wake_();
}

std::optional<AnswerStream::Next> AnswerStream::Take() {
  const std::lock_guard lock(mutex_);
  taking_ = head_.has_value() || !bytes_.empty() || ended_;
  if (!taking_) return std::nullopt;
  Next next{std::exchange(head_, std::nullopt), std::exchange(bytes_, {}), ended_};
  in_flight_ = next.bytes.size();
  return next;
}

void AnswerStream::Sent(std::size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    in_flight_ -= bytes;
  }
  room_.notify_all();
}

void AnswerStream::Abandon() {
  {
    const std::lock_guard lock(mutex_);
    gone_ = true;
    bytes_.clear();
  }
  room_.notify_all();
}

}  // namespace exemplar::http
