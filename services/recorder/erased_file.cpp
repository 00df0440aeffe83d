#include "recorder/erased_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "exemplar/recording/file.hpp"

namespace exemplar::recorder {
namespace {

constexpr const char* kFile = "erased.json";

}  // namespace

std::string WriteErased(const std::vector<api::ErasedPerson>& erased) {
  nlohmann::json list = nlohmann::json::array();
  for (const api::ErasedPerson& person : erased) {
    list.push_back(
        {{"salt", person.salt}, {"hash", person.hash}, {"erased_ns", person.erased.nanoseconds()}});
  }
  return list.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Result<std::vector<api::ErasedPerson>> ReadErased(std::string_view json) {
  const nlohmann::json list = nlohmann::json::parse(json, nullptr, false);
  std::vector<api::ErasedPerson> erased;
  // nlohmann tells of missing and mistyped members by exceptions.
  try {
    for (const nlohmann::json& person : list) {
      erased.push_back({.salt = person.at("salt"),
                        .hash = person.at("hash"),
                        .erased = Stamp::FromNanoseconds(person.at("erased_ns"))});
    }
  } catch (const nlohmann::json::exception& e) {
    return Error{ErrorCode::kDataLoss, std::string(kFile) + ": " + e.what()};
  }
  return erased;
}

Result<std::vector<api::ErasedPerson>> LoadErased(const std::filesystem::path& folder) {
  std::ifstream stream(folder / kFile, std::ios::binary);
  if (!stream.is_open()) return std::vector<api::ErasedPerson>();
  const std::string json(std::istreambuf_iterator<char>(stream), {});
  Result<std::vector<api::ErasedPerson>> erased = ReadErased(json);
  if (!erased.ok()) return WithPlace(erased.error(), folder.string());
  return erased;
}

Status SaveErased(const std::filesystem::path& folder, std::vector<api::ErasedPerson> erased) {
  std::map<std::pair<std::string, std::string>, Stamp> latest;
  for (const api::ErasedPerson& person : erased) {
    Stamp& stamp = latest[{person.salt, person.hash}];
    stamp = std::max(stamp, person.erased);
  }
  erased.clear();
  for (const auto& [key, stamp] : latest) erased.push_back({key.first, key.second, stamp});
  const std::string json = WriteErased(erased);
  const std::filesystem::path part = folder / (std::string(kFile) + ".part");
  std::error_code error;
  std::filesystem::remove(part, error);
  {
    const auto sink = recording::FileSink::Create(part);
    if (!sink.ok()) return sink.error();
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(json.data());
    if (Status written = (*sink)->Write({bytes, json.size()}); !written.ok()) return written;
    if (Status synced = (*sink)->Sync(); !synced.ok()) return synced;
  }
  std::filesystem::rename(part, folder / kFile, error);
  if (error) return Internal((folder / kFile).string() + ": " + error.message());
  return SyncFolder(folder);
}

Status SyncFolder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return Internal(folder.string() + ": " + std::strerror(errno));
  const int synced = ::fsync(descriptor);
  const int number = errno;
  ::close(descriptor);
  // Some file systems cannot sync a folder.
  if (synced != 0 && number != EINVAL)
    return Internal(folder.string() + ": " + std::strerror(number));
  return {};
}

}  // namespace exemplar::recorder
