// Any bytes go through the readers of backup files, as they are and with the checksums of the
// headers made right, which chance does not find. What is read lies within the file, each byte of
// an entry once; what is taken for a backup gives its parts again.

#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "exemplar/backup/backup_file.hpp"
#include "exemplar/backup/tar.hpp"
#include "exemplar/security/digest.hpp"

namespace exemplar::backup {
namespace {

constexpr std::size_t kBlock = 512;

void Require(bool condition) {
  if (!condition) std::abort();
}

/// A file in memory, the same one for each input.
std::filesystem::path FileOf(std::string_view bytes) {
  static const int descriptor = ::memfd_create("backup", MFD_CLOEXEC);
  Require(::ftruncate(descriptor, 0) == 0);
  const auto length = static_cast<ssize_t>(bytes.size());
  Require(::pwrite(descriptor, bytes.data(), bytes.size(), 0) == length);
  return "/proc/self/fd/" + std::to_string(descriptor);
}

/// Every block that may be a header gets the checksum that it ought to have.
std::string WithChecksums(std::string bytes) {
  constexpr std::size_t kChecksum = 148;
  constexpr std::size_t kDigits = 6;
  constexpr std::size_t kMagic = 257;
  for (std::size_t at = 0; at + kBlock <= bytes.size(); at += kBlock) {
    if (bytes.compare(at + kMagic, 5, "ustar") != 0) continue;
    bytes.replace(at + kChecksum, 8, 8, ' ');
    unsigned sum = 0;
    for (std::size_t i = 0; i < kBlock; ++i) sum += static_cast<unsigned char>(bytes[at + i]);
    for (std::size_t i = kDigits; i-- > 0; sum /= 8) {
      bytes[at + kChecksum + i] = static_cast<char>('0' + sum % 8);
    }
    bytes[at + kChecksum + kDigits] = '\0';
  }
  return bytes;
}

/// The parts as a manifest would name them, for the readers that want one.
Manifest ReadEntries(const std::filesystem::path& file, std::uint64_t size) {
  Manifest manifest;
  for (const char* service : {"learning", "recorder"}) {
    manifest.services.push_back(
        {.service = service, .schema = 1, .parts = 0, .bytes = 0, .counts = {}, .notices = {}});
  }
  const auto reader = TarReader::Open(file);
  Require(reader.ok());
  std::uint64_t end = 0;
  for (;;) {
    const auto entry = (*reader)->Next();
    Require(entry.ok() || entry.error().code == ErrorCode::kDataLoss);
    if (!entry.ok() || !*entry) return manifest;
    Require((*entry)->offset >= end && (*entry)->offset <= size);
    Require((*entry)->bytes <= size - (*entry)->offset);
    end = (*entry)->offset + (*entry)->bytes;
    security::Sha256 hash;
    std::uint64_t got = 0;
    for (;;) {
      const auto bytes = (*reader)->Read();
      Require(bytes.ok());
      if (bytes->empty()) break;
      got += bytes->size();
      hash.Add(*bytes);
    }
    Require(got == (*entry)->bytes);
    manifest.parts.push_back({(*entry)->name, got, hash.Hex(), (*entry)->offset});
  }
}

void ReadAll(std::string_view bytes) {
  const std::filesystem::path file = FileOf(bytes);
  const Manifest found = ReadEntries(file, bytes.size());
  (void)ReadErased(file, found);
  const auto manifest = Verify(file, {});
  if (!manifest.ok()) return;
  Require(manifest->parts.size() + 1 == found.parts.size());
  for (const api::BackupPlan& plan : manifest->services) {
    const auto source = OpenService(file, *manifest, plan.service, {});
    Require(source.ok());
    for (;;) {
      const auto part = (*source)->NextPart();
      Require(part.ok());
      if (!*part) break;
    }
  }
}

}  // namespace
}  // namespace exemplar::backup

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace exemplar::backup;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  ReadAll(bytes);
  ReadAll(WithChecksums(bytes));
  return 0;
}
