#pragma once
// Values to messages and back. FromProto checks what the type of a message cannot say (shapes,
// finite numbers, quaternions that are rotations) and names the field.

#include <google/protobuf/repeated_field.h>
#include <google/protobuf/timestamp.pb.h>

#include <Eigen/Core>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"
#include "exemplar/demonstration/trial.hpp"
#include "exemplar/geometry/pose.hpp"
#include "exemplar/v1/common.pb.h"

namespace exemplar::rpc {

using PackedDoubles = google::protobuf::RepeatedField<double>;
using Strings = google::protobuf::RepeatedPtrField<std::string>;

/// `text` with every byte that is not UTF-8 as "?": a message with other bytes cannot be read.
std::string Utf8(std::string_view text);
/// The same, cut to at most `bytes` on a character's border.
std::string Utf8(std::string_view text, std::size_t bytes);

void ToProto(const std::vector<double>& values, PackedDoubles* message);
void ToProto(const Eigen::Ref<const Eigen::VectorXd>& values, PackedDoubles* message);
/// Row-major.
void MatrixToProto(const Eigen::MatrixXd& matrix, PackedDoubles* message);
/// x y z qx qy qz qw, one a pose.
void PosesToProto(const std::vector<geometry::Pose>& poses, PackedDoubles* message);
void ToProto(const std::vector<std::string>& texts, Strings* message);

std::vector<double> FromProto(const PackedDoubles& message);
Eigen::VectorXd VectorFromProto(const PackedDoubles& message);
std::vector<std::string> FromProto(const Strings& message);
/// Error unless the message holds rows x columns numbers.
Result<Eigen::MatrixXd> MatrixFromProto(const PackedDoubles& message, std::size_t rows,
                                        std::size_t columns, std::string_view field);
/// Error unless it holds 7 numbers a pose, all finite, with quaternions that can be normalised.
Result<std::vector<geometry::Pose>> PosesFromProto(const PackedDoubles& message,
                                                   std::string_view field);

void ToProto(Stamp stamp, google::protobuf::Timestamp* message);
Stamp FromProto(const google::protobuf::Timestamp& message);

void ToProto(const Eigen::Vector3d& vector, v1::Vector3* message);
Eigen::Vector3d FromProto(const v1::Vector3& message);
void ToProto(const geometry::Pose& pose, bool has_orientation, v1::Pose* message);
/// The pose, and whether it has an orientation (identity where not).
struct ReadPose {
  geometry::Pose pose;
  bool has_orientation = false;
};
Result<ReadPose> FromProto(const v1::Pose& message, std::string_view field);

void ToProto(const geometry::NamedPose& pose, v1::NamedPose* message);
Result<geometry::NamedPose> FromProto(const v1::NamedPose& message, std::string_view field);
void ToProto(const std::vector<geometry::NamedPose>& poses,
             google::protobuf::RepeatedPtrField<v1::NamedPose>* message);
Result<std::vector<geometry::NamedPose>> FromProto(
    const google::protobuf::RepeatedPtrField<v1::NamedPose>& message, std::string_view field);

void ToProto(const demonstration::ScalarSeries& series, v1::ScalarSeries* message);
Result<demonstration::ScalarSeries> FromProto(const v1::ScalarSeries& message,
                                              std::string_view field);
void ToProto(const demonstration::PoseSeries& series, v1::PoseSeries* message);
Result<demonstration::PoseSeries> FromProto(const v1::PoseSeries& message, std::string_view field);

void ToProto(const Error& error, v1::ErrorDetail* message);
Error FromProto(const v1::ErrorDetail& message);

/// A map of options, both ways.
template <class Map>
void OptionsToProto(const std::map<std::string, std::string>& options, Map* message) {
  for (const auto& [name, value] : options) (*message)[Utf8(name)] = Utf8(value);
}
template <class Map>
std::map<std::string, std::string> OptionsFromProto(const Map& message) {
  return {message.begin(), message.end()};
}

}  // namespace exemplar::rpc
