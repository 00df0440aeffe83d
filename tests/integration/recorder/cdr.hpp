#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace exemplar::recorder {

/// IDL of a type that begins as those of idl/ do.
inline std::string HeaderIdl(const std::string& type, const std::string& more_keys = "") {
  return "module exemplar { struct Part { double x; };\n/* numbered */ @final struct " + type +
         " {\n  @key string source;  // who\n" + more_keys + "  unsigned long long seq;\n" +
         "  long long stamp_ns;\n}; };\n";
}

/// The beginning of a sample as idl/common.idl has it, little- or big-endian, and `extra` bytes.
inline std::vector<std::uint8_t> SampleBytes(const std::string& source, std::uint64_t seq,
                                             std::size_t extra = 8, bool little_endian = true) {
  constexpr std::size_t kEncapsulation = 4;  // alignment counts from behind it
  std::vector<std::uint8_t> cdr(kEncapsulation, 0);
  cdr[1] = little_endian ? 1 : 0;
  const auto put = [&](std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) {
      cdr.push_back(static_cast<std::uint8_t>(value >> (8 * (little_endian ? i : bytes - 1 - i))));
    }
  };
  put(source.size() + 1, 4);
  for (const char c : source) cdr.push_back(static_cast<std::uint8_t>(c));
  cdr.push_back(0);
  while ((cdr.size() - kEncapsulation) % 8 != 0) cdr.push_back(0xEE);
  put(seq, 8);
  for (std::size_t i = 0; i < extra; ++i) cdr.push_back(static_cast<std::uint8_t>(seq + i));
  return cdr;
}

}  // namespace exemplar::recorder
