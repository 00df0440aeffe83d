#include "motion_wire.hpp"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpc/slice.h>
#include <grpcpp/support/slice.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <span>
#include <utility>

#include "convert_skill.hpp"

namespace exemplar::rpc {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedOutputStream;

// A packed field of doubles is their bytes, lowest first.
static_assert(std::endian::native == std::endian::little);

constexpr std::uint32_t Tag(int field) {
  return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
}

/// Of a field with `size` bytes of content, with its tag and its length.
std::size_t FieldSize(int field, std::size_t size) {
  return CodedOutputStream::VarintSize32(Tag(field)) + CodedOutputStream::VarintSize64(size) + size;
}

std::uint8_t* WriteHead(int field, std::size_t size, std::uint8_t* to) {
  to = CodedOutputStream::WriteVarint32ToArray(Tag(field), to);
  return CodedOutputStream::WriteVarint64ToArray(size, to);
}

/// How many numbers each array of the motion holds.
struct Counts {
  explicit Counts(const demonstration::SkillMotion& motion)
      : fields{{{v1::SkillMotion::kTimeSFieldNumber, motion.time_s.size()},
                {v1::SkillMotion::kJointsFieldNumber, Size(motion.joints)},
                {v1::SkillMotion::kToolFieldNumber, 7 * motion.base_T_tool.size()},
                {v1::SkillMotion::kHandOpenFieldNumber, motion.hand_open.size()},
                {v1::SkillMotion::kObjectivityFieldNumber, Size(motion.objectivity)},
                {v1::SkillMotion::kSigmaMFieldNumber, motion.sigma_m.size()}}} {}

  std::size_t bytes() const {
    std::size_t sum = 0;
    for (const auto& [field, count] : fields) {
      if (count > 0) sum += FieldSize(field, count * sizeof(double));
    }
    return sum;
  }

  std::array<std::pair<int, std::size_t>, 6> fields;

 private:
  static std::size_t Size(const Eigen::MatrixXd& matrix) {
    return static_cast<std::size_t>(matrix.size());
  }
};

std::uint8_t* WriteDoubles(std::span<const double> values, std::uint8_t* to) {
  std::memcpy(to, values.data(), values.size_bytes());
  return to + values.size_bytes();
}

std::uint8_t* WriteRows(const Eigen::MatrixXd& matrix, std::uint8_t* to) {
  const Eigen::Index rows = matrix.rows();
  const Eigen::Index columns = matrix.cols();
  if (columns == 1) return WriteDoubles({matrix.data(), static_cast<std::size_t>(rows)}, to);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double* from = matrix.data() + row;
    for (Eigen::Index column = 0; column < columns; ++column, from += rows) {
      std::memcpy(to, from, sizeof(double));
      to += sizeof(double);
    }
  }
  return to;
}

std::uint8_t* WritePoses(std::span<const geometry::Pose> poses, std::uint8_t* to) {
  for (const geometry::Pose& pose : poses) {
    std::memcpy(to, pose.translation.data(), 3 * sizeof(double));
    std::memcpy(to + 3 * sizeof(double), pose.rotation.coeffs().data(), 4 * sizeof(double));
    to += 7 * sizeof(double);
  }
  return to;
}

std::uint8_t* WriteArray(const demonstration::SkillMotion& motion, int field, std::uint8_t* to) {
  switch (field) {
    case v1::SkillMotion::kTimeSFieldNumber:
      return WriteDoubles(motion.time_s, to);
    case v1::SkillMotion::kJointsFieldNumber:
      return WriteRows(motion.joints, to);
    case v1::SkillMotion::kToolFieldNumber:
      return WritePoses(motion.base_T_tool, to);
    case v1::SkillMotion::kHandOpenFieldNumber:
      return WriteDoubles(motion.hand_open, to);
    case v1::SkillMotion::kObjectivityFieldNumber:
      return WriteRows(motion.objectivity, to);
    default:
      assert(field == v1::SkillMotion::kSigmaMFieldNumber);
      return WriteDoubles(motion.sigma_m, to);
  }
}

/// `before`: bytes of the enclosing message that come first; `field`: the motion's number there.
grpc::ByteBuffer Write(std::span<const std::uint8_t> before, int field,
                       const demonstration::SkillMotion& motion) {
  v1::SkillMotion rest;
  ToProtoWithoutArrays(motion, &rest);
  const std::size_t rest_bytes = rest.ByteSizeLong();
  const Counts counts(motion);
  const std::size_t motion_bytes = rest_bytes + counts.bytes();

  grpc_slice slice = grpc_slice_malloc(before.size() + FieldSize(field, motion_bytes));
  std::uint8_t* to = GRPC_SLICE_START_PTR(slice);
  to = std::copy(before.begin(), before.end(), to);
  to = WriteHead(field, motion_bytes, to);
  to = rest.SerializeWithCachedSizesToArray(to);
  for (const auto& [number, count] : counts.fields) {
    if (count == 0) continue;
    to = WriteHead(number, count * sizeof(double), to);
    to = WriteArray(motion, number, to);
  }
  assert(to == GRPC_SLICE_END_PTR(slice));
  const grpc::Slice whole(slice, grpc::Slice::STEAL_REF);
  return {&whole, 1};
}

}  // namespace

grpc::ByteBuffer ResponseBytes(const demonstration::SkillMotion& motion) {
  return Write({}, v1::QuerySkillResponse::kMotionFieldNumber, motion);
}

grpc::ByteBuffer StreamResponseBytes(std::uint64_t tag, const demonstration::SkillMotion& motion) {
  std::array<std::uint8_t, 16> before{};
  const std::uint8_t* end = WireFormatLite::WriteUInt64ToArray(
      v1::QuerySkillStreamResponse::kTagFieldNumber, tag, before.data());
  return Write({before.data(), static_cast<std::size_t>(end - before.data())},
               v1::QuerySkillStreamResponse::kMotionFieldNumber, motion);
}

grpc::ByteBuffer StreamResponseBytes(std::uint64_t tag, const Error& error) {
  v1::QuerySkillStreamResponse response;
  response.set_tag(tag);
  ToProto(error, response.mutable_error());
  const grpc::Slice whole(response.SerializeAsString());
  return {&whole, 1};
}

}  // namespace exemplar::rpc
