#pragma once
// Motions straight into the bytes that leave: no message between, each number written once.

#include <grpcpp/support/byte_buffer.h>

#include <cstdint>

#include "exemplar/base/result.hpp"
#include "exemplar/demonstration/motion.hpp"

namespace exemplar::rpc {

/// The bytes of a QuerySkillResponse that holds `motion`.
grpc::ByteBuffer ResponseBytes(const demonstration::SkillMotion& motion);
/// The bytes of a QuerySkillStreamResponse that holds `motion`, or an error.
grpc::ByteBuffer StreamResponseBytes(std::uint64_t tag, const demonstration::SkillMotion& motion);
grpc::ByteBuffer StreamResponseBytes(std::uint64_t tag, const Error& error);

}  // namespace exemplar::rpc
