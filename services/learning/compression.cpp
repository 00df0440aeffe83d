#include "learning/compression.hpp"

#include <zstd.h>

#include <cassert>
#include <memory>

namespace exemplar::learning_service {
namespace {

struct FreeCompressor {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
};

}  // namespace

std::string Compress(std::string_view bytes) {
  const std::unique_ptr<ZSTD_CCtx, FreeCompressor> context(ZSTD_createCCtx());
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::string frame(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress2(context.get(), frame.data(), frame.size(), bytes.data(), bytes.size());
  assert(!ZSTD_isError(size) && "the bound is always enough");
  frame.resize(size);
  return frame;
}

Result<std::string> Decompress(std::string_view frame) {
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  constexpr unsigned long long kLargest = 1ULL << 34;
  if (size == ZSTD_CONTENTSIZE_ERROR || size == ZSTD_CONTENTSIZE_UNKNOWN || size > kLargest) {
    return Error{ErrorCode::kDataLoss, "stored bytes are no Zstandard frame of ours"};
  }
  std::string bytes(size, '\0');
  const std::size_t got = ZSTD_decompress(bytes.data(), bytes.size(), frame.data(), frame.size());
  if (ZSTD_isError(got) || got != size) {
    return Error{ErrorCode::kDataLoss, std::string("stored bytes are damaged: ") +
                                           (ZSTD_isError(got) ? ZSTD_getErrorName(got) : "short")};
  }
  return bytes;
}

}  // namespace exemplar::learning_service
