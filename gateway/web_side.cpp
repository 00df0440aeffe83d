#include "gateway/web_side.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "gateway/robot_pages.hpp"
#include "gateway/static_pages.hpp"

namespace exemplar::gateway {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJson = "application/json";

/// Where the page may be: beside the installed program (bin/../share/exemplar/web), or in the build
/// (build/<preset>/bin/../../web).
std::vector<fs::path> UsualFolders() {
  std::error_code failed;
  const fs::path program = fs::read_symlink("/proc/self/exe", failed);
  if (failed) return {};
  const fs::path above = program.parent_path().parent_path();
  return {above / "share" / "exemplar" / "web", above.parent_path() / "web"};
}

Status AddPageFrom(const fs::path& folder, http::Server& server) {
  Result<StaticFiles> files = ReadStaticFiles(folder);
  if (!files) return files.error();
  if (Status added = AddPage(server, *files); !added) {
    return WithPlace(added.error(), folder.string());
  }
  return {};
}

Status AddFoundPage(const ProgramOptions& words, http::Server& server, Log& log) {
  if (!words.web.empty()) {
    Status added = AddPageFrom(words.web, server);
    if (!added) return WithPlace(added.error(), "--web");
    return added;
  }
  std::string looked_in;
  for (const fs::path& folder : UsualFolders()) {
    std::error_code ignored;
    if (fs::exists(folder / "index.html", ignored)) return AddPageFrom(folder, server);
    looked_in += (looked_in.empty() ? "" : ", ") + folder.string();
  }
  log.Info("no web page", {{"looked_in", looked_in}});
  return AddPageMissing(server, looked_in);
}

Status AddDocument(http::Server& server, const char* path, const std::string& document) {
  return server.Route(http::Method::kGet, path,
                      [document](const http::Request&) { return http::Answer(document, kJson); });
}

Status AddAbsence(http::Server& server, const char* path, const char* option) {
  return server.Route(http::Method::kGet, path, [option](const http::Request&) {
    return http::ErrorAnswer(
        NotFound(std::string("the gateway was started without ") + option, option));
  });
}

/// {"recordings": [{"name", "bytes", "written_s": seconds since 1970}, ...]}, newest first.
http::Response AnswerRecordings(const fs::path& folder) {
  constexpr std::size_t kMost = 20;
  struct Recording {
    fs::file_time_type written;
    std::string name;
    std::uintmax_t bytes = 0;
  };
  std::vector<Recording> found;
  std::error_code failed;
  fs::directory_iterator entries(folder, failed);
  for (; !failed && entries != fs::directory_iterator(); entries.increment(failed)) {
    std::error_code gone;
    Recording one{entries->last_write_time(gone), entries->path().filename().string(),
                  entries->file_size(gone)};
    if (!gone && entries->path().extension() == ".mcap") found.push_back(std::move(one));
  }
  if (failed) {
    return http::ErrorAnswer(Unavailable("folder " + folder.string() + ": " + failed.message()));
  }
  const auto shown = found.begin() + static_cast<std::ptrdiff_t>(std::min(kMost, found.size()));
  std::partial_sort(found.begin(), shown, found.end(),
                    [](const Recording& a, const Recording& b) { return a.written > b.written; });
  nlohmann::json list = nlohmann::json::array();
  for (auto one = found.begin(); one != shown; ++one) {
    const auto written = std::chrono::file_clock::to_sys(one->written).time_since_epoch();
    list.push_back({{"name", one->name},
                    {"bytes", one->bytes},
                    {"written_s", std::chrono::duration<double>(written).count()}});
  }
  const nlohmann::json answer = {{"recordings", std::move(list)}};
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  return http::Answer(answer.dump(-1, ' ', false, kReplace) + "\n", kJson);
}

Status AddRecordings(const ProgramOptions& words, http::Server& server) {
  constexpr const char* kPath = "/recordings.json";
  if (words.recordings.empty()) return AddAbsence(server, kPath, "--recordings");
  return server.Route(http::Method::kGet, kPath, [folder = words.recordings](const http::Request&) {
    return AnswerRecordings(folder);
  });
}

}  // namespace

Status AddWebSide(const ProgramOptions& words, http::Server& server, Log& log) {
  constexpr const char* kRobot = "/robot/description.json";
  constexpr const char* kScene = "/robot/scene.json";
  if (Status added = AddFoundPage(words, server, log); !added) return added;
  Status added;
  if (words.robot.empty()) {
    added = AddAbsence(server, kRobot, "--robot");
  } else {
    const auto robot = kinematics::ReadRobotDescription(words.robot);
    if (!robot) return robot.error();
    Result<StaticFiles> files = RobotFiles(*robot);
    if (!files) return WithPlace(files.error(), "--robot");
    added = AddDocument(server, kRobot, RobotJson(*robot, *files));
    if (added) added = AddFiles(server, "/robot/files/", std::move(*files));
  }
  if (added) added = AddRecordings(words, server);
  if (!added) return added;
  if (words.scene.empty()) return AddAbsence(server, kScene, "--scene");
  const auto scene = scene::ReadDescription(words.scene);
  if (!scene) return WithPlace(scene.error(), "--scene");
  return AddDocument(server, kScene, SceneJson(*scene));
}

}  // namespace exemplar::gateway
