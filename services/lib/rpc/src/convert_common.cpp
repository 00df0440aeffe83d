#include "convert_common.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace exemplar::rpc {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Length of the UTF-8 character at the start of `text`, 0 if there is none.
std::size_t CharacterLength(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 && first <= 0xf4   ? 4
                             : first >= 0xe0 && first <= 0xef ? 3
                             : first >= 0xc2 && first <= 0xdf ? 2
                                                              : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  const unsigned char second = byte(1);
  const bool overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
  const bool surrogate = first == 0xed && second >= 0xa0;
  const bool beyond = first == 0xf4 && second >= 0x90;
  return overlong || surrogate || beyond ? 0 : length;
}

std::string Indexed(std::string_view field, int index) {
  return std::string(field) + "[" + std::to_string(index) + "]";
}

/// Makes `message` hold `size` values, to be written by the caller: Resize would write zeros first.
double* Room(std::size_t size, PackedDoubles* message) {
  message->Clear();
  message->Reserve(static_cast<int>(size));
  return message->AddNAlreadyReserved(static_cast<int>(size));
}

constexpr double kSmallestQuaternionNorm = 1e-6;

}  // namespace

std::string Utf8(std::string_view text) { return Utf8(text, text.size()); }

std::string Utf8(std::string_view text, std::size_t bytes) {
  std::string out;
  out.reserve(std::min(text.size(), bytes));
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = CharacterLength(text.substr(i));
    const std::string_view character = length == 0 ? "?" : text.substr(i, length);
    if (out.size() + character.size() > bytes) break;
    out += character;
    i += length == 0 ? 1 : length;
  }
  return out;
}

void ToProto(const std::vector<double>& values, PackedDoubles* message) {
  if (values.empty()) return message->Clear();
  std::memcpy(Room(values.size(), message), values.data(), values.size() * sizeof(double));
}

void ToProto(const Eigen::Ref<const Eigen::VectorXd>& values, PackedDoubles* message) {
  if (values.size() == 0) return message->Clear();
  std::memcpy(Room(static_cast<std::size_t>(values.size()), message), values.data(),
              static_cast<std::size_t>(values.size()) * sizeof(double));
}

void MatrixToProto(const Eigen::MatrixXd& matrix, PackedDoubles* message) {
  if (matrix.size() == 0) return message->Clear();
  double* const room = Room(static_cast<std::size_t>(matrix.size()), message);
  Eigen::Map<RowMajor>(room, matrix.rows(), matrix.cols()) = matrix;
}

void PosesToProto(const std::vector<geometry::Pose>& poses, PackedDoubles* message) {
  if (poses.empty()) return message->Clear();
  double* to = Room(7 * poses.size(), message);
  for (const geometry::Pose& pose : poses) {
    to = std::copy_n(pose.translation.data(), 3, to);
    to = std::copy_n(pose.rotation.coeffs().data(), 4, to);
  }
}

void ToProto(const std::vector<std::string>& texts, Strings* message) {
  message->Reserve(static_cast<int>(texts.size()));
  for (const std::string& text : texts) *message->Add() = Utf8(text);
}

std::vector<double> FromProto(const PackedDoubles& message) {
  return {message.begin(), message.end()};
}

Eigen::VectorXd VectorFromProto(const PackedDoubles& message) {
  return Eigen::Map<const Eigen::VectorXd>(message.data(), message.size());
}

std::vector<std::string> FromProto(const Strings& message) {
  return {message.begin(), message.end()};
}

Result<Eigen::MatrixXd> MatrixFromProto(const PackedDoubles& message, std::size_t rows,
                                        std::size_t columns, std::string_view field) {
  if (static_cast<std::size_t>(message.size()) != rows * columns) {
    return InvalidArgument(std::string(field) + " holds " + std::to_string(message.size()) +
                               " numbers, must be " + std::to_string(rows) + " x " +
                               std::to_string(columns),
                           std::string(field));
  }
  return Eigen::MatrixXd(Eigen::Map<const RowMajor>(message.data(), static_cast<Eigen::Index>(rows),
                                                    static_cast<Eigen::Index>(columns)));
}

