#pragma once
// The simulated stereo cameras: draws on a thread of its own and publishes the pictures.

#include <memory>
#include <string>
#include <vector>

#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/scene/description.hpp"
#include "simulator/world.hpp"

namespace exemplar::simulator {

struct CameraOptions {
  std::string encoding = "jpeg";  ///< or "png"
  int quality = 95;               ///< of jpeg, 1 to 100
};

/// Thread-safe.
class Cameras {
 public:
  /// Draws `world` (copied) with every camera of `scene`. kUnavailable: this machine cannot draw.
  /// `bus` and `log` outlive the cameras.
  static Result<std::unique_ptr<Cameras>> Create(ircp::Bus& bus, Log& log, const World& world,
                                                 const scene::Description& scene,
                                                 const CameraOptions& options);
  virtual ~Cameras() = default;
  /// Takes pictures with every camera that is due at `world`'s time; `stamp` is the same time on
  /// the wall clock. Skips and counts those whose last picture is still being drawn.
  virtual void Look(const World& world, Stamp stamp) = 0;
  /// Returns when the pictures taken so far have been sent.
  virtual void Flush() = 0;
  virtual std::uint64_t skipped() const = 0;
  virtual std::vector<ircp::TopicCount> sent() const = 0;
};

}  // namespace exemplar::simulator
