#pragma once
// zstd and lz4 (its frame format), as chunks use them.

#include <string_view>

#include "exemplar/recording/writer.hpp"

namespace exemplar::recording {

/// The name that chunks carry: "", "zstd", "lz4".
std::string_view NameOf(Compression compression);

/// `out` is replaced.
Status Compress(Compression compression, int zstd_level, ByteView bytes, Bytes& out);

struct Decompressed {
  Bytes bytes;
  bool whole = true;  ///< false: the compressed bytes end early or turn bad; `bytes` came before
  std::string fault;  ///< why not
};
/// Gives as much as can be decompressed, never more than `largest` bytes. Fails on an unknown name.
Result<Decompressed> Decompress(std::string_view compression, ByteView bytes,
                                std::uint64_t largest);

}  // namespace exemplar::recording
