#pragma once
// What RTPS numbers mean, for discovery's readers. No Fast DDS in here.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "exemplar/ircp/discovery.hpp"

namespace exemplar::bus {

/// Of the two bytes of a vendor's id.
std::string VendorName(std::uint8_t first, std::uint8_t second);
ircp::SeenLocator LocatorFrom(std::int32_t kind, std::uint32_t port,
                              std::span<const std::uint8_t, 16> address);
/// A writer's or reader's user data if it is a schema: other middlewares put their own things
/// there.
std::string SchemaFrom(std::span<const std::uint8_t> user_data);

}  // namespace exemplar::bus
