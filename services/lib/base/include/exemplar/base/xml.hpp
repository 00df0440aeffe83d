#pragma once
#include <string>
#include <string_view>

namespace exemplar {

/// `text` with the characters that XML gives a meaning replaced, and control characters that it
/// does not know as blanks: for contents and for attributes in double quotes.
std::string EscapeXml(std::string_view text);

}  // namespace exemplar
