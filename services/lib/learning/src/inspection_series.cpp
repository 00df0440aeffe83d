#include <cassert>

#include "exemplar/learning/inspection.hpp"
#include "exemplar/learning/segmentation.hpp"
#include "exemplar/learning/warp.hpp"

namespace exemplar::learning {

std::vector<UniformTrial> LengthNormalised(const Alignment& alignment) {
  std::vector<UniformTrial> trials;
  const std::vector<double> common{0, alignment.time_s.back()};
  for (const AlignedTrial& trial : alignment.trials) {
    const std::vector<double> own{0, trial.own.time_s.back()};
    trials.push_back(WarpTrial(trial.own, own, common, alignment.time_s));
  }
  return trials;
}

std::vector<Eigen::VectorXd> ToolMsv(const Alignment& alignment) {
  std::vector<Eigen::VectorXd> series;
  for (const AlignedTrial& trial : alignment.trials) {
    if (trial.own.base_T_tool.empty()) {
      series.push_back(MeanSquaredVelocity(trial.own));
      continue;
    }
    UniformTrial tool;
    tool.time_s = trial.own.time_s;
    tool.base_T_tool = trial.own.base_T_tool;
    tool.has_orientation = trial.own.has_orientation;
    tool.joints.resize(static_cast<Eigen::Index>(tool.time_s.size()), 0);
    series.push_back(MeanSquaredVelocity(tool));
  }
  return series;
}

Eigen::MatrixXd WarpSeries(const Alignment& alignment, const std::vector<Eigen::VectorXd>& own,
                           bool by_markers) {
  assert(own.size() == alignment.trials.size());
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(alignment.time_s.size()),
                          static_cast<Eigen::Index>(own.size()));
  for (std::size_t j = 0; j < own.size(); ++j) {
    const AlignedTrial& trial = alignment.trials[j];
    UniformTrial series;
    series.time_s = trial.own.time_s;
    series.joints = own[j];
    const std::vector<double> ends{0, trial.own.time_s.back()};
    const std::vector<double> common_ends{0, alignment.time_s.back()};
    columns.col(static_cast<Eigen::Index>(j)) =
        WarpTrial(series, by_markers ? trial.own_knots_s : ends,
                  by_markers ? alignment.knots_s : common_ends, alignment.time_s)
            .joints.col(0);
  }
  return columns;
}

}  // namespace exemplar::learning
