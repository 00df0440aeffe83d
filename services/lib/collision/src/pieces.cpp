#include "pieces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "gjk.hpp"

namespace exemplar::collision {
namespace {

constexpr int kPiecesALeaf = 2;

void Extend(Bounds& bounds, const Bounds& other) {
  bounds.lower = bounds.lower.cwiseMin(other.lower);
  bounds.upper = bounds.upper.cwiseMax(other.upper);
}

/// The bounds, in the frame of `at`, of a box given in the placed frame.
Bounds Placed(const Bounds& box, const Placement& at) {
  const Eigen::Vector3d centre = at * (0.5 * (box.lower + box.upper));
  const Eigen::Vector3d extent = at.rotation.cwiseAbs() * (0.5 * (box.upper - box.lower));
  return {centre - extent, centre + extent};
}

bool Contains(const Bounds& outer, const Bounds& inner) {
  return (outer.lower.array() <= inner.lower.array()).all() &&
         (outer.upper.array() >= inner.upper.array()).all();
}

/// first_T_second of two placements in one frame.
Placement Relative(const Placement& first, const Placement& second) {
  return {first.rotation.transpose() * second.rotation,
          first.rotation.transpose() * (second.translation - first.translation)};
}

struct OfTriangle {
  const Triangle& corners;
  Eigen::Vector3d operator()(const Eigen::Vector3d& d) const {
    const double a = corners[0].dot(d);
    const double b = corners[1].dot(d);
    const double c = corners[2].dot(d);
    return a >= b ? (a >= c ? corners[0] : corners[2]) : (b >= c ? corners[1] : corners[2]);
  }
};

struct OfCell {
  const Bounds& cell;
  Eigen::Vector3d operator()(const Eigen::Vector3d& d) const {
    return (d.array() < 0).select(cell.lower, cell.upper);
  }
};

struct OfCore {
  const ConvexShape& shape;
  const Placement& at;
  Eigen::Vector3d operator()(const Eigen::Vector3d& d) const {
    return at * shape.CoreSupport(at.rotation.transpose() * d);
  }
};

template <class Body>
struct Moved {
  Body body;
  const Placement& at;
  Eigen::Vector3d operator()(const Eigen::Vector3d& d) const {
    return at * body(at.rotation.transpose() * d);
  }
};

/// The overlap of two bodies along the best of some directions: negative distance.
template <class First, class Second>
Separation Overlap(const First& first, const Second& second,
                   std::span<const Eigen::Vector3d> directions) {
  Separation best;
  best.distance_m = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& direction : directions) {
    const double length = direction.norm();
    if (!(length > 1e-12)) continue;
    for (const double sign : {1.0, -1.0}) {
      const Eigen::Vector3d n = sign / length * direction;
      const Eigen::Vector3d p = first(n);
      const Eigen::Vector3d q = second(-n);
      const double apart = n.dot(q - p);
      if (apart > best.distance_m) best = {apart, p, q, n};
    }
  }
  // The bodies overlap, whatever rounding says along a direction.
  best.distance_m = std::min(best.distance_m, 0.0);
  return best;
}

Eigen::Vector3d NormalOf(const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

}  // namespace

std::shared_ptr<const Pieces> Pieces::OfMesh(std::vector<Triangle> triangles,
                                             std::vector<Eigen::Vector3d> shell_points) {
  auto pieces = std::shared_ptr<Pieces>(new Pieces());
  pieces->triangles_ = std::move(triangles);
  pieces->shell_points_ = std::move(shell_points);
  for (const Triangle& t : pieces->triangles_) {
    pieces->boxes_.push_back(
        {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])});
  }
  pieces->Build();
  return pieces;
}

std::shared_ptr<const Pieces> Pieces::OfCells(std::vector<Bounds> cells) {
  auto pieces = std::shared_ptr<Pieces>(new Pieces());
  pieces->boxes_ = std::move(cells);
  pieces->Build();
  return pieces;
}

