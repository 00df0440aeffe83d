#include <algorithm>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "exemplar/learning/skill.hpp"

namespace exemplar::learning {
namespace {

using nlohmann::json;

// The bytes are read back by ToNumbers of json_values.hpp as they lie in memory.
static_assert(std::endian::native == std::endian::little);

// Shorter arrays stay readable, and gain nothing.
constexpr std::size_t kFewestNumbers = 16;

void PackNumbers(json& value) {
  if (!value.is_structured()) return;
  const bool packs =
      value.is_array() && value.size() >= kFewestNumbers &&
      std::all_of(value.begin(), value.end(), [](const json& v) { return v.is_number_float(); });
  if (!packs) {
    for (json& part : value) PackNumbers(part);
    return;
  }
  std::vector<std::uint8_t> bytes(value.size() * sizeof(double));
  std::uint8_t* to = bytes.data();
  for (const json& number : value) {
    std::memcpy(to, number.get_ptr<const double*>(), sizeof(double));
    to += sizeof(double);
  }
  value = json::binary(std::move(bytes));
}

}  // namespace

std::string ToBytes(const Skill& skill) {
  json document = ToJson(skill);
  PackNumbers(document);
  std::string bytes;
  json::to_cbor(document, bytes);
  return bytes;
}

Result<Skill> SkillFromBytes(std::string_view bytes,
                             std::shared_ptr<const demonstration::ToolKinematics> tool) {
  const json document = json::from_cbor(bytes, true, false);
  if (document.is_discarded()) {
    return Error{ErrorCode::kDataLoss, "the stored skill is damaged: it is no CBOR"};
  }
  return SkillFromJson(document, std::move(tool));
}

}  // namespace exemplar::learning
