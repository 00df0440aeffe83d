#include "exemplar/perception/picture.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

namespace exemplar::perception {

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
  cv::Mat bgr;
  try {
    const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1,
                      const_cast<std::uint8_t*>(bytes.data()));
    bgr = cv::imdecode(raw, cv::IMREAD_COLOR);
  } catch (const cv::Exception& e) {
    return InvalidArgument("picture of " + size + ": " + e.err);
  }
  if (bgr.empty()) return InvalidArgument("picture of " + size + " is neither JPEG nor PNG");
  Picture picture{bgr.cols, bgr.rows, {}};
  picture.rgb.resize(3 * bgr.total());
  cv::Mat rgb(bgr.rows, bgr.cols, CV_8UC3, picture.rgb.data());
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return picture;
}

}  // namespace exemplar::perception
