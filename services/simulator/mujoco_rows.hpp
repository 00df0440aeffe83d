#pragma once
#include <cstddef>

namespace exemplar::simulator {

/// Row `index` of one of MuJoCo's tables with `width` columns.
template <class Number>
Number* Row(Number* table, int width, int index) {
  return table + static_cast<std::ptrdiff_t>(width) * index;
}

}  // namespace exemplar::simulator
