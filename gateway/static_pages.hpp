#pragma once
// Files for browsers: read once, at the start; nothing else is ever served.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "exemplar/base/result.hpp"
#include "exemplar/http/server.hpp"

namespace exemplar::gateway {

struct StaticFile {
  std::string content_type;
  std::string etag;  ///< of the content, quoted
  std::string body;
  std::string gzipped = {};  ///< the same packed, from the file NAME.gz beside it; empty: none
};
/// By their paths below the folder, '/' between.
using StaticFiles = std::map<std::string, StaticFile, std::less<>>;

struct StaticLimits {
  std::size_t files = 2000;
  std::size_t bytes = std::size_t{256} << 20;
};

/// The regular files in `folder` and below whose endings a page or a robot's description has
/// (.html, .js, .urdf, .stl, ...). Hidden files are left out and links below the folder not
/// followed. Errors: kNotFound: no such folder; kResourceExhausted: more than the limits.
Result<StaticFiles> ReadStaticFiles(const std::filesystem::path& folder, StaticLimits limits = {});

/// 200, or 304 for a browser that has it; packed where the browser takes that.
http::Response AnswerStaticFile(const StaticFile& file, const http::Request& request);

/// The page: index.html at "/", every file at "/NAME", with the headers that keep a page to itself.
/// kInvalidArgument: there is no index.html.
Status AddPage(http::Server& server, const StaticFiles& files);

/// What stands at "/" where no page was built or found.
Status AddPageMissing(http::Server& server, const std::string& looked_in);

/// Every file at `prefix` + its path ("/robot/files/" + "meshes/hand.stl").
Status AddFiles(http::Server& server, const std::string& prefix, StaticFiles files);

}  // namespace exemplar::gateway
