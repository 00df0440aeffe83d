#include "recorder/schema_folder.hpp"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <vector>

#include "exemplar/base/text.hpp"

namespace exemplar::recorder {
namespace {

namespace fs = std::filesystem;

Result<std::string> ReadText(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(stream)), {});
  if (!stream) return NotFound(path.string() + ": cannot be read", "schema_dir");
  return text;
}

/// The text with its includes in place, and without preprocessor lines. `seen` are in it already.
Result<std::string> Flatten(const fs::path& path, const fs::path& root, std::set<fs::path>& seen) {
  if (!seen.insert(fs::weakly_canonical(path)).second) return std::string();
  const Result<std::string> text = ReadText(path);
  if (!text.ok()) return text;
  std::istringstream lines(*text);
  std::string flat;
  std::string line;
  while (std::getline(lines, line)) {
    const std::string_view trimmed = Trim(line);
    if (!trimmed.starts_with('#')) {
      flat += line + '\n';
      continue;
    }
    const std::size_t open = trimmed.find_first_of("\"<");
    const std::size_t close = trimmed.find_last_of("\">");
    if (trimmed.find("include") == std::string_view::npos || open == std::string_view::npos ||
        close <= open) {
      continue;
    }
    const std::string name(trimmed.substr(open + 1, close - open - 1));
    const fs::path beside = path.parent_path() / name;
    const fs::path target = fs::exists(beside) ? beside : root / name;
    if (!fs::exists(target)) {
      return NotFound(path.string() + ": includes " + name + ", which is not in " + root.string(),
                      "schema_dir");
    }
    const Result<std::string> included = Flatten(target, root, seen);
    if (!included.ok()) return included;
    flat += *included;
  }
  return flat;
}

/// Words and single signs, without comments and texts in quotes.
std::vector<std::string> Tokens(const std::string& idl) {
  std::vector<std::string> tokens;
  for (std::size_t i = 0; i < idl.size();) {
    const auto byte = static_cast<unsigned char>(idl[i]);
    if (idl.compare(i, 2, "//") == 0) {
      i = std::min(idl.find('\n', i), idl.size());
    } else if (idl.compare(i, 2, "/*") == 0) {
      const std::size_t end = idl.find("*/", i + 2);
      i = end == std::string::npos ? idl.size() : end + 2;
    } else if (idl[i] == '"') {
      const std::size_t end = idl.find('"', i + 1);
      i = end == std::string::npos ? idl.size() : end + 1;
    } else if (std::isalnum(byte) != 0 || idl[i] == '_') {
      std::size_t end = i;
      while (end < idl.size() &&
             (std::isalnum(static_cast<unsigned char>(idl[end])) != 0 || idl[end] == '_')) {
        ++end;
      }
      tokens.push_back(idl.substr(i, end - i));
      i = end;
    } else {
      if (std::isspace(byte) == 0) tokens.emplace_back(1, idl[i]);
      ++i;
    }
  }
  return tokens;
}

std::vector<std::string> StructsOf(const std::string& idl) {
  const std::vector<std::string> tokens = Tokens(idl);
  std::vector<std::string> scopes;  // one an open brace; empty where it is no module
  std::vector<std::string> structs;
  std::string pending;
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (tokens[i] == "{") {
      scopes.push_back(pending);
      pending.clear();
    } else if (tokens[i] == "}") {
      if (!scopes.empty()) scopes.pop_back();
    } else if (i + 2 < tokens.size() && tokens[i] == "module") {
      pending = tokens[i + 1];
    } else if (i + 2 < tokens.size() && tokens[i] == "struct" && tokens[i + 2] != ";") {
      std::string name;
      for (const std::string& scope : scopes) name += scope.empty() ? "" : scope + "::";
      structs.push_back(name + tokens[i + 1]);
    }
  }
  return structs;
}

}  // namespace

Result<std::map<std::string, std::string>> ReadSchemaFolder(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->is_regular_file() && entry->path().extension() == ".idl") {
      files.push_back(entry->path());
    }
  }
  if (error) return NotFound(folder.string() + ": " + error.message(), "schema_dir");
  std::sort(files.begin(), files.end());
  std::map<std::string, std::string> schemas;
  std::map<std::string, fs::path> declared;
  for (const fs::path& file : files) {
    std::set<fs::path> seen;
    const Result<std::string> flat = Flatten(file, folder, seen);
    if (!flat.ok()) return flat.error();
    const Result<std::string> own = ReadText(file);
    if (!own.ok()) return own.error();
    for (const std::string& name : StructsOf(*own)) {
      const auto [known, inserted] = declared.try_emplace(name, file);
      if (!inserted && schemas[name] != *flat) {
        return InvalidArgument(file.string() + ": declares " + name + ", as does " +
                                   known->second.string() + " differently",
                               "schema_dir");
      }
      schemas[name] = *flat;
    }
  }
  return schemas;
}

}  // namespace exemplar::recorder
