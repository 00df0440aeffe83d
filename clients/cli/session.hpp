#pragma once
// What all commands share: the server, the limits, and how things are said.

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "command_line.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/rpc/client.hpp"

namespace exemplar::cli {

/// The options that stand for every command.
struct Session {
  static constexpr const char* kDefaultServer = "127.0.0.1:50051";
  std::string server;  ///< empty: none was named
  std::optional<double> timeout_s;
  security::ClientCredentials credentials;

  /// Errors: as Connect.
  Result<rpc::ClientOptions> Options() const;
  /// Errors: an address or a limit that is none, credentials that cannot be read.
  Result<rpc::Clients> Connect() const;
};

/// Says "exemplar: what is wrong" on stderr, and what helps where that is known; returns the
/// contract's exit code.
int Fail(const Error& error);
/// The exit code of what a signal (Ctrl-C) ended before it was done.
inline constexpr int kInterrupted = 130;
/// Says that it was interrupted, and how things stand then ("nothing was changed").
int Interrupted(const std::string& standing);
/// Interrupted where the error comes from `stop`, else Fail.
int FailOrInterrupted(const Error& error, const std::stop_token& stop, const std::string& standing);
/// Fail for words of the command line that cannot be meant.
int FailUsage(const Error& error);
/// A line to a person at a terminal, on stderr; nothing in a pipe.
void Hint(const std::string& text);
/// "exemplar: warning: ..." on stderr, one a line.
void Warn(const std::vector<std::string>& warnings);

/// Adds `--format` with the first of `formats` as default.
void AddFormat(Command& command, std::string& format, const std::vector<std::string>& formats);

void Print(const nlohmann::json& json);
/// On one line, at once: for streams of objects.
void PrintLine(const nlohmann::json& json);
/// To stdout, or to a file that is written whole or not at all.
Status Write(std::string_view text, const std::string& output);

/// A file's bytes. kNotFound when there is none.
Result<std::string> ReadFile(const std::string& path);
/// The last part of a path.
std::string FileName(const std::string& path);

}  // namespace exemplar::cli
