#pragma once
// Small text helpers that std lacks; numbers are read and written independent of the locale.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace exemplar {

/// Finite or not ("nan", "inf" are read); nullopt unless the whole trimmed text is one number.
std::optional<double> ParseDouble(std::string_view text);
std::optional<long long> ParseInteger(std::string_view text);
/// The shortest text that reads back as the same double.
std::string FormatDouble(double value);
/// Fixed number of decimals.
std::string FormatFixed(double value, int decimals);

std::string_view Trim(std::string_view text);
std::vector<std::string_view> Split(std::string_view text, char separator);
std::string Join(std::span<const std::string> parts, std::string_view separator);

/// The candidate nearest to `word` by edit distance if near enough to be a slip of the hand.
std::optional<std::string> NearestName(std::string_view word,
                                       std::span<const std::string> candidates);

}  // namespace exemplar
