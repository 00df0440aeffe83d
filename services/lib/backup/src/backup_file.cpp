#include "exemplar/backup/backup_file.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "exemplar/backup/tar.hpp"
#include "exemplar/security/digest.hpp"

namespace exemplar::backup {
namespace {

using Json = nlohmann::json;

constexpr const char* kManifest = "manifest.json";
constexpr const char* kFormat = "exemplar-backup";
constexpr int kFormatVersion = 1;

// Of a number that is wanted whole, nlohmann would also take one with a fraction, or too large.
std::int64_t WholeOf(const Json& json) { return json.get_ref<const Json::number_integer_t&>(); }
std::uint64_t CountOf(const Json& json) { return json.get_ref<const Json::number_unsigned_t&>(); }

std::string ToText(const Manifest& manifest) {
  Json services = Json::array();
  for (const api::BackupPlan& plan : manifest.services) {
    services.push_back({{"service", plan.service},
                        {"schema", plan.schema},
                        {"parts", plan.parts},
                        {"bytes", plan.bytes},
                        {"counts", plan.counts},
                        {"notices", plan.notices}});
  }
  Json parts = Json::array();
  for (const PartFacts& part : manifest.parts) {
    parts.push_back({{"name", part.name}, {"bytes", part.bytes}, {"sha256", part.sha256}});
  }
  const Json json = {{"format", kFormat},
                     {"format_version", kFormatVersion},
                     {"made", ToIso8601(manifest.made)},
                     {"made_ns", manifest.made.nanoseconds()},
                     {"program", manifest.program},
                     {"services", services},
                     {"parts", parts}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<Manifest> FromText(const std::string& text, const std::string& file) {
  const auto damaged = [&](const std::string& what) {
    return Error{ErrorCode::kDataLoss, file + ": " + kManifest + ": " + what, "file"};
  };
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return damaged("it is no JSON");
  // nlohmann tells of missing and mistyped members by exceptions.
  try {
    if (json.at("format") != kFormat) return damaged("this is no backup of ours");
    const std::int64_t version = WholeOf(json.at("format_version"));
    if (version > kFormatVersion) {
      return FailedPrecondition(file + " has format " + std::to_string(version) +
                                    ", written by a newer program; this one knows up to " +
                                    std::to_string(kFormatVersion),
                                "file");
    }
    Manifest manifest;
    manifest.made = Stamp::FromNanoseconds(WholeOf(json.at("made_ns")));
    manifest.program = json.at("program");
    for (const Json& service : json.at("services")) {
      std::map<std::string, std::uint64_t> counts;
      for (const auto& [name, count] : service.at("counts").items()) counts[name] = CountOf(count);
      manifest.services.push_back(
          {.service = service.at("service"),
           .schema = static_cast<int>(WholeOf(service.at("schema"))),
           .parts = CountOf(service.at("parts")),
           .bytes = CountOf(service.at("bytes")),
           .counts = std::move(counts),
           .notices = service.at("notices").get<std::vector<std::string>>()});
    }
    for (const Json& part : json.at("parts")) {
      manifest.parts.push_back({.name = part.at("name"),
                                .bytes = CountOf(part.at("bytes")),
                                .sha256 = part.at("sha256")});
    }
    return manifest;
  } catch (const Json::exception& e) {
    return damaged(e.what());
  }
}

class WriterImpl final : public Writer {
 public:
  WriterImpl(std::unique_ptr<TarWriter> tar, Stamp now, const std::string& program)
      : tar_(std::move(tar)) {
    manifest_.made = now;
    manifest_.program = program;
  }

  std::unique_ptr<api::BackupSink> NextService(BytesProgress progress) override {
    return std::make_unique<Sink>(*this, std::move(progress));
  }

  Result<Manifest> Finish() override {
    if (Status ended = EndPart(); !ended) return ended.error();
    for (const api::BackupPlan& plan : manifest_.services) {
      std::uint64_t parts = 0;
      std::uint64_t bytes = 0;
      for (const PartFacts& part : manifest_.parts) {
        if (!part.name.starts_with(plan.service + "/")) continue;
        ++parts;
        bytes += part.bytes;
      }
      if (parts != plan.parts || bytes != plan.bytes) {
        return Error{ErrorCode::kDataLoss, plan.service + " sent " + std::to_string(parts) +
                                               " parts of " + std::to_string(plan.parts) + ", " +
                                               std::to_string(bytes) + " bytes of " +
                                               std::to_string(plan.bytes)};
      }
    }
    const std::string text = ToText(manifest_);
    for (const Status& done :
         {tar_->Begin(kManifest, text.size(), Seconds()), tar_->Write(text), tar_->Finish()}) {
      if (!done) return done.error();
    }
    return manifest_;
  }

 private:
  class Sink final : public api::BackupSink {
   public:
    Sink(WriterImpl& writer, BytesProgress progress)
        : writer_(writer), progress_(std::move(progress)) {}
    Status Begin(const api::BackupPlan& plan) override {
      all_ = plan.bytes;
      service_ = plan.service;
      writer_.manifest_.services.push_back(plan);
      return {};
    }
    Status BeginPart(const api::BackupPart& part) override {
      return writer_.BeginPart(service_ + "/" + part.name, part.bytes);
    }
    Status Write(std::string_view bytes) override {
      done_ += bytes.size();
      if (progress_) progress_(done_, all_);
      return writer_.Write(bytes);
    }

   private:
    WriterImpl& writer_;
    BytesProgress progress_;
    std::string service_;
    std::uint64_t done_ = 0;
    std::uint64_t all_ = 0;
  };

  std::int64_t Seconds() const { return manifest_.made.nanoseconds() / 1'000'000'000; }

  Status BeginPart(const std::string& name, std::uint64_t bytes) {
    if (Status ended = EndPart(); !ended) return ended;
    manifest_.parts.push_back({.name = name, .bytes = bytes, .sha256 = {}});
    hash_ = security::Sha256();
    open_ = true;
    return tar_->Begin(name, bytes, Seconds());
  }
  Status Write(std::string_view bytes) {
    hash_.Add(bytes);
    return tar_->Write(bytes);
  }
  Status EndPart() {
    if (open_) manifest_.parts.back().sha256 = hash_.Hex();
    open_ = false;
    return {};
  }

  std::unique_ptr<TarWriter> tar_;
  Manifest manifest_;
  security::Sha256 hash_;
  bool open_ = false;
};

class ServiceSource final : public api::BackupSource {
 public:
  ServiceSource(std::unique_ptr<TarReader> tar, std::string file, const Manifest& manifest,
                std::string service, BytesProgress progress)
      : tar_(std::move(tar)),
        file_(std::move(file)),
        manifest_(manifest),
        prefix_(std::move(service) + "/"),
        progress_(std::move(progress)) {}

  Result<std::optional<api::BackupPart>> NextPart() override {
    while (part_) {
      const Result<std::string> passed = Read();
      if (!passed) return passed.error();
    }
    for (;;) {
      const Result<std::optional<TarEntry>> entry = tar_->Next();
      if (!entry) return entry.error();
      if (!*entry) return std::optional<api::BackupPart>();
      if (!(*entry)->name.starts_with(prefix_)) continue;
      part_ = std::find_if(manifest_.parts.begin(), manifest_.parts.end(),
                           [&](const PartFacts& part) { return part.name == (*entry)->name; });
      if (*part_ == manifest_.parts.end()) return Changed((*entry)->name);
      hash_ = security::Sha256();
      return std::optional(api::BackupPart{(*entry)->name.substr(prefix_.size()), (*entry)->bytes});
    }
  }

  Result<std::string> Read() override {
    if (!part_) return std::string();
    Result<std::string> bytes = tar_->Read();
    if (!bytes) return bytes;
    hash_.Add(*bytes);
    if (progress_) progress_(tar_->position(), tar_->size());
    if (!bytes->empty()) return bytes;
    const PartFacts facts = **part_;
    part_.reset();
    if (hash_.Hex() != facts.sha256) return Changed(facts.name);
    return bytes;
  }

 private:
  Error Changed(const std::string& part) const {
    return {ErrorCode::kDataLoss, file_ + ": " + part + " was changed since it was verified",
            "file"};
  }

  std::unique_ptr<TarReader> tar_;
  const std::string file_;
  const Manifest manifest_;
  const std::string prefix_;
  BytesProgress progress_;
  security::Sha256 hash_;
  std::optional<std::vector<PartFacts>::const_iterator> part_;
};

/// What the file holds, as it is read.
struct Found {
  std::vector<PartFacts> parts;
  std::string manifest;
};

Result<Found> ReadAll(TarReader& tar, const BytesProgress& progress, const std::string& file) {
  Found found;
  for (;;) {
    const Result<std::optional<TarEntry>> entry = tar.Next();
    if (!entry) return entry.error();
    if (!*entry) return found;
    if (!found.manifest.empty()) {
      return Error{ErrorCode::kDataLoss,
                   file + ": " + (*entry)->name + " stands behind the manifest", "file"};
    }
    const bool is_manifest = (*entry)->name == kManifest;
    security::Sha256 hash;
    for (;;) {
      const Result<std::string> bytes = tar.Read();
      if (!bytes) return bytes.error();
      if (bytes->empty()) break;
      hash.Add(*bytes);
      if (is_manifest) found.manifest += *bytes;
      if (progress) progress(tar.position(), tar.size());
    }
    if (is_manifest) continue;
    found.parts.push_back({.name = (*entry)->name,
                           .bytes = (*entry)->bytes,
                           .sha256 = hash.Hex(),
                           .offset = (*entry)->offset});
  }
}

}  // namespace

const api::BackupPlan* Manifest::Find(const std::string& service) const {
  const auto found =
      std::find_if(services.begin(), services.end(),
                   [&](const api::BackupPlan& plan) { return plan.service == service; });
  return found == services.end() ? nullptr : &*found;
}

Result<std::unique_ptr<Writer>> Writer::Create(const std::filesystem::path& file, Stamp now,
                                               const std::string& program) {
  Result<std::unique_ptr<TarWriter>> tar = TarWriter::Create(file);
  if (!tar) return tar.error();
  return std::unique_ptr<Writer>(std::make_unique<WriterImpl>(*std::move(tar), now, program));
}

Result<Manifest> Verify(const std::filesystem::path& file, const BytesProgress& progress) {
  const Result<std::unique_ptr<TarReader>> tar = TarReader::Open(file);
  if (!tar) return tar.error();
  const Result<Found> found = ReadAll(**tar, progress, file.string());
  if (!found) return found.error();
  const auto damaged = [&](const std::string& what) {
    return Error{ErrorCode::kDataLoss, file.string() + ": " + what, "file"};
  };
  if (found->manifest.empty()) return damaged("it has no manifest.json: it is no whole backup");
  Result<Manifest> manifest = FromText(found->manifest, file.string());
  if (!manifest) return manifest.error();
  for (std::size_t i = 0; i < manifest->parts.size(); ++i) {
    PartFacts& part = manifest->parts[i];
    if (i >= found->parts.size() || found->parts[i].name != part.name) {
      return damaged("the part " + part.name + " is missing");
    }
    const PartFacts& there = found->parts[i];
    part.offset = there.offset;
    if (there.bytes == part.bytes && there.sha256 == part.sha256) continue;
    return damaged(part.name + " is damaged, within bytes " + std::to_string(there.offset) +
                   " to " + std::to_string(there.offset + there.bytes) + ": its SHA-256 is " +
                   there.sha256 + ", must be " + part.sha256);
  }
  if (found->parts.size() > manifest->parts.size()) {
    return damaged(found->parts[manifest->parts.size()].name + " is not in the manifest");
  }
  return manifest;
}

Result<std::unique_ptr<api::BackupSource>> OpenService(const std::filesystem::path& file,
                                                       const Manifest& manifest,
                                                       const std::string& service,
                                                       BytesProgress progress) {
  Result<std::unique_ptr<TarReader>> tar = TarReader::Open(file);
  if (!tar) return tar.error();
  return std::unique_ptr<api::BackupSource>(std::make_unique<ServiceSource>(
      *std::move(tar), file.string(), manifest, service, std::move(progress)));
}

Result<std::vector<api::ErasedPerson>> ReadErased(const std::filesystem::path& file,
                                                  const Manifest& manifest) {
  std::vector<api::ErasedPerson> erased;
  const auto read = [&](const std::string& service, const std::string& name,
                        const char* member) -> Status {
    if (manifest.Find(service) == nullptr) return {};
    const auto source = OpenService(file, manifest, service, {});
    if (!source) return source.error();
    for (;;) {
      const Result<std::optional<api::BackupPart>> part = (*source)->NextPart();
      if (!part) return part.error();
      if (!*part) return {};
      if ((*part)->name != name) continue;
      std::string text;
      for (;;) {
        const Result<std::string> bytes = (*source)->Read();
        if (!bytes) return bytes.error();
        if (bytes->empty()) break;
        text += *bytes;
      }
      try {
        const Json json = Json::parse(text);
        for (const Json& person : *member != '\0' ? json.at(member) : json) {
          erased.push_back({.salt = person.at("salt"),
                            .hash = person.at("hash"),
                            .erased = Stamp::FromNanoseconds(WholeOf(person.at("erased_ns")))});
        }
      } catch (const Json::exception& e) {
        return Error{ErrorCode::kDataLoss, file.string() + ": " + name + ": " + e.what(), "file"};
      }
      return {};
    }
  };
  if (const Status done = read("learning", "store.json", "erased_persons"); !done) {
    return done.error();
  }
  if (const Status done = read("recorder", "erased.json", ""); !done) return done.error();
  return erased;
}

}  // namespace exemplar::backup
