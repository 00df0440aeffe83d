#pragma once
// Draws the simulated world as its stereo cameras see it, without a screen (EGL).

#include <memory>
#include <utility>

#include "exemplar/base/result.hpp"
#include "exemplar/perception/picture.hpp"
#include "exemplar/scene/description.hpp"
#include "simulator/world.hpp"

namespace exemplar::simulator {

/// Belongs to the thread that created it: use and destroy it there.
class Renderer {
 public:
  /// Copies what it needs of `world`. kUnavailable: this machine cannot draw.
  static Result<Renderer> Create(const World& world);
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  /// Left and right picture. Precondition: the camera is one of the world's scene.
  std::pair<perception::Picture, perception::Picture> Draw(const Snapshot& snapshot,
                                                           const scene::StereoCamera& camera);

 private:
  struct Impl;
  explicit Renderer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace exemplar::simulator
