#pragma once
// Where the marked objects are, from the stereo pictures on ircp/camera, onto ircp/objects.

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/perception/object_finder.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::capture_vision {

struct SessionOptions {
  perception::FinderOptions finder = {};
  /// Told when a picture has been dealt with.
  std::function<void()> on_settled = [] {};
};

/// What came of the pictures.
struct Counts {
  std::uint64_t pictures = 0;
  std::uint64_t skipped = 0;
  std::uint64_t unreadable = 0;
  std::uint64_t unknown_camera = 0;
  std::uint64_t found = 0;
  std::uint64_t one_eyed = 0;
  std::uint64_t implausible = 0;
};

/// Pictures are taken for the scene's camera whose name is their calibration id. Every object that
/// a pair shows goes out with the pair's own time stamp, its pose in the frame "base" and
/// variances; what only one eye saw, or what cannot be, is counted and left out. When pictures come
/// faster than they are searched, the newest is taken and the others are counted as skipped.
///
/// Status (program "capture_vision"): `pictures`, `skipped`, `unreadable`, `unknown_camera`,
/// `found`, `one_eyed`, `implausible`.
class Session {
 public:
  /// `bus`, `clock` and `log` outlive the session. The scene must have a camera and a marker.
  static Result<std::unique_ptr<Session>> Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                 const scene::Description& scene,
                                                 const SessionOptions& options = {});
  virtual ~Session() = default;
  /// Works until `stop`. Call once.
  virtual void Run(std::stop_token stop) = 0;

  /// Whether every picture that came has been dealt with. Thread-safe.
  virtual bool is_settled() const = 0;
  // For metrics; thread-safe.
  virtual Counts counts() const = 0;
  virtual double search_seconds() const = 0;
  virtual std::vector<ircp::TopicCount> sent() const = 0;
  virtual const ircp::Reader& reader() const = 0;
};

}  // namespace exemplar::capture_vision
