#pragma once
// Bodies that are not convex, as many small convex pieces: the triangles of a mesh or the cells of
// an octree, under a tree of boxes.

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "convex_shape.hpp"

namespace exemplar::collision {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Immutable, so thread-safe.
class Pieces {
 public:
  /// The surface of a closed mesh; what it encloses belongs to the body. `shell_points`: a point of
  /// each connected part of the surface. Preconditions: closed; neither is empty.
  static std::shared_ptr<const Pieces> OfMesh(std::vector<Triangle> triangles,
                                              std::vector<Eigen::Vector3d> shell_points);
  /// Precondition: not empty.
  static std::shared_ptr<const Pieces> OfCells(std::vector<Bounds> cells);

  std::size_t size() const { return boxes_.size(); }
  const Bounds& bounds() const { return nodes_.front().bounds; }
  /// Whether a closed mesh encloses the point: by the crossings of three rays. False for cells.
  bool Encloses(const Eigen::Vector3d& p) const;

 private:
  friend class PiecesDistance;
  struct Node {
    Bounds bounds;
    int begin = 0;   ///< of its pieces
    int end = 0;     ///< past the last
    int right = -1;  ///< its second child; the first follows the node. A leaf has none.
  };

  Pieces() = default;
  void Build();
  int BuildNode(std::vector<int>& order, int begin, int end);
  int Crossings(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                int& signed_crossings) const;

  std::vector<Triangle> triangles_;  ///< of a mesh; empty for cells
  std::vector<Bounds> boxes_;        ///< the cells, or the triangles' bounds
  std::vector<Eigen::Vector3d> shell_points_;
  std::vector<Node> nodes_;
};

/// A body: a convex shape around it and, where that is not the body itself, its pieces.
struct Solid {
  const ConvexShape& hull;
  const Pieces* pieces;  ///< null: the hull is the body
  const Placement& at;
};

/// Signed distance of bodies of which at least one has pieces. Never more than the true distance by
/// more than rounding. At `ignore_beyond_m` and more it may be any value from there on. Negative
/// where they overlap or one encloses the other; it is then the overlap of the deepest pair of
/// pieces, so the bodies are at least nearly as deep in each other.
Separation DistanceOfPieces(const Solid& first, const Solid& second, double ignore_beyond_m);

}  // namespace exemplar::collision
