#include "exemplar/perception/picture.hpp"

#include <algorithm>
#include <initializer_list>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

namespace exemplar::perception {
namespace {

/// JPEG or PNG by its first bytes, and not cut off by its last: the decoders would fill the rest of
/// a cut picture with grey.
bool EndsAsItBegan(std::span<const std::uint8_t> bytes) {
  const auto begins = [&](std::initializer_list<std::uint8_t> with) {
    return bytes.size() >= with.size() && std::equal(with.begin(), with.end(), bytes.begin());
  };
  const auto ends = [&](std::initializer_list<std::uint8_t> with) {
    return bytes.size() >= with.size() &&
           std::equal(with.begin(), with.end(),
                      bytes.end() - static_cast<std::ptrdiff_t>(with.size()));
  };
  if (begins({0xFF, 0xD8})) return ends({0xFF, 0xD9});
  if (begins({0x89, 'P', 'N', 'G'})) return ends({'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82});
  return false;
}

}  // namespace

Result<std::vector<std::uint8_t>> Encode(const Picture& picture, std::string_view encoding,
                                         int quality) {
  if (!picture.valid()) return InvalidArgument("picture: its bytes do not match its size");
  const bool jpeg = encoding == "jpeg";
  if (!jpeg && encoding != "png") {
    return InvalidArgument('"' + std::string(encoding) + "\" is no encoding; jpeg and png are",
                           "encoding");
  }
  if (jpeg && (quality < 1 || quality > 100)) {
    return InvalidArgument("jpeg quality is " + std::to_string(quality) + ", must be 1 to 100",
                           "quality");
  }
  const cv::Mat rgb(picture.height, picture.width, CV_8UC3,
                    const_cast<std::uint8_t*>(picture.rgb.data()));  // cv::Mat has no const view
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> bytes;
  const std::vector<int> how = jpeg ? std::vector<int>{cv::IMWRITE_JPEG_QUALITY, quality}
                                    : std::vector<int>{cv::IMWRITE_PNG_COMPRESSION, 3};
  if (!cv::imencode(jpeg ? ".jpg" : ".png", bgr, bytes, how)) {
    return Internal("picture could not be encoded as " + std::string(encoding));
  }
  return bytes;
}

Result<Picture> Decode(std::span<const std::uint8_t> bytes) {
  const std::string size = std::to_string(bytes.size()) + " bytes";
  if (bytes.empty()) return InvalidArgument("picture: " + size);
  if (!EndsAsItBegan(bytes)) {
    return InvalidArgument("picture of " + size + " is neither a whole JPEG nor a whole PNG");
  }
  cv::Mat bgr;
  try {
    const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1,
                      const_cast<std::uint8_t*>(bytes.data()));
    bgr = cv::imdecode(raw, cv::IMREAD_COLOR);
  } catch (const cv::Exception& e) {
    return InvalidArgument("picture of " + size + ": " + e.err);
  }
  if (bgr.empty()) return InvalidArgument("picture of " + size + " cannot be decoded");
  Picture picture{bgr.cols, bgr.rows, {}};
  picture.rgb.resize(3 * bgr.total());
  cv::Mat rgb(bgr.rows, bgr.cols, CV_8UC3, picture.rgb.data());
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return picture;
}

}  // namespace exemplar::perception
