#pragma once
// What a program in step has sent, and what has come for it and waits for its moment.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/base/stamp.hpp"
#include "exemplar/ircp/samples.hpp"

namespace exemplar::ircp {

/// Samples of sources in step are held until the moment they are for; those of others are handed
/// on when they come. Thread-safe.
class StepMail {
 public:
  using Deliver = std::function<void()>;

  // ---- writers ----
  int AddWriter(std::string topic, std::string source, std::function<std::uint64_t()> sent);
  /// Its last count stays; `sent` is not asked any more.
  void RemoveWriter(int writer);
  std::vector<TopicCount> Sent() const;

  // ---- readers; the calls of `deliver` of one reader never overlap ----
  int AddReader(std::string topic);
  /// Who writes and is matched; nobody is waited for before. The one before is not asked any more.
  void SetMatched(int reader, std::function<int()> matched_writers);
  /// After this nothing is delivered to it any more. Not from within a delivery to it.
  void RemoveReader(int reader);
  enum class Kind {
    kSample,   ///< at the moment after the one at which it was sent
    kCommand,  ///< once the program has come to the time at which it was sent
    kAnswer,   ///< at once
  };
  void Take(int reader, Kind kind, const Header& header, Deliver deliver);

  // ---- the clock's side; one thread ----
  /// Who is in step, from now on.
  void Learn(const std::vector<TopicCount>& counts);
  /// Who is heard by now, while nothing beyond these counts has been sent: their next sample is
  /// waited for, be it the first.
  void NoteMatched(const std::vector<TopicCount>& counts);
  /// Whether everything up to these counts has come, but for what came before we read.
  bool HasCome(const std::vector<TopicCount>& counts);
  /// What has not come by now will not.
  void GiveUp(const std::vector<TopicCount>& counts);
  /// Hands each sample up to these counts on, and calls `then` after each: joint states last, since
  /// what is done with them regards the others.
  void DeliverUpTo(const std::vector<TopicCount>& counts, const std::function<void()>& then);
  /// Commands wait from Close on until the time is opened again.
  void Close();
  void Open(Stamp now);

 private:
  using Key = std::pair<std::string, std::string>;  ///< topic, source
  /// Asked without our lock, and never again once it was taken away.
  template <class Value>
  struct Question {
    std::mutex mutex;
    std::function<Value()> ask;
    Value Answer(Value otherwise) {
      const std::lock_guard lock(mutex);
      return ask ? ask() : otherwise;
    }
    void Set(std::function<Value()> other) {
      const std::lock_guard lock(mutex);
      ask = std::move(other);
    }
  };
  struct Letter {
    std::uint64_t seq = 0;
    Deliver deliver;
  };
  struct Box {
    std::uint64_t last = 0;      ///< number of the last one that came
    std::uint64_t baseline = 0;  ///< of those before it nothing is expected
    bool is_matched = false;     ///< what its writers send from `baseline` on is heard
    bool is_anothers = false;    ///< `last` is of a writer that took the place of one before
    std::deque<Letter> held;
  };
  struct ReaderEntry {
    std::string topic;
    std::shared_ptr<Question<int>> matched_writers;
    std::map<std::string, Box> boxes;            ///< by source
    std::shared_ptr<std::recursive_mutex> turn;  ///< held while it is delivered to
  };
  struct WriterEntry {
    TopicCount count;
    std::shared_ptr<Question<std::uint64_t>> sent;  ///< null: it has gone
  };
  struct Command {
    int reader = 0;
    Stamp stamp;
    Deliver deliver;
  };

  /// Without mutex_.
  void DeliverTo(int reader, const Deliver& deliver);

  mutable std::mutex mutex_;
  std::map<int, WriterEntry> writers_;
  std::map<int, ReaderEntry> readers_;
  int last_id_ = 0;
  std::map<Key, std::uint64_t> in_step_;  ///< the counts that were heard last
  std::optional<Stamp> open_;             ///< null: commands wait
  std::deque<Command> commands_;
};

}  // namespace exemplar::ircp
