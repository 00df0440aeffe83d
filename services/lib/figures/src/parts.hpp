#pragma once
// What several figures share.

#include <string>
#include <vector>

#include "exemplar/figures/figures.hpp"
#include "exemplar/figures/plot.hpp"

namespace exemplar::figures {

/// The picture of a figure that this skill cannot have.
Figure CannotDraw(int number, const std::string& title, const std::string& why);

/// "Fig. 4  A plain mean loses the trials' extremes".
std::string Heading(int number, const std::string& title);

/// The trials that a figure of three shows.
std::vector<std::size_t> ShownTrials(const learning::Alignment& alignment, std::size_t most);

/// A trial's name, short enough for a title of a panel `width` px wide.
std::string TrialName(const Subject& subject, std::size_t trial, double width);

/// The common time base as part of the duration, 0 to 1.
std::vector<double> CommonParts(const learning::Alignment& alignment);

/// A row of a 3D path.
Eigen::Vector3d RowOf(const Eigen::MatrixXd& path, int row);

/// Positions of poses, rows.
Eigen::MatrixXd PositionsOf(const std::vector<geometry::Pose>& poses);

}  // namespace exemplar::figures
