#pragma once
#include <string>
#include <string_view>

#include "exemplar/base/result.hpp"

namespace exemplar::learning_service {

/// One Zstandard frame with its checksum.
std::string Compress(std::string_view bytes);
/// kDataLoss for what Compress did not make.
Result<std::string> Decompress(std::string_view frame);

}  // namespace exemplar::learning_service
