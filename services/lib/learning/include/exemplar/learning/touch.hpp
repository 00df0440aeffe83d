#pragma once
#include <Eigen/Core>
#include <vector>

namespace exemplar::learning {

/// Frames [first, last] in which something is touched.
struct Touch {
  int first = 0;
  int last = 0;
  double peak_n = 0;
  bool begins = true;  ///< false: the recording starts within it
  bool ends = true;    ///< false: the recording ends within it
};

/// Stretches of touch in a force above rest (N, one a frame). The threshold comes from the data:
/// the noise of the resting part, and a small part of the largest force; a touch ends at half of
/// it. Empty when nothing stands out.
std::vector<Touch> FindTouches(const Eigen::Ref<const Eigen::VectorXd>& touch_n);

}  // namespace exemplar::learning
