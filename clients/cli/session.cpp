#include "session.hpp"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "exemplar/base/text.hpp"
#include "exemplar/program/runtime.hpp"
#include "screen.hpp"

namespace exemplar::cli {
namespace {

/// What can be done about it; empty where the error says so itself.
std::string_view RemedyOf(const Error& error) {
  switch (error.code) {
    case ErrorCode::kUnauthenticated:
      return error.field == "certificate"
                 ? "whoever keeps the station's files makes a certificate that has access:\n"
                   "  exemplar security issue FOLDER NAME --role person --call ROLE"
                 : "give a token with --token @FILE or EXEMPLAR_TOKEN; whoever keeps the station's "
                   "files makes one:\n  exemplar security token FOLDER NAME --role ROLE";
    case ErrorCode::kPermissionDenied:
      return "whoever keeps the station's files makes a token that has the role:\n"
             "  exemplar security token FOLDER NAME --role ROLE";
    case ErrorCode::kUnimplemented:
      return "is it the address of another service? The gateway serves them all";
    case ErrorCode::kUnavailable:
      if (!error.message.starts_with("no answer from ")) return {};
      return "does it run there? --server HOST:PORT or EXEMPLAR_SERVER names another; what is "
             "wrong "
             "on the way:\n  exemplar doctor --server HOST:PORT";
    default:
      return {};
  }
}

}  // namespace

Result<rpc::ClientOptions> Session::Options() const {
  rpc::ClientOptions options;
  options.server = server.empty() ? kDefaultServer : server;
  options.credentials = credentials;
  if (timeout_s) {
    constexpr double kLongest = 1e6;
    if (!(*timeout_s > 0 && *timeout_s <= kLongest)) {
      return InvalidArgument(
          "--timeout is " + FormatDouble(*timeout_s) + " s, must be over 0 and at most 1000000",
          "timeout");
    }
    options.timeout = FromSeconds(*timeout_s);
    options.long_timeout = options.timeout;
  }
  return options;
}

Result<rpc::Clients> Session::Connect() const {
  const Result<rpc::ClientOptions> options = Options();
  return options ? rpc::Connect(*options) : options.error();
}

int Fail(const Error& error) {
  const int code = program::Fail(Paint("exemplar", Colour::kRed, STDERR_FILENO), error);
  if (const std::string_view remedy = RemedyOf(error); !remedy.empty()) {
    std::cerr << "  " << remedy << '\n';
  }
  return code;
}

int Interrupted(const std::string& standing) {
  std::cerr << Paint("exemplar", Colour::kRed, STDERR_FILENO) << ": interrupted; " << standing
            << '\n';
  return kInterrupted;
}

int FailOrInterrupted(const Error& error, const std::stop_token& stop,
                      const std::string& standing) {
  const bool ours = stop.stop_requested() && error.code == ErrorCode::kCancelled;
  return ours ? Interrupted(standing) : Fail(error);
}

int FailUsage(const Error& error) {
  Fail(error);
  return kUsage;
}

void Hint(const std::string& text) {
  if (IsTerminal(STDOUT_FILENO)) std::cerr << text << '\n';
}

void Warn(const std::vector<std::string>& warnings) {
  const std::string word = Paint("warning", Colour::kYellow, STDERR_FILENO);
  for (const std::string& warning : warnings) {
    std::cerr << "exemplar: " << word << ": " << warning << '\n';
  }
}

void AddFormat(Command& command, std::string& format, const std::vector<std::string>& formats) {
  format = formats.front();
  command.Option("--format", "", format, "how the answer is printed").OneOf(formats);
}

void PrintLine(const nlohmann::json& json) {
  std::cout << json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << std::endl;
}

void Print(const nlohmann::json& json) {
  std::cout << json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
}

Status Write(std::string_view text, const std::string& output) {
  if (output.empty() || output == "-") {
    std::cout << text << std::flush;
    if (!std::cout) return Internal("stdout cannot be written");
    return {};
  }
  const std::string part = output + ".part";
  {
    std::ofstream file(part, std::ios::binary | std::ios::trunc);
    file << text;
    file.flush();
    if (!file) {
      std::filesystem::remove(part);
      return Internal(output + ": cannot be written");
    }
  }
  std::error_code error;
  std::filesystem::rename(part, output, error);
  if (error) return Internal(output + ": " + error.message());
  return {};
}

Result<std::string> ReadFile(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return NotFound("there is no file " + path, "file");
  if (std::filesystem::is_directory(status)) {
    return InvalidArgument(path + " is a folder, must be a file", "file");
  }
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  // An empty file sets failbit on `bytes`: it is read nonetheless.
  if (!file.is_open() || file.bad()) return InvalidArgument(path + ": cannot be read", "file");
  return std::move(bytes).str();
}

std::string FileName(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

}  // namespace exemplar::cli
