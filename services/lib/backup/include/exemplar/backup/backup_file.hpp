#pragma once
// Backups of services in one tar file: each service's parts under its name ("learning/...",
// "recorder/..."), and "manifest.json" last, which holds what was copied and each part's length and
// SHA-256. A file without its manifest is not whole. docs/operators_data.md describes it.

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "exemplar/api/data.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/base/stamp.hpp"

namespace exemplar::backup {

struct PartFacts {
  std::string name;  ///< "learning/trials/trial-0f3c5a7be1d20496.zst"
  std::uint64_t bytes = 0;
  std::string sha256;
  std::uint64_t offset = 0;  ///< in the file
};

struct Manifest {
  Stamp made;
  std::string program;  ///< version of what wrote it
  std::vector<api::BackupPlan> services;
  std::vector<PartFacts> parts;

  /// Null: the file holds nothing of it.
  const api::BackupPlan* Find(const std::string& service) const;
};

/// Bytes done, of all; of all is 0 where nobody knows.
using BytesProgress = std::function<void(std::uint64_t done, std::uint64_t all)>;

/// Writes one file. Until Finish it has another name, and goes when this goes. Thread-compatible.
class Writer {
 public:
  /// kAlreadyExists when the file is there. `program` is the version to note.
  static Result<std::unique_ptr<Writer>> Create(const std::filesystem::path& file, Stamp now,
                                                const std::string& program);
  virtual ~Writer() = default;
  /// Takes the backup of one service after the other; the writer outlives the sink.
  virtual std::unique_ptr<api::BackupSink> NextService(BytesProgress progress) = 0;
  /// The whole on the disk under its name when it returns. kDataLoss where a service sent less than
  /// it had announced.
  virtual Result<Manifest> Finish() = 0;
};

/// Reads all of the file and compares it with its manifest. kDataLoss names what is damaged, and
/// where.
Result<Manifest> Verify(const std::filesystem::path& file, const BytesProgress& progress);

/// The parts of one service, checked once more as they are read. `manifest` is what Verify said of
/// the file.
Result<std::unique_ptr<api::BackupSource>> OpenService(const std::filesystem::path& file,
                                                       const Manifest& manifest,
                                                       const std::string& service,
                                                       BytesProgress progress);

/// Who stands in a backup as erased.
Result<std::vector<api::ErasedPerson>> ReadErased(const std::filesystem::path& file,
                                                  const Manifest& manifest);

}  // namespace exemplar::backup
