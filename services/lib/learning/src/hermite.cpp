#include "exemplar/learning/hermite.hpp"

#include <cassert>
#include <cmath>

#include "exemplar/signal/resample.hpp"

namespace exemplar::learning {

std::vector<double> MonotoneTangents(std::span<const double> x, std::span<const double> y) {
  assert(x.size() >= 2 && x.size() == y.size());
  const std::size_t last = x.size() - 1;
  std::vector<double> slope(last);
  for (std::size_t k = 0; k < last; ++k) slope[k] = (y[k + 1] - y[k]) / (x[k + 1] - x[k]);
  std::vector<double> tangent(last + 1);
  tangent[0] = slope[0];
  tangent[last] = slope[last - 1];
  for (std::size_t k = 1; k < last; ++k) tangent[k] = (slope[k - 1] + slope[k]) / 2;
  for (std::size_t k = 0; k < last; ++k) {
    if (slope[k] == 0) {
      tangent[k] = tangent[k + 1] = 0;
      continue;
    }
    const double a = tangent[k] / slope[k];
    const double b = tangent[k + 1] / slope[k];
    const double squared = a * a + b * b;
    if (squared > 9) {
      const double scale = 3 * slope[k] / std::sqrt(squared);
      tangent[k] = scale * a;
      tangent[k + 1] = scale * b;
    }
  }
  return tangent;
}

MonotoneHermite::MonotoneHermite(std::vector<double> x, std::vector<double> y)
    : x_(std::move(x)), y_(std::move(y)), tangents_(MonotoneTangents(x_, y_)) {}

double MonotoneHermite::operator()(double x) const {
  const signal::Place place = signal::Locate(x_, x);
  const std::size_t k = place.index;
  return HermiteValue(y_[k], y_[k + 1], tangents_[k], tangents_[k + 1], x_[k + 1] - x_[k],
                      place.part);
}

}  // namespace exemplar::learning