Result<std::vector<geometry::Pose>> PosesFromProto(const PackedDoubles& message,
                                                   std::string_view field) {
  if (message.size() % 7 != 0) {
    return InvalidArgument(std::string(field) + " holds " + std::to_string(message.size()) +
                               " numbers, must be 7 a pose",
                           std::string(field));
  }
  std::vector<geometry::Pose> poses(static_cast<std::size_t>(message.size()) / 7);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double* in = message.data() + 7 * i;
    const Eigen::Map<const Eigen::Matrix<double, 7, 1>> numbers(in);
    const double norm = numbers.tail<4>().norm();
    if (!numbers.allFinite() || norm < kSmallestQuaternionNorm) {
      const std::string place = Indexed(field, static_cast<int>(i));
      return InvalidArgument(
          place + ": " +
              (numbers.allFinite() ? "the quaternion is zero" : "a number is not finite"),
          place);
    }
    poses[i].translation = numbers.head<3>();
    poses[i].rotation.coeffs() = numbers.tail<4>() / (std::abs(norm - 1) < 1e-12 ? 1.0 : norm);
  }
  return poses;
}

void ToProto(Stamp stamp, google::protobuf::Timestamp* message) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  std::int64_t seconds = stamp.nanoseconds() / kSecond;
  std::int64_t rest = stamp.nanoseconds() % kSecond;
  if (rest < 0) {
    rest += kSecond;
    --seconds;
  }
  message->set_seconds(seconds);
  message->set_nanos(static_cast<std::int32_t>(rest));
}