void Pieces::Build() {
  std::vector<int> order(boxes_.size());
  std::iota(order.begin(), order.end(), 0);
  nodes_.reserve(boxes_.size());
  BuildNode(order, 0, static_cast<int>(order.size()));
  std::vector<Bounds> boxes;
  std::vector<Triangle> triangles;
  boxes.reserve(boxes_.size());
  triangles.reserve(triangles_.size());
  for (const int piece : order) {
    boxes.push_back(boxes_[piece]);
    if (!triangles_.empty()) triangles.push_back(triangles_[piece]);
  }
  boxes_ = std::move(boxes);
  triangles_ = std::move(triangles);
}

int Pieces::BuildNode(std::vector<int>& order, int begin, int end) {
  const int index = static_cast<int>(nodes_.size());
  Node node;
  node.begin = begin;
  node.end = end;
  node.bounds = boxes_[order[begin]];
  const auto middle_of = [&](int piece) -> Eigen::Vector3d {
    return boxes_[piece].lower + boxes_[piece].upper;
  };
  Bounds middles{middle_of(order[begin]), middle_of(order[begin])};
  for (int i = begin + 1; i < end; ++i) {
    Extend(node.bounds, boxes_[order[i]]);
    const Eigen::Vector3d middle = middle_of(order[i]);
    Extend(middles, {middle, middle});
  }
  nodes_.push_back(node);
  if (end - begin <= kPiecesALeaf) return index;
  int axis = 0;
  (middles.upper - middles.lower).maxCoeff(&axis);
  const int half = begin + (end - begin) / 2;
  std::nth_element(order.begin() + begin, order.begin() + half, order.begin() + end,
                   [&](int a, int b) { return middle_of(a)[axis] < middle_of(b)[axis]; });
  BuildNode(order, begin, half);
  const int right = BuildNode(order, half, end);
  nodes_[index].right = right;
  return index;
}

int Pieces::Crossings(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                      int& signed_crossings) const {
  int crossings = 0;
  std::vector<int> stack = {0};
  while (!stack.empty()) {
    const Node& node = nodes_[stack.back()];
    const int index = stack.back();
    stack.pop_back();
    double enter = 0;
    double leave = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      const double a = (node.bounds.lower[i] - from[i]) / direction[i];
      const double b = (node.bounds.upper[i] - from[i]) / direction[i];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    if (enter > leave * (1 + 1e-12)) continue;
    if (node.right >= 0) {
      stack.push_back(node.right);
      stack.push_back(index + 1);
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) {
      // Moller & Trumbore 1997.
      const Triangle& t = triangles_[i];
      const Eigen::Vector3d edge1 = t[1] - t[0];
      const Eigen::Vector3d edge2 = t[2] - t[0];
      const Eigen::Vector3d across = direction.cross(edge2);
      const double determinant = edge1.dot(across);
      if (determinant == 0) continue;
      const Eigen::Vector3d to = from - t[0];
      const double u = to.dot(across) / determinant;
      if (u < 0 || u > 1) continue;
      const Eigen::Vector3d other = to.cross(edge1);
      const double v = direction.dot(other) / determinant;
      if (v < 0 || u + v > 1 || edge2.dot(other) / determinant < 0) continue;
      ++crossings;
      signed_crossings += determinant > 0 ? 1 : -1;
    }
  }
  return crossings;
}

bool Pieces::Encloses(const Eigen::Vector3d& p) const {
  if (triangles_.empty() || !Contains(bounds(), {p, p})) return false;
  // A ray may graze an edge; three that have nothing in common do not all.
  const Eigen::Vector3d directions[3] = {
      {0.5377, 0.6121, 0.5799}, {-0.6713, 0.3319, 0.6627}, {0.2811, -0.7517, -0.5967}};
  int inside = 0;
  for (const Eigen::Vector3d& direction : directions) {
    int turns = 0;  // Shells that overlap count twice; those that are turned inside out, odd.
    const int crossings = Crossings(p, direction, turns);
    inside += turns != 0 || crossings % 2 == 1;
  }
  return inside >= 2;
}

/// One question of DistanceOfPieces. Everything happens in the frame of `first`, whose pieces are
/// compared with a convex body or with the pieces of another.
class PiecesDistance {
 public:
  PiecesDistance(const Pieces& first, const Placement& second_at, double ignore_beyond_m)
      : first_(first), second_at_(second_at) {
    best_.distance_m = ignore_beyond_m;
  }

