#include "points_file.hpp"

#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

#include "exemplar/base/text.hpp"

namespace exemplar::scene {
namespace {

constexpr std::size_t kMaxPoints = 5'000'000;

}  // namespace

Result<std::vector<Eigen::Vector3d>> ParsePoints(std::string_view text, std::string_view source) {
  std::vector<Eigen::Vector3d> points;
  std::size_t number = 0;
  for (std::string_view line : Split(text, '\n')) {
    ++number;
    line = Trim(line);
    if (line.empty() || line.front() == '#') continue;
    Eigen::Vector3d p;
    int read = 0;
    for (const std::string_view word : Split(line, ' ')) {
      if (read == 3) break;
      if (Trim(word).empty()) continue;
      const std::optional<double> value = ParseDouble(word);
      if (!value || !std::isfinite(*value)) break;
      p[read++] = *value;
    }
    if (read != 3) {
      return InvalidArgument(std::string(source) + ":" + std::to_string(number) + ": \"" +
                             std::string(line.substr(0, 60)) +
                             "\" does not begin with three finite numbers");
    }
    if (points.size() == kMaxPoints) {
      return InvalidArgument(std::string(source) + ":" + std::to_string(number) +
                             ": the cloud has more than " + std::to_string(kMaxPoints) + " points");
    }
    points.push_back(p);
  }
  if (points.empty()) return InvalidArgument(std::string(source) + ": the cloud has no points");
  return points;
}

Result<std::vector<Eigen::Vector3d>> ReadPoints(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return NotFound(file.string() + ": cannot be read");
  std::ostringstream text;
  text << in.rdbuf();
  if (in.bad()) return InvalidArgument(file.string() + ": cannot be read");
  return ParsePoints(text.str(), file.string());
}

}  // namespace exemplar::scene
