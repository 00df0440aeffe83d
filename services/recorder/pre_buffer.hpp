#pragma once
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "exemplar/ircp/bus.hpp"
#include "recorder/loss_ledger.hpp"

namespace exemplar::recorder {

/// A sample on its way to the file.
struct Arrival {
  ircp::RawSample sample;
  std::shared_ptr<const ircp::RawTopic> topic;  ///< shared with the ledger
  std::string source;
};

/// The last seconds of what came while no file was open, so that a recording can begin before the
/// event that it is about. Goes out in whole segments, each of which knows the loss figures at its
/// beginning: what is kept is counted as exactly as what comes later. Thread-compatible.
class PreBuffer {
 public:
  /// Keeps at least `length` (0: nothing), as far as `bytes` allow.
  PreBuffer(Duration length, std::size_t bytes);

  using Figures = std::function<std::vector<WriterFigures>()>;
  /// Before the figures take the next sample in.
  void Prepare(Duration steady_now, const Figures& figures);
  /// After it.
  void Add(Arrival arrival, Duration steady_now);

  struct Content {
    std::deque<Arrival> arrivals;
    std::size_t bytes = 0;
    std::vector<WriterFigures> figures;  ///< before the first of them
  };
  /// Leaves the buffer empty. `figures` where nothing is kept.
  Content Take(Duration steady_now, const Figures& figures);
  void Clear();

  Duration length(Duration steady_now) const;
  std::size_t bytes() const { return bytes_; }

 private:
  struct Segment {
    Duration begin{0};
    Duration end{0};
    std::size_t bytes = 0;
    std::vector<WriterFigures> figures;
    std::deque<Arrival> arrivals;
  };
  void DropOld(Duration steady_now);

  Duration length_;
  std::size_t limit_bytes_;
  std::size_t bytes_ = 0;
  std::deque<Segment> segments_;
};

}  // namespace exemplar::recorder