  Separation To(const ConvexShape& second) {
    const Bounds bounds = second.BoundsAt(second_at_);
    DescendAgainst(0, second, bounds);
    if (best_.distance_m > 0 && Contains(first_.bounds(), bounds) &&
        first_.Encloses(second_at_ * second.CoreSupport(Eigen::Vector3d::UnitX()))) {
      best_.distance_m = -best_.distance_m;
    }
    return best_;
  }

  Separation To(const Pieces& second) {
    second_ = &second;
    DescendBoth(0, 0);
    if (best_.distance_m > 0 && (Encloses(first_, second, second_at_) ||
                                 Encloses(second, first_, Relative(second_at_, Placement())))) {
      best_.distance_m = -best_.distance_m;
    }
    return best_;
  }

 private:
  static bool Encloses(const Pieces& outer, const Pieces& inner, const Placement& inner_at) {
    if (outer.triangles_.empty()) return false;
    if (inner.triangles_.empty()) {
      return outer.Encloses(inner_at * inner.boxes_.front().lower);
    }
    return std::any_of(inner.shell_points_.begin(), inner.shell_points_.end(),
                       [&](const Eigen::Vector3d& p) { return outer.Encloses(inner_at * p); });
  }

  /// Nothing deeper can be found where boxes stay apart; where they overlap all is looked at.
  bool Worthless(double bound) const { return bound > 0 && bound >= best_.distance_m; }

  void DescendAgainst(int index, const ConvexShape& second, const Bounds& bounds) {
    const Pieces::Node& node = first_.nodes_[index];
    if (node.right < 0) {
      for (int i = node.begin; i < node.end; ++i) {
        if (Worthless(Distance(first_.boxes_[i], bounds))) continue;
        const OfCore core{second, second_at_};
        if (first_.triangles_.empty()) {
          const Bounds& cell = first_.boxes_[i];
          Compare(OfCell{cell}, 0.5 * (cell.lower + cell.upper), core, second);
        } else {
          const Triangle& t = first_.triangles_[i];
          Compare(OfTriangle{t}, (t[0] + t[1] + t[2]) / 3, core, second, NormalOf(t));
        }
      }
      return;
    }
    const double left = Distance(first_.nodes_[index + 1].bounds, bounds);
    const double right = Distance(first_.nodes_[node.right].bounds, bounds);
    const int nearer = left <= right ? index + 1 : node.right;
    const int farther = left <= right ? node.right : index + 1;
    if (!Worthless(std::min(left, right))) DescendAgainst(nearer, second, bounds);
    if (!Worthless(std::max(left, right))) DescendAgainst(farther, second, bounds);
  }

  template <class Piece>
  void Compare(const Piece& piece, const Eigen::Vector3d& centre, const OfCore& core,
               const ConvexShape& shape, const Eigen::Vector3d& normal = Eigen::Vector3d::Zero()) {
    const Eigen::Vector3d towards = second_at_.translation - centre;
    const GjkAnswer answer =
        Gjk(piece, core, towards, std::max(0.0, best_.distance_m) + shape.radius());
    if (answer.apart) {
      TakeApart(answer, shape.radius());
      return;
    }
    const Eigen::Matrix3d& axes = second_at_.rotation;
    const std::array<Eigen::Vector3d, 8> directions = {normal,
                                                       towards,
                                                       axes.col(0),
                                                       axes.col(1),
                                                       axes.col(2),
                                                       Eigen::Vector3d::UnitX(),
                                                       Eigen::Vector3d::UnitY(),
                                                       Eigen::Vector3d::UnitZ()};
    Separation overlap = Overlap(piece, core, directions);
    overlap.distance_m -= shape.radius();
    TakeIfNearer(overlap);
  }

  void TakeApart(const GjkAnswer& answer, double second_radius) {
    const Eigen::Vector3d between = answer.p_second - answer.p_first;
    const double length = between.norm();
    const Eigen::Vector3d n =
        length > 0 ? Eigen::Vector3d(between / length) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
    TakeIfNearer({answer.distance_m - second_radius, answer.p_first,
                  answer.p_second - second_radius * n, n});
  }

  void TakeIfNearer(const Separation& found) {
    if (found.distance_m < best_.distance_m) best_ = found;
  }

