#include "motion_wire.hpp"

#include <google/protobuf/util/message_differencer.h>
#include <grpcpp/impl/codegen/proto_utils.h>
#include <gtest/gtest.h>

#include "convert_skill.hpp"
#include "random_values.hpp"

namespace exemplar::rpc {
namespace {

using google::protobuf::util::MessageDifferencer;

template <class Message>
Message Read(grpc::ByteBuffer bytes) {
  Message message;
  const grpc::Status read = grpc::SerializationTraits<Message>::Deserialize(&bytes, &message);
  EXPECT_TRUE(read.ok()) << read.error_message();
  return message;
}

void ExpectBytesOf(const demonstration::SkillMotion& motion, std::uint64_t tag) {
  v1::QuerySkillResponse response;
  ToProto(motion, response.mutable_motion());
  const grpc::ByteBuffer bytes = ResponseBytes(motion);
  EXPECT_EQ(bytes.Length(), response.ByteSizeLong());
  const auto read = Read<v1::QuerySkillResponse>(bytes);
  EXPECT_TRUE(MessageDifferencer::Equals(read, response));

  v1::QuerySkillStreamResponse streamed;
  streamed.set_tag(tag);
  ToProto(motion, streamed.mutable_motion());
  EXPECT_TRUE(MessageDifferencer::Equals(
      Read<v1::QuerySkillStreamResponse>(StreamResponseBytes(tag, motion)), streamed));
}

TEST(MotionWire, BytesAreThoseOfTheMessage) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) ExpectBytesOf(RandomMotion(rng), rng.NextBits());
}

TEST(MotionWire, EmptyPartsAreLeftOut) {
  demonstration::SkillMotion motion;
  motion.joints.resize(0, 0);
  motion.objectivity.resize(0, 0);
  ExpectBytesOf(motion, 0);
  motion.time_s = {0, 1};
  motion.joints.resize(2, 0);
  motion.objectivity = Eigen::MatrixXd::Constant(2, 1, 0.5);
  ExpectBytesOf(motion, 1);
}

TEST(MotionWire, AMotionOfManyFramesKeepsItsRows) {
  Rng rng(2);
  constexpr int kFrames = 3000;
  demonstration::SkillMotion motion;
  for (int i = 0; i < kFrames; ++i) motion.time_s.push_back(i);
  motion.joint_names = {"a", "b", "c"};
  motion.joints.resize(kFrames, 3);
  for (Eigen::Index i = 0; i < motion.joints.size(); ++i) motion.joints.data()[i] = rng.Normal();
  motion.objectivity.resize(kFrames, 0);
  ExpectBytesOf(motion, ~std::uint64_t{0});
}

TEST(MotionWire, ErrorsAreSentAsTheMessageHasThem) {
  const Error error{ErrorCode::kNotFound, "the skill knows no object \"lever\"", "objects[0].name"};
  v1::QuerySkillStreamResponse expected;
  expected.set_tag(9);
  ToProto(error, expected.mutable_error());
  EXPECT_TRUE(MessageDifferencer::Equals(
      Read<v1::QuerySkillStreamResponse>(StreamResponseBytes(9, error)), expected));
}

}  // namespace
}  // namespace exemplar::rpc
