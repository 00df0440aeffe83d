#pragma once
// Pictures as values, and their compressed forms. OpenCV stays inside.

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::perception {

/// 8-bit red, green, blue; rows from the top, no padding: rgb.size() == 3 * width * height.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;

  bool valid() const {
    return width > 0 && height > 0 &&
           rgb.size() == 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
};

/// "jpeg" (lossy; `quality` 1 to 100) or "png" (exact; `quality` is not used), as
/// ircp::CameraSample::encoding names them.
Result<std::vector<std::uint8_t>> Encode(const Picture& picture, std::string_view encoding,
                                         int quality = 95);

/// Reads any encoding above, told apart by its bytes; grey pictures become three equal channels.
Result<Picture> Decode(std::span<const std::uint8_t> bytes);

}  // namespace exemplar::perception
