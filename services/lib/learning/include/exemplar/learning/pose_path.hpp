#pragma once
#include <cstddef>
#include <iterator>
#include <vector>

#include "exemplar/geometry/pose.hpp"

namespace exemplar::learning {

/// Poses at the frames of a trial, read like a vector. What stands still to the last bit is kept as
/// one pose: most objects do.
class PosePath {
 public:
  PosePath() = default;
  PosePath(std::size_t frames, const geometry::Pose& pose)
      : size_(frames), poses_(frames > 0 ? 1 : 0, pose) {}
  /// Not explicit: a path is its poses.
  PosePath(std::vector<geometry::Pose> poses) : size_(poses.size()), poses_(std::move(poses)) {
    for (const geometry::Pose& pose : poses_) {
      if (pose.translation != poses_.front().translation ||
          pose.rotation.coeffs() != poses_.front().rotation.coeffs()) {
        return;
      }
    }
    if (size_ > 1) poses_ = std::vector<geometry::Pose>(1, geometry::Pose(poses_.front()));
  }
  operator std::vector<geometry::Pose>() const { return {begin(), end()}; }

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  bool still() const { return poses_.size() <= 1; }
  const geometry::Pose& operator[](std::size_t frame) const { return poses_[still() ? 0 : frame]; }
  const geometry::Pose& front() const { return poses_.front(); }
  const geometry::Pose& back() const { return poses_.back(); }

  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = geometry::Pose;
    using difference_type = std::ptrdiff_t;
    using pointer = const geometry::Pose*;
    using reference = const geometry::Pose&;
    Iterator() = default;
    Iterator(const PosePath* path, std::size_t frame) : path_(path), frame_(frame) {}
    reference operator*() const { return (*path_)[frame_]; }
    pointer operator->() const { return &(*path_)[frame_]; }
    Iterator& operator++() {
      ++frame_;
      return *this;
    }
    Iterator operator++(int) {
      Iterator before = *this;
      ++frame_;
      return before;
    }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    const PosePath* path_ = nullptr;
    std::size_t frame_ = 0;
  };
  Iterator begin() const { return {this, 0}; }
  Iterator end() const { return {this, size_}; }

 private:
  std::size_t size_ = 0;
  std::vector<geometry::Pose> poses_;
};

}  // namespace exemplar::learning
