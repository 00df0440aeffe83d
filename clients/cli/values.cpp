#include "values.hpp"

#include <cmath>

#include "exemplar/base/text.hpp"

namespace exemplar::cli {
namespace {

Result<std::vector<double>> ParseNumbers(std::string_view text, std::string_view option) {
  std::vector<double> numbers;
  for (const std::string_view word : Split(text, ',')) {
    const std::optional<double> number = ParseDouble(word);
    if (!number || !std::isfinite(*number)) {
      return InvalidArgument(std::string(option) + " " + std::string(text) + ": \"" +
                                 std::string(Trim(word)) + "\" is not a number",
                             std::string(option));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace

Result<ReadPose> ParsePose(std::string_view text, std::string_view option) {
  const Result<std::vector<double>> numbers = ParseNumbers(text, option);
  if (!numbers) return numbers.error();
  if (numbers->size() != 3 && numbers->size() != 7) {
    return InvalidArgument(std::string(option) + " " + std::string(text) + ": " +
                               std::to_string(numbers->size()) +
                               " numbers, must be x,y,z or x,y,z,qx,qy,qz,qw",
                           std::string(option));
  }
  const std::vector<double>& n = *numbers;
  ReadPose read;
  read.pose.translation = {n[0], n[1], n[2]};
  if (n.size() == 3) return read;
  const Eigen::Vector4d quaternion(n[3], n[4], n[5], n[6]);
  constexpr double kSmallest = 1e-6;
  if (quaternion.norm() < kSmallest) {
    return InvalidArgument(
        std::string(option) + " " + std::string(text) + ": the quaternion is zero",
        std::string(option));
  }
  read.pose.rotation.coeffs() = quaternion.normalized();
  read.has_orientation = true;
  return read;
}

Result<std::vector<geometry::NamedPose>> ParseObjects(const std::vector<std::string>& words) {
  std::vector<geometry::NamedPose> objects;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0) {
      return InvalidArgument("--object " + word + ": must be NAME=x,y,z[,qx,qy,qz,qw]", "--object");
    }
    const std::string name = word.substr(0, equals);
    for (const geometry::NamedPose& other : objects) {
      if (other.name == name) {
        std::string message = "--object " + word;
        message += ": \"" + name + "\" is given twice";
        return InvalidArgument(std::move(message), "--object");
      }
    }
    const Result<ReadPose> read =
        ParsePose(std::string_view(word).substr(equals + 1), "--object " + name);
    if (!read) return read.error();
    objects.push_back({name, read->pose, read->has_orientation});
  }
  return objects;
}

Status ParseJointStart(std::string_view text, demonstration::SkillQuery& query) {
  constexpr std::string_view kOption = "--joint-start";
  std::string values;
  const bool named = text.find('=') != std::string_view::npos;
  for (const std::string_view word : Split(text, ',')) {
    const std::size_t equals = word.find('=');
    if ((equals != std::string_view::npos) != named || (named && equals == 0)) {
      return InvalidArgument(
          std::string(kOption) + " " + std::string(text) + ": must be 1,2,3 or NAME=1,NAME=2",
          std::string(kOption));
    }
    if (named) query.joint_start_names.emplace_back(Trim(word.substr(0, equals)));
    if (!values.empty()) values += ',';
    values += named ? word.substr(equals + 1) : word;
  }
  const Result<std::vector<double>> numbers = ParseNumbers(values, kOption);
  if (!numbers) return numbers.error();
  query.joint_start = Eigen::Map<const Eigen::VectorXd>(numbers->data(),
                                                        static_cast<Eigen::Index>(numbers->size()));
  return {};
}

Result<std::map<std::string, std::string>> ParsePairs(const std::vector<std::string>& words,
                                                      std::string_view option) {
  std::map<std::string, std::string> pairs;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0) {
      return InvalidArgument(std::string(option) + " " + word + ": must be name=value",
                             std::string(option));
    }
    if (!pairs.emplace(word.substr(0, equals), word.substr(equals + 1)).second) {
      return InvalidArgument(
          std::string(option) + " " + word + ": " + word.substr(0, equals) + " is given twice",
          std::string(option));
    }
  }
  return pairs;
}

std::string PoseText(const geometry::Pose& pose, bool has_orientation) {
  constexpr int kDecimals = 4;
  std::string text;
  for (int i = 0; i < 3; ++i) {
    text += (i ? " " : "") + FormatFixed(pose.translation[i], kDecimals);
  }
  if (!has_orientation) return text + " (no orientation)";
  text += "  q";
  for (int i = 0; i < 4; ++i) text += " " + FormatFixed(pose.rotation.coeffs()[i], kDecimals);
  return text;
}

std::string TimeText(Stamp stamp) {
  std::string text = ToIso8601(stamp);
  const std::size_t fraction = text.find('.');
  if (fraction != std::string::npos) text = text.substr(0, fraction) + "Z";
  const std::size_t t = text.find('T');
  if (t != std::string::npos) text[t] = ' ';
  return text;
}

}  // namespace exemplar::cli
