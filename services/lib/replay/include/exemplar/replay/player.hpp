#pragma once
// Sends a recording's messages again, with the intervals in which they came.

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/raw_writer.hpp"
#include "exemplar/recording/reader.hpp"

namespace exemplar::replay {

/// Whether a topic holds measurements: true but for commands, states and answers of programs, the
/// emergency stop, and the clock, which would act on what runs now.
bool HoldsMeasurements(const std::string& topic);

struct PlayOptions {
  double rate = 1;                   ///< so many times faster than recorded
  Duration start{0};                 ///< from the recording's first message
  std::optional<Duration> end = {};  ///< likewise; excluded
  bool loop = false;                 ///< begins again at `start` until stopped
  bool paused = false;               ///< waits for Resume or Step
  std::function<bool(const std::string& topic)> wanted = HoldsMeasurements;
};

struct PlayStatus {
  std::string state;  ///< "playing", "paused", "done"
  Duration position{0};
  Duration length{0};
  double rate = 1;
  int passes = 0;  ///< begun, with `loop`
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;  ///< that the network did not take
  Duration latest{0};         ///< the most that a message was behind its time
  Duration mean_lateness{0};
};

/// What is done with one topic of the recording.
struct TopicPlan {
  std::string topic;
  std::string type;
  std::uint64_t messages = 0;  ///< of the whole recording; 0 where it has no statistics
  std::string left_out;        ///< why it is not played; empty: it is
};

/// Plays the messages by their log times: bytes untouched, by one writer for each that was
/// recorded, with its type, schema and quality of service. A sample's source time is the original
/// one; when it was sent now is what receivers see as its reception. A message that is late goes
/// out at once, and the next ones keep their own times.
///
/// Run is called once; everything else is thread-safe.
class Player {
 public:
  /// kInvalidArgument: nothing to play, or options out of range; kDataLoss: a file that was not
  /// closed or has no index. File, network and clock outlive the player.
  static Result<std::unique_ptr<Player>> Create(recording::ByteSource& file,
                                                ircp::RawOutlet& network, const Clock& clock,
                                                PlayOptions options);
  virtual ~Player() = default;

  /// Returns at the recording's end, or when `stop` is requested.
  virtual Status Run(std::stop_token stop) = 0;

  virtual void Pause() = 0;
  virtual void Resume() = 0;
  /// Sends the next message at once and stays paused.
  virtual void Step() = 0;
  /// Goes on from there; beyond either end means the end.
  virtual void Seek(Duration position) = 0;
  virtual Status SetRate(double rate) = 0;

  virtual PlayStatus status() const = 0;
  virtual const std::vector<TopicPlan>& topics() const = 0;
  /// Topics that nobody reads.
  virtual std::vector<std::string> UnreadTopics() const = 0;
  /// The last numbers that were sent, by topic and source, as programs announce them.
  virtual std::vector<ircp::TopicCount> sent() const = 0;
  /// Waits until the readers have acknowledged everything, together at most `timeout`.
  virtual bool WaitForAcknowledgments(Duration timeout) = 0;
};

}  // namespace exemplar::replay
