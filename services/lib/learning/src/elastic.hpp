#pragma once
// Elastic registration of curves: alignment=elastic.

#include <Eigen/Core>
#include <span>
#include <vector>

namespace exemplar::learning {

struct ElasticOptions {
  int cells = 120;  ///< of the grid in time
  /// What it costs to leave the even course, beside the distance of curves of length 1: constant
  /// stretches are passed evenly.
  double stiffness = 0.03;
  int iterations = 8;  ///< of the mean curve, at most
};

/// One warp of time a curve onto their common mean (Srivastava, Wu, Kurtek, Klassen & Marron 2011;
/// Srivastava, Klassen, Joshi & Jermyn 2011): curves are compared by their square-root velocity
/// functions, at whose distance a common warp changes nothing; each is warped onto the mean by
/// dynamic programming over slopes, and the mean is taken anew. Curves are scaled to length 1.
///
/// `curves`: samples x d, evenly spaced over the own time. The result has a row of cells + 1 values
/// a curve, at even steps of the mean's time: the part of the own time, from 0 to 1, strictly
/// increasing with slopes from 1/5 to 5 before smoothing; at each step their mean over the curves
/// is the step itself, to the grid. Precondition: at least one curve, each of two samples or more,
/// all finite and of one d.
std::vector<std::vector<double>> RegisterElastically(std::span<const Eigen::MatrixXd> curves,
                                                     const ElasticOptions& options = {});

}  // namespace exemplar::learning
