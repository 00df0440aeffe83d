#include "edge_refinement.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace exemplar::perception {
namespace {

struct Line {
  Eigen::Vector2d point;
  Eigen::Vector2d direction;  ///< unit
};

constexpr double kSmallestContrast = 25;  // grey levels between paper and ink

/// Where along `normal` through `middle` dark turns light: the profile's light area tells, whatever
/// the lens or the pixels smear symmetrically. Offset from `middle` in pixels.
std::optional<double> EdgeOffset(const GreyView& picture, const Eigen::Vector2d& middle,
                                 const Eigen::Vector2d& normal, double reach) {
  constexpr double kStep = 0.25;
  const int half = static_cast<int>(std::floor(reach / kStep));
  std::vector<double> profile;
  profile.reserve(2 * static_cast<std::size_t>(half) + 1);
  for (int i = -half; i <= half; ++i) profile.push_back(picture.At(middle + i * kStep * normal));
  // The levels are those of the outer quarters, where the edge is not.
  const std::size_t quarter = std::max<std::size_t>(1, profile.size() / 5);
  double dark = 0;
  double light = 0;
  for (std::size_t i = 0; i < quarter; ++i) {
    dark += profile[i];
    light += profile[profile.size() - 1 - i];
  }
  dark /= static_cast<double>(quarter);
  light /= static_cast<double>(quarter);
  if (light - dark < kSmallestContrast) return std::nullopt;
  double area = 0;
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    area += 0.5 * (profile[i] + profile[i + 1]) - dark;
  }
  const double lit = kStep * area / (light - dark);
  const double offset = half * kStep - lit;
  if (std::abs(offset) > 0.75 * reach) return std::nullopt;
  return offset;
}

/// Total least squares.
Line FitLine(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(scatter);
  return {mean, solver.eigenvectors().col(1)};
}

double Distance(const Line& line, const Eigen::Vector2d& p) {
  const Eigen::Vector2d d = p - line.point;
  return std::abs(d.x() * line.direction.y() - d.y() * line.direction.x());
}

std::optional<Line> EdgeLine(const GreyView& picture, int cells, const Eigen::Vector2d& from,
                             const Eigen::Vector2d& to, const Eigen::Vector2d& inside) {
  const Eigen::Vector2d way = to - from;
  const double length = way.norm();
  if (length < 8) return std::nullopt;
  const double cell = length / cells;
  const double reach = std::clamp(0.75 * cell, 1.5, 5.0);
  Eigen::Vector2d normal(-way.y() / length, way.x() / length);
  if (normal.dot(from - inside) < 0) normal = -normal;  // outward, from dark to light

  // Not near the ends: there the profile would meet the next edge.
  const double margin = std::min(0.25, 1.2 * reach / length);
  const int samples = std::max(8, static_cast<int>(2 * length * (1 - 2 * margin)));
  std::vector<Eigen::Vector2d> points;
  points.reserve(static_cast<std::size_t>(samples));
  for (int i = 0; i < samples; ++i) {
    const double s = margin + (1 - 2 * margin) * (i + 0.5) / samples;
    const Eigen::Vector2d middle = from + s * way;
    if (const std::optional<double> offset = EdgeOffset(picture, middle, normal, reach)) {
      points.push_back(middle + *offset * normal);
    }
  }
  if (points.size() < static_cast<std::size_t>(samples) / 2) return std::nullopt;
  Line line = FitLine(points);
  // Once more without what does not lie on it (something in front of the marker).
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Eigen::Vector2d& p : points) distances.push_back(Distance(line, p));
  std::vector<double> sorted = distances;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const double limit = std::max(0.1, 3 * sorted[sorted.size() / 2]);
  std::vector<Eigen::Vector2d> kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (distances[i] <= limit) kept.push_back(points[i]);
  }
  return kept.size() >= 4 ? FitLine(kept) : line;
}

std::optional<Eigen::Vector2d> Intersection(const Line& a, const Line& b) {
  Eigen::Matrix2d directions;
  directions << a.direction, -b.direction;
  if (std::abs(directions.determinant()) < 0.1) return std::nullopt;
  const Eigen::Vector2d along = directions.inverse() * (b.point - a.point);
  return a.point + along.x() * a.direction;
}

}  // namespace

double GreyView::At(const Eigen::Vector2d& px) const {
  const double x = std::clamp(px.x(), 0.0, static_cast<double>(width - 1));
  const double y = std::clamp(px.y(), 0.0, static_cast<double>(height - 1));
  const int x0 = std::min(static_cast<int>(x), std::max(0, width - 2));
  const int y0 = std::min(static_cast<int>(y), std::max(0, height - 2));
  const int x1 = std::min(x0 + 1, width - 1);
  const int y1 = std::min(y0 + 1, height - 1);
  const auto pixel = [&](int column, int row) {
    return static_cast<double>(pixels[static_cast<std::size_t>(row) * width + column]);
  };
  const double u = x - x0;
  const double v = y - y0;
  return (1 - v) * ((1 - u) * pixel(x0, y0) + u * pixel(x1, y0)) +
         v * ((1 - u) * pixel(x0, y1) + u * pixel(x1, y1));
}

bool RefineCorners(const GreyView& picture, int cells, std::array<Eigen::Vector2d, 4>& corners_px) {
  constexpr int kRounds = 2;
  constexpr double kFarthestMove = 3;  // px; farther, and it was another edge
  std::array<Eigen::Vector2d, 4> corners = corners_px;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Vector2d inside = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
    std::array<Line, 4> lines;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::optional<Line> line =
          EdgeLine(picture, cells, corners[i], corners[(i + 1) % 4], inside);
      if (!line) return false;
      lines[i] = *line;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const std::optional<Eigen::Vector2d> corner = Intersection(lines[(i + 3) % 4], lines[i]);
      if (!corner || (*corner - corners_px[i]).norm() > kFarthestMove) return false;
      corners[i] = *corner;
    }
  }
  corners_px = corners;
  return true;
}

}  // namespace exemplar::perception
