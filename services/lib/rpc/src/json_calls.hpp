#pragma once
#include <grpcpp/channel.h>

#include <memory>
#include <string>
#include <vector>

#include "exemplar/api/json_calls.hpp"

namespace exemplar::rpc {

/// Calls over `channel`, whose server serves all of `services`.
std::unique_ptr<api::JsonCalls> MakeJsonCalls(std::shared_ptr<grpc::Channel> channel,
                                              const std::vector<std::string>& services);

}  // namespace exemplar::rpc