  double NodeDistance(int a, int b) const {
    return Distance(first_.nodes_[a].bounds, Placed(second_->nodes_[b].bounds, second_at_));
  }

  void DescendBoth(int a, int b) {
    if (Worthless(NodeDistance(a, b))) return;
    const Pieces::Node& first = first_.nodes_[a];
    const Pieces::Node& second = second_->nodes_[b];
    if (first.right < 0 && second.right < 0) {
      for (int i = first.begin; i < first.end; ++i) {
        for (int j = second.begin; j < second.end; ++j) ComparePieces(i, j);
      }
      return;
    }
    const auto size = [](const Bounds& box) { return (box.upper - box.lower).squaredNorm(); };
    const bool split_first =
        second.right < 0 || (first.right >= 0 && size(first.bounds) >= size(second.bounds));
    const std::pair<int, int> left = split_first ? std::pair(a + 1, b) : std::pair(a, b + 1);
    const std::pair<int, int> right =
        split_first ? std::pair(first.right, b) : std::pair(a, second.right);
    const bool left_first =
        NodeDistance(left.first, left.second) <= NodeDistance(right.first, right.second);
    const auto& nearer = left_first ? left : right;
    const auto& farther = left_first ? right : left;
    DescendBoth(nearer.first, nearer.second);
    DescendBoth(farther.first, farther.second);
  }

  void ComparePieces(int i, int j) {
    if (Worthless(Distance(first_.boxes_[i], Placed(second_->boxes_[j], second_at_)))) return;
    if (first_.triangles_.empty()) {
      CompareWithSecond(OfCell{first_.boxes_[i]}, Eigen::Vector3d::Zero(), j);
    } else {
      CompareWithSecond(OfTriangle{first_.triangles_[i]}, NormalOf(first_.triangles_[i]), j);
    }
  }

  template <class Piece>
  void CompareWithSecond(const Piece& piece, const Eigen::Vector3d& normal, int j) {
    if (second_->triangles_.empty()) {
      CompareTwo(piece, normal, Moved<OfCell>{{second_->boxes_[j]}, second_at_},
                 Eigen::Vector3d::Zero());
    } else {
      const Triangle& t = second_->triangles_[j];
      CompareTwo(piece, normal, Moved<OfTriangle>{{t}, second_at_},
                 second_at_.rotation * NormalOf(t));
    }
  }

  template <class First, class Second>
  void CompareTwo(const First& first, const Eigen::Vector3d& first_normal, const Second& second,
                  const Eigen::Vector3d& second_normal) {
    const Eigen::Vector3d towards = second_at_.translation;
    const GjkAnswer answer = Gjk(first, second, towards, std::max(0.0, best_.distance_m));
    if (answer.apart) {
      TakeApart(answer, 0);
      return;
    }
    const Eigen::Matrix3d& axes = second_at_.rotation;
    const std::array<Eigen::Vector3d, 9> directions = {first_normal,
                                                       second_normal,
                                                       first_normal.cross(second_normal),
                                                       axes.col(0),
                                                       axes.col(1),
                                                       axes.col(2),
                                                       Eigen::Vector3d::UnitX(),
                                                       Eigen::Vector3d::UnitY(),
                                                       Eigen::Vector3d::UnitZ()};
    TakeIfNearer(Overlap(first, second, directions));
  }

  const Pieces& first_;
  const Placement second_at_;
  const Pieces* second_ = nullptr;
  Separation best_;
};

Separation DistanceOfPieces(const Solid& first, const Solid& second, double ignore_beyond_m) {
  if (first.pieces == nullptr) {
    Separation found = DistanceOfPieces(second, first, ignore_beyond_m);
    std::swap(found.p_first, found.p_second);
    found.normal = -found.normal;
    return found;
  }
  PiecesDistance question(*first.pieces, Relative(first.at, second.at), ignore_beyond_m);
  Separation found =
      second.pieces == nullptr ? question.To(second.hull) : question.To(*second.pieces);
  found.p_first = first.at * found.p_first;
  found.p_second = first.at * found.p_second;
  found.normal = first.at.rotation * found.normal;
  return found;
}

}  // namespace exemplar::collision
