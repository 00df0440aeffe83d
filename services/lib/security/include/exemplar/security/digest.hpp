#pragma once
// Hashes, secrets and their comparison (OpenSSL inside only).

#include <cstddef>
#include <map>
#include <memory>
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
/// SHA-256 of what comes in pieces. Thread-compatible.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;
  void Add(std::string_view bytes);
  /// Of all that was added, 64 hexadecimal digits. Nothing is added afterwards.
  std::string Hex();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// What stands for a person's id where the id itself must not: PBKDF2-HMAC-SHA256 of 100,000
/// rounds, 64 hexadecimal digits. Ids are short, so that a quick hash could be tried out.
std::string PersonHash(std::string_view salt, std::string_view person);
/// The same, each pair computed once. Thread-compatible.
class PersonHasher {
 public:
  const std::string& Hash(const std::string& salt, const std::string& person);

 private:
  std::map<std::pair<std::string, std::string>, std::string> known_;
};

/// Takes the same time wherever two texts of one length differ.
bool EqualInConstantTime(std::string_view a, std::string_view b);

}  // namespace exemplar::security
