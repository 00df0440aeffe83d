// The first half of the input is IDL, the second the bytes of a sample of it, or its JSON.

#include <cstdlib>
#include <string_view>

#include "exemplar/dynamic_data/json.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace exemplar::dynamic_data;
  constexpr std::string_view kBreak = "\n===\n";
  const std::string_view all(reinterpret_cast<const char*>(data), size);
  const std::size_t cut = all.find(kBreak);
  if (cut == std::string_view::npos) return 0;
  const auto type = ParseType(all.substr(0, cut), "A");
  if (!type.ok()) return 0;
  const std::string_view sample = all.substr(cut + kBreak.size());
  const std::span<const std::uint8_t> bytes(data + cut + kBreak.size(), sample.size());
  const auto json = ToJson(**type, bytes);
  if (json.ok() != Check(**type, bytes).ok()) std::abort();
  const auto made = FromJson(**type, sample);
  if (made.ok() && !Check(**type, *made).ok()) std::abort();
  return 0;
}
