#pragma once
#include <string_view>

namespace exemplar::idl {

/// The text of idl/NAME.idl ("suit") with its includes inlined, or empty for an unknown name.
std::string_view FlattenedIdl(std::string_view name);

}  // namespace exemplar::idl
