#pragma once
// An answer in pieces, between its handler's thread and the network thread.

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>

#include "exemplar/http/server.hpp"

namespace exemplar::http {

/// Thread-safe.
class AnswerStream final : public Stream {
 public:
  /// `wake` makes the network thread look; called on the handler's thread.
  AnswerStream(std::size_t most_bytes, std::function<void()> wake)
      : most_bytes_(most_bytes), wake_(std::move(wake)) {}

  void Begin(int status, Headers headers) override;
  bool Write(std::string_view piece) override;
  /// The handler has returned.
  void End();

  // For the network thread.

  struct Next {
    std::optional<Response> head;  ///< once, first
    std::string bytes;
    bool ended = false;  ///< nothing comes after `bytes`
  };
  /// What there is to send; nullopt when the handler has to come first.
  std::optional<Next> Take();
  /// `Take`n bytes were sent.
  void Sent(std::size_t bytes);
  /// The client has gone.
  void Abandon();

 private:
  const std::size_t most_bytes_;
  const std::function<void()> wake_;
  std::mutex mutex_;
  std::condition_variable room_;
  std::optional<Response> head_;
  bool began_ = false;
  bool ended_ = false;
  bool gone_ = false;
  bool taking_ = false;  ///< the network thread is at it and will look again
  std::string bytes_;
  std::size_t in_flight_ = 0;
};

}  // namespace exemplar::http