Stamp FromProto(const google::protobuf::Timestamp& message) {
  constexpr std::int64_t kLargest = 9'000'000'000;
  const std::int64_t seconds = std::clamp(message.seconds(), -kLargest, kLargest);
  return Stamp::FromNanoseconds(seconds * 1'000'000'000 + message.nanos());
}

void ToProto(const Eigen::Vector3d& vector, v1::Vector3* message) {
  message->set_x(vector.x());
  message->set_y(vector.y());
  message->set_z(vector.z());
}

Eigen::Vector3d FromProto(const v1::Vector3& message) {
  return {message.x(), message.y(), message.z()};
}

void ToProto(const geometry::Pose& pose, bool has_orientation, v1::Pose* message) {
  ToProto(pose.translation, message->mutable_position());
  if (!has_orientation) return;
  v1::Quaternion* rotation = message->mutable_rotation();
  rotation->set_x(pose.rotation.x());
  rotation->set_y(pose.rotation.y());
  rotation->set_z(pose.rotation.z());
  rotation->set_w(pose.rotation.w());
}

Result<ReadPose> FromProto(const v1::Pose& message, std::string_view field) {
  const std::string place(field);
  if (!message.has_position()) {
    return InvalidArgument(place + ".position is missing", place + ".position");
  }
  ReadPose read;
  read.pose.translation = FromProto(message.position());
  if (!read.pose.translation.allFinite()) {
    return InvalidArgument(place + ".position is not finite", place + ".position");
  }
  if (!message.has_rotation()) return read;
  const v1::Quaternion& q = message.rotation();
  const Eigen::Vector4d numbers(q.x(), q.y(), q.z(), q.w());
  const double norm = numbers.norm();
  if (!numbers.allFinite() || norm < kSmallestQuaternionNorm) {
    return InvalidArgument(
        place + ".rotation is " +
            (numbers.allFinite() ? "zero, must be a unit quaternion" : "not finite"),
        place + ".rotation");
  }
  // A quaternion that is of unit length up to rounding keeps its bits.
  read.pose.rotation.coeffs() = numbers / (std::abs(norm - 1) < 1e-12 ? 1.0 : norm);
  read.has_orientation = true;
  return read;
}

void ToProto(const geometry::NamedPose& pose, v1::NamedPose* message) {
  message->set_name(Utf8(pose.name));
  ToProto(pose.base_T_object, pose.has_orientation, message->mutable_pose());
}

Result<geometry::NamedPose> FromProto(const v1::NamedPose& message, std::string_view field) {
  const std::string place(field);
  if (message.name().empty()) return InvalidArgument(place + ".name is empty", place + ".name");
  Result<ReadPose> read = FromProto(message.pose(), place + ".pose");
  if (!read) return read.error();
  return geometry::NamedPose{message.name(), read->pose, read->has_orientation};
}

void ToProto(const std::vector<geometry::NamedPose>& poses,
             google::protobuf::RepeatedPtrField<v1::NamedPose>* message) {
  for (const geometry::NamedPose& pose : poses) ToProto(pose, message->Add());
}

Result<std::vector<geometry::NamedPose>> FromProto(
    const google::protobuf::RepeatedPtrField<v1::NamedPose>& message, std::string_view field) {
  std::vector<geometry::NamedPose> poses;
  for (int i = 0; i < message.size(); ++i) {
    Result<geometry::NamedPose> pose = FromProto(message[i], Indexed(field, i));
    if (!pose) return pose.error();
    poses.push_back(*std::move(pose));
  }
  return poses;
}

void ToProto(const demonstration::ScalarSeries& series, v1::ScalarSeries* message) {
  ToProto(series.names, message->mutable_names());
  ToProto(series.time_s, message->mutable_time_s());
  MatrixToProto(series.values, message->mutable_values());
}

Result<demonstration::ScalarSeries> FromProto(const v1::ScalarSeries& message,
                                              std::string_view field) {
  demonstration::ScalarSeries series;
  series.names = FromProto(message.names());
  series.time_s = FromProto(message.time_s());
  Result<Eigen::MatrixXd> values = MatrixFromProto(
      message.values(), series.time_s.size(), series.names.size(), std::string(field) + ".values");
  if (!values) return values.error();
  series.values = *std::move(values);
  return series;
}

void ToProto(const demonstration::PoseSeries& series, v1::PoseSeries* message) {
  message->set_name(Utf8(series.name));
  ToProto(series.time_s, message->mutable_time_s());
  PosesToProto(series.base_T_frame, message->mutable_poses());
  message->set_has_orientation(series.has_orientation);
}

Result<demonstration::PoseSeries> FromProto(const v1::PoseSeries& message, std::string_view field) {
  const std::string place = std::string(field) + ".poses";
  Result<std::vector<geometry::Pose>> poses = PosesFromProto(message.poses(), place);
  if (!poses) return poses.error();
  if (poses->size() != static_cast<std::size_t>(message.time_s_size())) {
    return InvalidArgument(place + " holds " + std::to_string(poses->size()) + " poses for " +
                               std::to_string(message.time_s_size()) + " times",
                           place);
  }
  demonstration::PoseSeries series;
  series.name = message.name();
  series.time_s = FromProto(message.time_s());
  series.base_T_frame = *std::move(poses);
  series.has_orientation = message.has_orientation();
  return series;
}

void ToProto(const Error& error, v1::ErrorDetail* message) {
  // Trailers are limited to 8 KiB, and the message travels in them twice.
  constexpr std::size_t kMostMessage = 1200;
  constexpr std::size_t kMostField = 300;
  message->set_code(std::string(ToString(error.code)));
  message->set_field(Utf8(error.field, kMostField));
  message->set_message(Utf8(error.message, kMostMessage));
}

Error FromProto(const v1::ErrorDetail& message) {
  return {ParseErrorCode(message.code()).value_or(ErrorCode::kInternal), message.message(),
          message.field()};
}

}  // namespace exemplar::rpc
