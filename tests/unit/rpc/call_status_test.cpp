#include "call_status.hpp"

#include <gtest/gtest.h>

#include <array>
#include <set>

#include "exemplar/v1/common.pb.h"

namespace exemplar::rpc {
namespace {

using grpc::StatusCode;

struct Pair {
  StatusCode status;
  ErrorCode code;
  bool also_back;  ///< the code has this status, too
};

constexpr std::array kTable = {
    Pair{StatusCode::CANCELLED, ErrorCode::kCancelled, true},
    Pair{StatusCode::UNKNOWN, ErrorCode::kInternal, false},
    Pair{StatusCode::INVALID_ARGUMENT, ErrorCode::kInvalidArgument, true},
    Pair{StatusCode::DEADLINE_EXCEEDED, ErrorCode::kDeadlineExceeded, true},
    Pair{StatusCode::NOT_FOUND, ErrorCode::kNotFound, true},
    Pair{StatusCode::ALREADY_EXISTS, ErrorCode::kAlreadyExists, true},
    Pair{StatusCode::PERMISSION_DENIED, ErrorCode::kPermissionDenied, true},
    Pair{StatusCode::RESOURCE_EXHAUSTED, ErrorCode::kResourceExhausted, true},
    Pair{StatusCode::FAILED_PRECONDITION, ErrorCode::kFailedPrecondition, true},
    Pair{StatusCode::ABORTED, ErrorCode::kFailedPrecondition, false},
    Pair{StatusCode::OUT_OF_RANGE, ErrorCode::kInvalidArgument, false},
    Pair{StatusCode::UNIMPLEMENTED, ErrorCode::kUnimplemented, true},
    Pair{StatusCode::INTERNAL, ErrorCode::kInternal, true},
    Pair{StatusCode::UNAVAILABLE, ErrorCode::kUnavailable, true},
    Pair{StatusCode::DATA_LOSS, ErrorCode::kDataLoss, true},
    Pair{StatusCode::UNAUTHENTICATED, ErrorCode::kUnauthenticated, true},
};

TEST(CallStatus, EveryCodeOfGrpcAndEveryCodeOfOursStandInTheTable) {
  std::set<int> statuses;
  std::set<ErrorCode> codes;
  for (const Pair& pair : kTable) {
    statuses.insert(pair.status);
    if (!pair.also_back) continue;
    EXPECT_TRUE(codes.insert(pair.code).second);
  }
  // 0 is OK; gRPC has 17 codes.
  EXPECT_EQ(statuses.size(), 16u);
  EXPECT_EQ(*statuses.begin(), 1);
  EXPECT_EQ(*statuses.rbegin(), 16);
  EXPECT_EQ(codes.size(), kErrorCodes.size());
}

TEST(CallStatus, WithoutOurDetailTheCodeOfGrpcCountsAndTheAddressIsNamed) {
  for (const Pair& pair : kTable) {
    const Error error = FromGrpc({pair.status, "said so"}, "lab:50051");
    EXPECT_EQ(error.code, pair.code) << pair.status;
    EXPECT_NE(error.message.find("lab:50051"), std::string::npos) << error.message;
  }
}

TEST(CallStatus, EveryErrorComesBackAsItWas) {
  EXPECT_TRUE(ToGrpc(Status()).ok());
  for (const Pair& pair : kTable) {
    if (!pair.also_back) continue;
    const Error error{pair.code, "größe is -2", "objects[0]"};
    const grpc::Status status = ToGrpc(error);
    EXPECT_EQ(status.error_code(), pair.status) << ToString(pair.code);
    EXPECT_EQ(status.error_message(), error.message);
    EXPECT_EQ(FromGrpc(status, "lab:50051"), error) << ToString(pair.code);
  }
}

TEST(CallStatus, ANameThatANewerServerGaveFallsBackToGrpcsCode) {
  for (const Pair& pair : kTable) {
    v1::ErrorDetail detail;
    detail.set_code("of_a_later_version");
    detail.set_message("said so");
    detail.set_field("speed");
    v1::CallStatus all;
    all.add_details()->PackFrom(detail);
    const Error error = FromGrpc({pair.status, "said so", all.SerializeAsString()}, "lab:50051");
    EXPECT_EQ(error, (Error{pair.code, "said so", "speed"})) << pair.status;
  }
}

TEST(CallStatus, AConnectionThatCouldNotBeMadeIsToldInFewWords) {
  const Error error =
      FromGrpc({StatusCode::UNAVAILABLE,
                "failed to connect to all addresses; last error: UNKNOWN: ipv4:127.0.0.1:9: Failed "
                "to connect to remote host: Connection refused"},
               "127.0.0.1:9");
  EXPECT_EQ(error.message, "no answer from 127.0.0.1:9: nobody listens there");
  EXPECT_EQ(PlainReason("DNS resolution failed for nohost:1: C-ares status is not ARES_SUCCESS"),
            "no machine of that name is known");
  EXPECT_EQ(PlainReason("of no known kind"), "of no known kind");
}

TEST(CallStatus, DetailsThatAreNoneOfOursAreLeftAside) {
  for (const std::string& details : {std::string("\xff\xff\xff"), std::string(100, '\x0a')}) {
    const Error error = FromGrpc({StatusCode::PERMISSION_DENIED, "no", details}, "lab:50051");
    EXPECT_EQ(error.code, ErrorCode::kPermissionDenied);
    EXPECT_EQ(error.message, "lab:50051: no");
  }
}

}  // namespace
}  // namespace exemplar::rpc
