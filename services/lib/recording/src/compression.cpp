#include "compression.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

namespace exemplar::recording {
namespace {

constexpr std::size_t kStep = 256 * 1024;

struct FreeZstd {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};
struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

/// Makes room for one step more; false at the limit.
bool Grow(Bytes& out, std::size_t used, std::uint64_t largest) {
  if (used >= largest) return false;
  out.resize(static_cast<std::size_t>(std::min<std::uint64_t>(largest, used + kStep)));
  return true;
}

Decompressed Stopped(Bytes bytes, std::size_t used, std::string fault) {
  bytes.resize(used);
  return {std::move(bytes), false, std::move(fault)};
}

Decompressed DecompressZstd(ByteView bytes, std::uint64_t largest) {
  const std::unique_ptr<ZSTD_DCtx, FreeZstd> context(ZSTD_createDCtx());
  Bytes out;
  std::size_t used = 0;
  ZSTD_inBuffer input{bytes.data(), bytes.size(), 0};
  std::size_t left = 1;
  while (left != 0) {
    if (used == out.size() && !Grow(out, used, largest)) {
      out.resize(used + 1);  // room to see whether there is more than there may be
    }
    ZSTD_outBuffer output{out.data(), out.size(), used};
    const std::size_t before = input.pos;
    left = ZSTD_decompressStream(context.get(), &output, &input);
    if (ZSTD_isError(left)) {
      return Stopped(std::move(out), used, std::string("zstd: ") + ZSTD_getErrorName(left));
    }
    const bool moved = output.pos != used || input.pos != before;
    used = output.pos;
    if (used > largest) {
      return Stopped(std::move(out), static_cast<std::size_t>(largest), "zstd: longer than stated");
    }
    if (left != 0 && !moved) {
      return Stopped(std::move(out), used, "zstd: the compressed bytes end early");
    }
  }
  out.resize(used);
  return {std::move(out), true, {}};
}

Decompressed DecompressLz4(ByteView bytes, std::uint64_t largest) {
  LZ4F_dctx* raw = nullptr;
  if (const auto made = LZ4F_createDecompressionContext(&raw, LZ4F_VERSION); LZ4F_isError(made)) {
    return Stopped({}, 0, std::string("lz4: ") + LZ4F_getErrorName(made));
  }
  const std::unique_ptr<LZ4F_dctx, FreeLz4> context(raw);
  Bytes out;
  std::size_t used = 0;
  std::size_t read = 0;
  std::size_t left = 1;
  while (left != 0) {
    if (used == out.size() && !Grow(out, used, largest)) out.resize(used + 1);
    std::size_t produced = out.size() - used;
    std::size_t consumed = bytes.size() - read;
    left = LZ4F_decompress(context.get(), out.data() + used, &produced, bytes.data() + read,
                           &consumed, nullptr);
    if (LZ4F_isError(left)) {
      return Stopped(std::move(out), used, std::string("lz4: ") + LZ4F_getErrorName(left));
    }
    used += produced;
    read += consumed;
    if (used > largest) {
      return Stopped(std::move(out), static_cast<std::size_t>(largest), "lz4: longer than stated");
    }
    if (left != 0 && produced == 0 && consumed == 0) {
      return Stopped(std::move(out), used, "lz4: the compressed bytes end early");
    }
  }
  out.resize(used);
  return {std::move(out), true, {}};
}

}  // namespace

std::string_view NameOf(Compression compression) {
  switch (compression) {
    case Compression::kNone:
      return "";
    case Compression::kZstd:
      return "zstd";
    case Compression::kLz4:
      return "lz4";
  }
  return "";
}

Status Compress(Compression compression, int zstd_level, ByteView bytes, Bytes& out) {
  if (compression == Compression::kZstd) {
    out.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size =
        ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), zstd_level);
    if (ZSTD_isError(size)) return Internal(std::string("zstd: ") + ZSTD_getErrorName(size));
    out.resize(size);
  } else if (compression == Compression::kLz4) {
    LZ4F_preferences_t preferences{};
    preferences.frameInfo.contentSize = bytes.size();
    out.resize(LZ4F_compressFrameBound(bytes.size(), &preferences));
    const std::size_t size =
        LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), &preferences);
    if (LZ4F_isError(size)) return Internal(std::string("lz4: ") + LZ4F_getErrorName(size));
    out.resize(size);
  } else {
    out.assign(bytes.begin(), bytes.end());
  }
  return {};
}

Result<Decompressed> Decompress(std::string_view compression, ByteView bytes,
                                std::uint64_t largest) {
  if (compression.empty()) {
    const std::size_t size =
        static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), largest));
    return Decompressed{Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)),
                        size == bytes.size(), size == bytes.size() ? "" : "longer than stated"};
  }
  if (compression == "zstd") return DecompressZstd(bytes, largest);
  if (compression == "lz4") return DecompressLz4(bytes, largest);
  return Error{ErrorCode::kInvalidArgument, "compression \"" +
                                                std::string(compression.substr(0, 40)) +
                                                "\" is unknown; zstd and lz4 are known"};
}

}  // namespace exemplar::recording
