#include "capture_suit/places.hpp"

#include <cmath>
#include <string>

#include "exemplar/base/text.hpp"

namespace exemplar::capture_suit {
namespace {

Result<geometry::Pose> ParsePlace(std::string_view text, const geometry::Pose& otherwise) {
  std::vector<double> numbers;
  for (const std::string_view word : Split(text, ',')) {
    const std::optional<double> number = ParseDouble(word);
    if (!number || !std::isfinite(*number)) {
      return InvalidArgument('"' + std::string(Trim(word)) + "\" is not a finite number", "places");
    }
    numbers.push_back(*number);
  }
  if (numbers.size() != 2 && numbers.size() != 3 && numbers.size() != 7) {
    return InvalidArgument("holds " + std::to_string(numbers.size()) +
                               " numbers, must be x,y or x,y,z or x,y,z,qx,qy,qz,qw",
                           "places");
  }
  geometry::Pose pose = otherwise;
  pose.translation.x() = numbers[0];
  pose.translation.y() = numbers[1];
  if (numbers.size() > 2) pose.translation.z() = numbers[2];
  if (numbers.size() == 7) {
    const Eigen::Quaterniond rotation(numbers[6], numbers[3], numbers[4], numbers[5]);
    if (std::abs(rotation.norm() - 1) > 1e-2) {
      return InvalidArgument(
          "its quaternion has length " + FormatDouble(rotation.norm()) + ", must be 1", "places");
    }
    pose.rotation = rotation.normalized();
  }
  return pose;
}

}  // namespace

Result<std::vector<geometry::Pose>> ParsePlaces(std::string_view text,
                                                const geometry::Pose& otherwise) {
  std::vector<geometry::Pose> places;
  for (const std::string_view word : Split(text, ';')) {
    if (Trim(word).empty()) continue;
    Result<geometry::Pose> place = ParsePlace(word, otherwise);
    if (!place) {
      return WithPlace(place.error(), "place " + std::to_string(places.size() + 1) + " (" +
                                          std::string(Trim(word)) + ")");
    }
    places.push_back(*place);
  }
  if (places.empty()) return InvalidArgument("there is no place", "places");
  return places;
}

}  // namespace exemplar::capture_suit
