#include "rtps_names.hpp"

#include <algorithm>

namespace exemplar::bus {

std::string VendorName(std::uint8_t first, std::uint8_t second) {
  if (first == 1) {
    switch (second) {
      case 0x01:
        return "RTI Connext";
      case 0x02:
        return "OpenSplice";
      case 0x03:
        return "OpenDDS";
      case 0x0f:
        return "Fast DDS";
      case 0x10:
        return "Cyclone DDS";
      case 0x12:
        return "RustDDS";
      default:
        break;
    }
  }
  return "vendor " + std::to_string(first) + "." + std::to_string(second);
}

ircp::SeenLocator LocatorFrom(std::int32_t kind, std::uint32_t port,
                              std::span<const std::uint8_t, 16> address) {
  using Kind = ircp::SeenLocator::Kind;
  ircp::SeenLocator locator{.kind = Kind::kOther, .address = {}, .port = port};
  switch (kind) {
    case 1:
    case 4:
      locator.kind = kind == 1 ? Kind::kUdp4 : Kind::kTcp;
      for (std::size_t i = 12; i < 16; ++i) {
        locator.address += (i == 12 ? "" : ".") + std::to_string(address[i]);
      }
      // TCP has a logical port in its upper half.
      if (kind == 4) locator.port = port & 0xffff;
      break;
    case 2:
    case 8:
      locator.kind = kind == 2 ? Kind::kUdp6 : Kind::kTcp;
      break;
    case 16:
      locator.kind = Kind::kSharedMemory;
      locator.address = std::to_string(address[1]) + "." + std::to_string(address[2]);
      break;
    default:
      break;
  }
  return locator;
}

std::string SchemaFrom(std::span<const std::uint8_t> user_data) {
  std::string text(user_data.begin(), user_data.end());
  const bool printable = std::none_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 && c != '\n' && c != '\t' && c != '\r';
  });
  return printable && text.find("struct ") != std::string::npos ? text : std::string();
}

}  // namespace exemplar::bus
