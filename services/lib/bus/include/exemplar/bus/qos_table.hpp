#pragma once
// The quality of service of every topic, as numbers in one place. docs/topics.md shows the same
// table; a test compares them.

#include <chrono>
#include <span>
#include <string_view>

namespace exemplar::bus {

struct TopicQos {
  std::string_view topic;  ///< "ircp/suit"; "<program>" stands for any program's name
  std::string_view type;   ///< last part of the type's name: "Suit"
  std::string_view rate;   ///< what is expected of the writers, for people
  bool reliable = true;
  /// Samples that a writer keeps for each instance: rate times the outage that it should survive.
  int depth = 0;
  int max_instances = 0;
  /// A writer tells its reliable readers this often what it holds.
  std::chrono::milliseconds heartbeat{20};
  /// Readers that come later get the last `depth` samples.
  bool transient_local = false;
  /// Longest time between two samples of a writer that works; 0: none.
  std::chrono::milliseconds deadline{0};
  /// Of reliable writers: a full history waits for its readers instead of losing the oldest sample.
  bool keep_all = false;
  /// Sent by a thread of the middleware's own: for what is too big for one datagram.
  bool asynchronous = false;
};

std::span<const TopicQos> QosTable();
/// Precondition: `type` is in the table.
const TopicQos& QosOfType(std::string_view type);

}  // namespace exemplar::bus
