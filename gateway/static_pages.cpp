#include "gateway/static_pages.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/security/digest.hpp"

namespace exemplar::gateway {
namespace {

namespace fs = std::filesystem;

struct Kind {
  std::string_view ending;
  const char* content_type;
};
constexpr Kind kKinds[] = {
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".jpg", "image/jpeg"},
    {".jpeg", "image/jpeg"},
    {".txt", "text/plain; charset=utf-8"},
    {".urdf", "application/xml"},
    {".dae", "model/vnd.collada+xml"},
    {".stl", "model/stl"},
    {".obj", "model/obj"},
    {".mtl", "model/mtl"},
};

// A page loads nothing from elsewhere, is framed by nobody, and has no script or style in its text.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'";

const char* ContentTypeOf(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const Kind& kind : kKinds) {
    if (kind.ending == ending) return kind.content_type;
  }
  return nullptr;
}

std::optional<std::string> Content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad() || !in.is_open()) return std::nullopt;
  return bytes;
}

bool IsHidden(const fs::path& relative) {
  return std::any_of(relative.begin(), relative.end(),
                     [](const fs::path& part) { return part.string().starts_with('.'); });
}

/// Whether one of a list of entity tags is this one, or stands for any.
bool Names(const std::string& list, const std::string& etag) {
  for (std::string_view one : Split(list, ',')) {
    one = Trim(one);
    if (one.starts_with("W/")) one.remove_prefix(2);
    if (one == etag || one == "*") return true;
  }
  return false;
}

bool TakesGzip(const http::Request& request) {
  const std::string accepted = request.headers.Get("Accept-Encoding");
  for (const std::string_view part : Split(accepted, ',')) {
    const std::string_view coding = Trim(part);
    if (coding == "gzip" || (coding.starts_with("gzip;") && !coding.ends_with("q=0"))) return true;
  }
  return false;
}

http::Response AnswerPageFile(const StaticFile& file, const http::Request& request) {
  http::Response response = AnswerStaticFile(file, request);
  response.headers.Set("Content-Security-Policy", kPolicy);
  response.headers.Set("Referrer-Policy", "same-origin");
  response.headers.Set("Cross-Origin-Opener-Policy", "same-origin");
  return response;
}

}  // namespace

Result<StaticFiles> ReadStaticFiles(const fs::path& folder, StaticLimits limits) {
  std::error_code failed;
  fs::recursive_directory_iterator entries(folder, failed);
  if (failed) return NotFound("folder " + folder.string() + ": " + failed.message());
  StaticFiles files;
  std::size_t bytes = 0;
  for (; entries != fs::recursive_directory_iterator(); entries.increment(failed)) {
    const fs::path relative = entries->path().lexically_relative(folder);
    std::error_code ignored;
    if (entries->is_symlink(ignored) || !entries->is_regular_file(ignored) || IsHidden(relative)) {
      continue;
    }
    const char* content_type = ContentTypeOf(relative);
    if (content_type == nullptr) continue;
    std::optional<std::string> body = Content(entries->path());
    if (!body) return Internal("file " + entries->path().string() + " cannot be read");
    bytes += body->size();
    if (bytes > limits.bytes || files.size() >= limits.files) {
      return Error{ErrorCode::kResourceExhausted, "folder " + folder.string() +
                                                      " holds more than " +
                                                      std::to_string(limits.files) + " files or " +
                                                      std::to_string(limits.bytes) + " bytes"};
    }
    StaticFile& file = files[relative.generic_string()];
    file.content_type = content_type;
    file.etag = '"' + security::Sha256Hex(*body).substr(0, 32) + '"';
    file.body = std::move(*body);
    const fs::path packed = entries->path().string() + ".gz";
    if (fs::is_regular_file(packed, ignored)) file.gzipped = Content(packed).value_or("");
  }
  if (failed) return Internal("folder " + folder.string() + ": " + failed.message());
  return files;
}

http::Response AnswerStaticFile(const StaticFile& file, const http::Request& request) {
  http::Response response;
  // Kept, but asked about each time: a page and its script always belong together.
  response.headers = {{"Cache-Control", "no-cache"}, {"ETag", file.etag}};
  if (!file.gzipped.empty()) response.headers.Add("Vary", "Accept-Encoding");
  if (Names(request.headers.Get("If-None-Match"), file.etag)) {
    response.status = 304;
    return response;
  }
  response.headers.Add("Content-Type", file.content_type);
  if (!file.gzipped.empty() && TakesGzip(request)) {
    response.headers.Add("Content-Encoding", "gzip");
    response.body = file.gzipped;
  } else {
    response.body = file.body;
  }
  return response;
}

Status AddPage(http::Server& server, const StaticFiles& files) {
  if (!files.contains("index.html")) return InvalidArgument("there is no index.html");
  for (const auto& [path, file] : files) {
    const auto answer =
        [shared = std::make_shared<const StaticFile>(file)](const http::Request& request) {
          return AnswerPageFile(*shared, request);
        };
    const std::string pattern = path == "index.html" ? "/" : "/" + path;
    if (Status added = server.Route(http::Method::kGet, pattern, answer, {.quick = true}); !added) {
      return added;
    }
  }
  return {};
}

Status AddPageMissing(http::Server& server, const std::string& looked_in) {
  const std::string text =
      "This is exemplar-gateway. Its web page was not found (looked in " + looked_in +
      ").\nTo build it: deploy/build, where npm is installed; or say where it is: "
      "exemplar-gateway --web DIR.\nEverything else is here: /healthz, /openapi.json, /metrics.\n";
  return server.Route(http::Method::kGet, "/",
                      [text](const http::Request&) { return http::Answer(text); }, {.quick = true});
}

Status AddFiles(http::Server& server, const std::string& prefix, StaticFiles files) {
  const auto shared = std::make_shared<const StaticFiles>(std::move(files));
  return server.Route(http::Method::kGet, prefix + "{path=**}",
                      [shared](const http::Request& request) {
                        const std::string& path = request.variables.at("path");
                        const auto file = shared->find(path);
                        if (file == shared->end())
                          return http::ErrorAnswer(NotFound("there is no file " + path));
                        return AnswerStaticFile(file->second, request);
                      });
}

}  // namespace exemplar::gateway
