#include "exemplar/base/ids.hpp"

#include <cstdio>
#include <random>

namespace exemplar {
namespace {

std::string Hex(std::uint64_t bits) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(bits));
  return text;
}

}  // namespace

std::string MakeId(std::string_view prefix, Rng& rng) {
  return std::string(prefix) + "-" + Hex(rng.NextBits());
}

std::uint64_t EntropySeed() {
  std::random_device device;
  return (static_cast<std::uint64_t>(device()) << 32) ^ device();
}

std::string ContentHash(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : bytes) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3ULL;
  }
  return Hex(hash);
}

}  // namespace exemplar
