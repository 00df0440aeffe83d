#pragma once
// A station's topics as the gateway offers them to clients that do not speak DDS.

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::api {

struct TopicInfo {
  std::string topic;
  std::string type;    ///< its name on the network: "exemplar::ircp::v1::Suit"
  std::string schema;  ///< flattened IDL; empty where no writer brought one
  bool keyed = false;
  bool reliable = false;
  bool transient_local = false;
  int writers = 0;             ///< now
  std::uint64_t received = 0;  ///< by the gateway since it started, as all figures here
  std::uint64_t lost = 0;      ///< by the numbers of those that came or were announced
  double rate_hz = 0;          ///< over the last second
  double bytes_per_s = 0;
  int subscriptions = 0;  ///< of the gateway's clients, now
  bool may_publish = false;
};

struct TopicSample {
  std::string topic;
  std::string writer;                  ///< its identity on the network
  std::uint64_t sequence = 0;          ///< the protocol's number for the writer
  Stamp source_stamp;                  ///< as the writer's middleware stamped it
  Stamp received;                      ///< by the gateway, on its clock
  std::vector<std::uint8_t> cdr = {};  ///< with its 4-byte encapsulation header; where asked for
  std::string json = {};               ///< where asked for; empty where it could not be read
  std::string json_error = {};         ///< why: "no schema", ...
};

struct TopicSubscription {
  /// Names, or patterns in which * stands for any text ("ircp/*"); empty: all, those that come
  /// later among them.
  std::vector<std::string> topics = {};
  /// Of each writer of a topic; samples above it are left out and not counted as missed. 0: all.
  double max_rate_hz = 0;
  /// What may wait for a slow client; of more the oldest are dropped, and counted as missed. 0: the
  /// gateway's default, which is also the most.
  int queue = 0;
  bool cdr = true;
  bool json = false;
  /// First the last sample of each writer that keeps its last ones for those who come late.
  bool last = true;
};

/// What came since the last one.
struct TopicBatch {
  std::vector<TopicInfo>
      topics;  ///< of which samples come for the first time, here or in `samples`
  std::vector<TopicSample> samples;
  std::uint64_t missed = 0;  ///< dropped because this client was slow, since the beginning
};

struct TopicPublication {
  std::string topic;
  /// Needed for a topic that nobody writes or that is none of ours.
  std::string type = {};
  std::string schema = {};
  /// One of the two: the sample's bytes with their encapsulation header, or its members as JSON;
  /// there, `source`, `seq` and `stamp_ns` are filled in where they are absent.
  std::vector<std::uint8_t> cdr = {};
  std::string json = {};
};

/// Implementations are thread-safe.
class TopicApi {
 public:
  virtual ~TopicApi() = default;
  /// `topics` as in TopicSubscription.
  virtual Result<std::vector<TopicInfo>> List(const std::vector<std::string>& topics) = 0;
  /// Returns when `on_batch` returned false or `stop` was requested (both without error), or with
  /// what went wrong. `on_batch` may take its time: others are not held up by it.
  virtual Status Subscribe(const TopicSubscription& subscription,
                           const std::function<bool(const TopicBatch&)>& on_batch,
                           std::stop_token stop) = 0;
  /// Errors: kFailedPrecondition for a topic that the gateway may not write, kInvalidArgument for a
  /// sample that is not of the topic's type.
  virtual Status Publish(const TopicPublication& publication) = 0;
};

}  // namespace exemplar::api
