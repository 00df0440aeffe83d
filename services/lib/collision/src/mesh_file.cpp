#include "mesh_file.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include "exemplar/base/text.hpp"

namespace exemplar::collision {
namespace {

constexpr std::size_t kHeaderBytes = 84;
constexpr std::size_t kTriangleBytes = 50;
constexpr std::size_t kMaxTriangles = 1'000'000;
/// A triangle of a text file seldom takes more.
constexpr std::uintmax_t kMaxBytes = 400 * kMaxTriangles;

std::uint32_t ReadLittleEndian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[at + i])) << (8 * i);
  }
  return value;
}

Error TooManyTriangles(std::string_view source, std::size_t triangles) {
  return InvalidArgument(std::string(source) + ": the mesh has " + std::to_string(triangles) +
                         " triangles or more; at most " + std::to_string(kMaxTriangles) +
                         " are taken: simplify it");
}

double ReadFloat(std::string_view bytes, std::size_t at) {
  const std::uint32_t bits = ReadLittleEndian(bytes, at);
  float value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

Result<std::vector<Eigen::Vector3d>> ParseBinary(std::string_view bytes, std::string_view source) {
  const std::size_t triangles = ReadLittleEndian(bytes, 80);
  std::vector<Eigen::Vector3d> corners;
  corners.reserve(3 * triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t at = kHeaderBytes + t * kTriangleBytes + 12 * (corner + 1);
      const Eigen::Vector3d p(ReadFloat(bytes, at), ReadFloat(bytes, at + 4),
                              ReadFloat(bytes, at + 8));
      if (!p.allFinite()) {
        return InvalidArgument(std::string(source) + ": triangle " + std::to_string(t) +
                               " has a corner that is not finite");
      }
      corners.push_back(p);
    }
  }
  return corners;
}

Result<std::vector<Eigen::Vector3d>> ParseText(std::string_view text, std::string_view source) {
  std::vector<Eigen::Vector3d> corners;
  std::size_t line_number = 0;
  for (std::string_view line : Split(text, '\n')) {
    ++line_number;
    line = Trim(line);
    if (!line.starts_with("vertex")) continue;
    Eigen::Vector3d p;
    int read = 0;
    for (const std::string_view word : Split(line.substr(6), ' ')) {
      if (Trim(word).empty()) continue;
      const std::optional<double> value = ParseDouble(word);
      if (!value || !std::isfinite(*value) || read == 3) {
        return InvalidArgument(std::string(source) + ":" + std::to_string(line_number) + ": \"" +
                               std::string(line) + "\" is not a vertex of three numbers");
      }
      p[read++] = *value;
    }
    if (read != 3) {
      return InvalidArgument(std::string(source) + ":" + std::to_string(line_number) + ": \"" +
                             std::string(line) + "\" is not a vertex of three numbers");
    }
    corners.push_back(p);
    if (corners.size() > 3 * kMaxTriangles) return TooManyTriangles(source, kMaxTriangles + 1);
  }
  if (corners.size() % 3 != 0) {
    return InvalidArgument(std::string(source) + ": " + std::to_string(corners.size()) +
                           " vertices do not make whole triangles");
  }
  return corners;
}

}  // namespace

Result<std::vector<Eigen::Vector3d>> ParseStl(std::string_view bytes, std::string_view source) {
  if (bytes.empty()) return InvalidArgument(std::string(source) + ": the mesh file is empty");
  // Some writers begin binary files with "solid" too: the length decides first.
  if (bytes.size() >= kHeaderBytes) {
    const std::size_t triangles = ReadLittleEndian(bytes, 80);
    if (bytes.size() == kHeaderBytes + triangles * kTriangleBytes) {
      if (triangles > kMaxTriangles) return TooManyTriangles(source, triangles);
      if (triangles == 0) {
        return InvalidArgument(std::string(source) + ": the mesh has no triangles");
      }
      return ParseBinary(bytes, source);
    }
  }
  if (!Trim(bytes.substr(0, 80)).starts_with("solid")) {
    return InvalidArgument(
        std::string(source) +
        ": neither a text STL (starts with \"solid\") nor a binary one (84 bytes and 50 a "
        "triangle); the file has " +
        std::to_string(bytes.size()) + " bytes");
  }
  Result<std::vector<Eigen::Vector3d>> corners = ParseText(bytes, source);
  if (corners.ok() && corners->empty()) {
    return InvalidArgument(std::string(source) + ": the mesh has no triangles");
  }
  return corners;
}

Result<std::vector<Eigen::Vector3d>> ReadStl(const std::filesystem::path& file) {
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(file, failed);
  if (failed) {
    return NotFound(file.string() + ": the mesh file cannot be opened (" + failed.message() + ")");
  }
  if (size > kMaxBytes) {
    return InvalidArgument(file.string() + ": the mesh file has " + std::to_string(size) +
                           " bytes; at most " + std::to_string(kMaxBytes) +
                           " are read: simplify the mesh");
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) return NotFound(file.string() + ": the mesh file cannot be opened");
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (in.bad()) return InvalidArgument(file.string() + ": the mesh file cannot be read");
  return ParseStl(bytes.str(), file.string());
}

}  // namespace exemplar::collision
