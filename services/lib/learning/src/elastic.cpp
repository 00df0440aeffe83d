#include "elastic.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "exemplar/signal/resample.hpp"
#include "exemplar/signal/statistics.hpp"

namespace exemplar::learning {
namespace {

constexpr int kSteepest = 5;
// What is slower than this quantile of the speeds is rest, if it is also below this part of the
// highest one.
constexpr double kRestQuantile = 0.1;
constexpr double kRestPart = 0.03;
// The mean has come to rest when it moves by less than this part of itself.
constexpr double kSettled = 1e-4;
// Neighbours to each side over which a warp is averaged: dynamic programming knows few slopes.
constexpr int kSmoothed = 3;

using Warp = std::vector<double>;  // own time, 0 to 1, at the grid's nodes

// A curve by its points, and what it is compared by.
class Curve {
 public:
  explicit Curve(const Eigen::MatrixXd& samples) : points_(samples) {
    const Eigen::Index cells = samples.rows() - 1;
    const Eigen::MatrixXd steps = samples.bottomRows(cells) - samples.topRows(cells);
    const Eigen::VectorXd lengths = steps.rowwise().norm();
    // The sensors' noise moves a curve that rests.
    const double rest =
        std::min(signal::Quantile(lengths, kRestQuantile), kRestPart * lengths.maxCoeff());
    double whole = 0;
    for (Eigen::Index k = 0; k < cells; ++k) {
      const double left = std::max(0.0, lengths[k] - rest);
      points_.row(k + 1) = points_.row(k);
      if (left > 0) points_.row(k + 1) += left / lengths[k] * steps.row(k);
      whole += left;
    }
    if (whole > 0) points_ /= whole;
  }

  /// d x cells: the square-root velocity function of the curve after the warp.
  Eigen::MatrixXd RootVelocity(const Warp& warp) const {
    const auto cells = static_cast<Eigen::Index>(warp.size()) - 1;
    Eigen::MatrixXd q(points_.cols(), cells);
    Eigen::VectorXd before = At(warp[0]);
    for (Eigen::Index k = 0; k < cells; ++k) {
      const Eigen::VectorXd after = At(warp[static_cast<std::size_t>(k) + 1]);
      const Eigen::VectorXd velocity = (after - before) * static_cast<double>(cells);
      const double speed = velocity.norm();
      q.col(k) = speed > 0 ? (velocity / std::sqrt(speed)).eval()
                           : Eigen::VectorXd::Zero(points_.cols()).eval();
      before = after;
    }
    return q;
  }

 private:
  Eigen::VectorXd At(double part) const {
    const double place = std::clamp(part, 0.0, 1.0) * static_cast<double>(points_.rows() - 1);
    const Eigen::Index k =
        std::min(static_cast<Eigen::Index>(std::floor(place)), points_.rows() - 2);
    const double s = place - static_cast<double>(k);
    return ((1 - s) * points_.row(k) + s * points_.row(k + 1)).transpose();
  }

