#pragma once
// Hashes, secrets and their comparison (OpenSSL inside only).

#include <cstddef>
#include <string>
#include <string_view>

namespace exemplar::security {

/// 64 lower-case hexadecimal digits.
std::string Sha256Hex(std::string_view bytes);
/// HMAC-SHA-256 of `bytes` under `key`, 64 hexadecimal digits.
std::string HmacSha256Hex(std::string_view key, std::string_view bytes);
/// `count` bytes from the machine's cryptographic source, as URL-safe base64 without padding.
std::string RandomText(std::size_t count);
/// A new token of 256 random bits: "exm_" and 43 characters. So much chance needs no slow hash.
std::string MakeToken();
/// Takes the same time wherever two texts of one length differ.
bool EqualInConstantTime(std::string_view a, std::string_view b);

}  // namespace exemplar::security
