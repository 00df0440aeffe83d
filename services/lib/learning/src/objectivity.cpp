#include "exemplar/learning/objectivity.hpp"

#include <cassert>

namespace exemplar::learning {

Eigen::VectorXd PathVariance(std::span<const Eigen::MatrixXd> paths) {
  assert(!paths.empty());
  const double n = static_cast<double>(paths.size());
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(paths[0].rows(), paths[0].cols());
  for (const Eigen::MatrixXd& path : paths) mean += path / n;
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(mean.rows());
  for (const Eigen::MatrixXd& path : paths) {
    variance += (path - mean).rowwise().squaredNorm() / n;
  }
  return variance;
}

Objectivity ComputeObjectivity(std::span<const Eigen::MatrixXd> base_paths,
                               std::span<const Eigen::MatrixXd> object_paths,
                               std::optional<int> first_contact) {
  assert(base_paths.size() == object_paths.size());
  Objectivity result;
  result.absolute_variance = PathVariance(base_paths);
  result.object_variance = PathVariance(object_paths);
  const Eigen::Index frames = result.absolute_variance.size();
  result.upsilon.resize(frames);
  for (Eigen::Index i = 0; i < frames; ++i) {
    const double sum = result.absolute_variance[i] + result.object_variance[i];
    // Below this both are rounding: 1 nm.
    if (base_paths.size() == 1 || sum < 1e-18) {
      result.undefined = true;
      result.upsilon[i] = first_contact.has_value() && i >= *first_contact ? 1.0 : 0.0;
    } else {
      result.upsilon[i] = result.absolute_variance[i] / sum;
    }
  }
  return result;
}

}  // namespace exemplar::learning
