#pragma once
// How many samples who has sent, as text within an ircp/clock sample: "TOPIC SOURCE COUNT", a line
// each.

#include <string>
#include <string_view>
#include <vector>

#include "exemplar/ircp/samples.hpp"

namespace exemplar::ircp {

std::string CountsToText(const std::vector<TopicCount>& counts);
/// Lines without sense are left out.
std::vector<TopicCount> CountsFromText(std::string_view text);
/// Of one source of one topic; 0 where there is none.
std::uint64_t CountOf(const std::vector<TopicCount>& counts, std::string_view topic,
                      std::string_view source);

}  // namespace exemplar::ircp
