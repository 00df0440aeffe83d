#pragma once
// What the columns of a trial's CSV mean, from their names (DESIGN.md "Trials as files").

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::demonstration {

/// Column numbers of one frame's pose: x y z qx qy qz qw; -1 where there is none.
struct PoseColumns {
  std::string name;
  std::array<int, 7> columns{-1, -1, -1, -1, -1, -1, -1};
  bool has_orientation() const { return columns[3] >= 0; }
};

struct ScalarColumns {
  std::vector<std::string> names;
  std::vector<int> columns;
};

/// Column numbers of everything a trial holds.
struct CsvLayout {
  int time = -1;
  std::vector<PoseColumns> end_effectors;
  std::vector<PoseColumns> objects;
  ScalarColumns joints;
  std::vector<std::string> prismatic_joints;
  ScalarColumns measured_joints;
  ScalarColumns hands;
  ScalarColumns tactile;
  ScalarColumns wrench;  ///< none, three forces, or all six
  ScalarColumns label;
  std::vector<std::string> notices;  ///< columns that are ignored
};

/// Names of the pose components in the order of PoseColumns: "x_m", ..., "qw".
std::span<const std::string_view> PoseComponents();

/// Fails on a missing time column, on groups that lack a column, on names that stand twice, and on
/// columns of the format whose unit is missing or another one: those would be lost without a word.
/// Other columns are ignored with a notice.
Result<CsvLayout> ReadCsvLayout(std::span<const std::string> names, std::string_view source,
                                std::size_t header_line);

}  // namespace exemplar::demonstration