  Eigen::MatrixXd points_;
};

// A straight piece of a warp: `over` cells of the mean's time, `up` of the own one, and the cells
// that it passes together.
struct Slope {
  int over = 1;
  int up = 1;
  double rate = 1;  // up / over
  struct Piece {
    int mean = 0;
    int own = 0;
    double width = 0;  // in cells of the mean's time
  };
  std::vector<Piece> pieces;
};

std::vector<Slope> AllSlopes() {
  std::vector<Slope> slopes;
  for (int over = 1; over <= kSteepest; ++over) {
    for (int up = 1; up <= kSteepest; ++up) {
      if (std::gcd(over, up) != 1) continue;
      Slope slope{over, up, static_cast<double>(up) / over, {}};
      // Ends of cells along the way, in units of 1 / (over * up).
      for (int at = 0; at < over * up;) {
        const int mean = at / up;
        const int own = at / over;
        const int next = std::min((mean + 1) * up, (own + 1) * over);
        slope.pieces.push_back({mean, own, static_cast<double>(next - at) / up});
        at = next;
      }
      slopes.push_back(std::move(slope));
    }
  }
  return slopes;
}

// The warp of least distance between two root velocity functions, by dynamic programming over all
// polygons of the grid whose pieces have one of the slopes.
Warp Match(const Eigen::MatrixXd& mean, const Eigen::MatrixXd& own, double stiffness) {
  static const std::vector<Slope> slopes = AllSlopes();
  const auto cells = static_cast<int>(mean.cols());
  const Eigen::MatrixXd products = mean.transpose() * own;
  const Eigen::VectorXd mean_squares = mean.colwise().squaredNorm();
  const Eigen::VectorXd own_squares = own.colwise().squaredNorm();
  constexpr double kNever = std::numeric_limits<double>::infinity();
  Eigen::MatrixXd least = Eigen::MatrixXd::Constant(cells + 1, cells + 1, kNever);
  Eigen::MatrixXi by = Eigen::MatrixXi::Constant(cells + 1, cells + 1, -1);
  least(0, 0) = 0;
  for (int j = 1; j <= cells; ++j) {
    for (int i = 1; i <= cells; ++i) {
      for (std::size_t s = 0; s < slopes.size(); ++s) {
        const Slope& slope = slopes[s];
        const int i0 = i - slope.over;
        const int j0 = j - slope.up;
        if (i0 < 0 || j0 < 0 || least(i0, j0) == kNever) continue;
        const double root = std::sqrt(slope.rate);
        double cost = stiffness * slope.over * (1 - root) * (1 - root);
        for (const Slope::Piece& piece : slope.pieces) {
          cost += piece.width *
                  (mean_squares[i0 + piece.mean] + slope.rate * own_squares[j0 + piece.own] -
                   2 * root * products(i0 + piece.mean, j0 + piece.own));
        }
        const double total = least(i0, j0) + cost / cells;
        if (total < least(i, j)) {
          least(i, j) = total;
          by(i, j) = static_cast<int>(s);
        }
      }
    }
  }
  Warp warp(static_cast<std::size_t>(cells) + 1, 0.0);
  for (int i = cells, j = cells; i > 0;) {
    const Slope& slope = slopes[static_cast<std::size_t>(by(i, j))];
    for (int k = 0; k < slope.over; ++k) {
      warp[static_cast<std::size_t>(i - k)] = (j - k * slope.rate) / cells;
    }
    i -= slope.over;
    j -= slope.up;
  }
  return warp;
}

// Means over neighbours to both sides, as many as there are: keeps the ends and the order.
Warp Smoothed(const Warp& warp) {
  Warp smooth(warp.size());
  const auto last = static_cast<int>(warp.size()) - 1;
  for (int k = 0; k <= last; ++k) {
    const int half = std::min({kSmoothed, k, last - k});
    for (int i = k - half; i <= k + half; ++i) {
      smooth[static_cast<std::size_t>(k)] += warp[static_cast<std::size_t>(i)] / (2 * half + 1);
    }
  }
  smooth.front() = 0;
  smooth.back() = 1;
  return smooth;
}

Warp Identity(int cells) {
  Warp warp;
  for (int k = 0; k <= cells; ++k) warp.push_back(static_cast<double>(k) / cells);
  return warp;
}

// All after the inverse of their mean, which is the identity then.
void Centre(std::vector<Warp>& warps) {
  const std::size_t nodes = warps.front().size();
  const Warp even = Identity(static_cast<int>(nodes) - 1);
  Warp mean(nodes, 0.0);
  for (const Warp& warp : warps) {
    for (std::size_t k = 0; k < nodes; ++k) mean[k] += warp[k] / static_cast<double>(warps.size());
  }
  for (Warp& warp : warps) {
    Warp centred = even;
    for (std::size_t k = 1; k + 1 < nodes; ++k) {
      const signal::Place place = signal::Locate(mean, even[k]);
      centred[k] = warp[place.index] + place.part * (warp[place.index + 1] - warp[place.index]);
    }
    warp = std::move(centred);
  }
}

}  // namespace

std::vector<std::vector<double>> RegisterElastically(std::span<const Eigen::MatrixXd> samples,
                                                     const ElasticOptions& options) {
  std::vector<Curve> curves;
  std::vector<Eigen::MatrixXd> own;
  const Warp even = Identity(options.cells);
  for (const Eigen::MatrixXd& curve : samples) {
    curves.emplace_back(curve);
    own.push_back(curves.back().RootVelocity(even));
  }
  std::vector<Warp> warps(curves.size(), even);
  if (curves.size() < 2) return warps;
  // Begun with the curve that is nearest to all others: a mean of curves out of step has lost what
  // they are matched by.
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < own.size(); ++k) {
    double sum = 0;
    for (const Eigen::MatrixXd& other : own) sum += (own[k] - other).squaredNorm();
    if (sum < least) {
      least = sum;
      nearest = k;
    }
  }
  Eigen::MatrixXd mean = own[nearest];
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    for (std::size_t k = 0; k < own.size(); ++k) {
      warps[k] = Smoothed(Match(mean, own[k], options.stiffness));
    }
    Centre(warps);
    Eigen::MatrixXd next = Eigen::MatrixXd::Zero(mean.rows(), mean.cols());
    for (std::size_t k = 0; k < own.size(); ++k) {
      next += curves[k].RootVelocity(warps[k]) / static_cast<double>(own.size());
    }
    const double moved = (next - mean).squaredNorm();
    mean = std::move(next);
    if (moved <= kSettled * mean.squaredNorm()) break;
  }
  return warps;
}

}  // namespace exemplar::learning
