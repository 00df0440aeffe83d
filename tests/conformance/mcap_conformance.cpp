// Runs one case of the MCAP format's conformance suite: see --help.

#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>

#include "exemplar/recording/file.hpp"
#include "mcap_json.hpp"

namespace exemplar::conformance {
namespace {

constexpr const char* kUsage =
    "usage: mcap_conformance write CASE.json          writes the case's MCAP bytes to stdout\n"
    "       mcap_conformance read CASE.mcap           prints its records, read front to back\n"
    "       mcap_conformance read-indexed CASE.mcap   prints its records, read by the indexes\n";

int Fail(const std::string& file, const Error& error) {
  std::cerr << file << ": " << error.message << "\n";
  return 1;
}

int Write(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return Fail(file, NotFound("cannot be opened"));
  std::ostringstream text;
  text << stream.rdbuf();
  const Result<recording::Bytes> bytes = WriteCase(text.str());
  if (!bytes.ok()) return Fail(file, bytes.error());
  std::cout.write(reinterpret_cast<const char*>(bytes->data()),
                  static_cast<std::streamsize>(bytes->size()));
  std::cout.flush();
  return std::cout ? 0 : 1;
}

int Read(const std::string& file, bool indexed) {
  const Result<std::unique_ptr<recording::FileSource>> source = recording::FileSource::Open(file);
  if (!source.ok()) {
    std::cerr << source.error().message << "\n";
    return 1;
  }
  const Result<std::string> json = indexed ? ReadIndexed(**source) : ReadStreamed(**source);
  if (!json.ok()) return Fail(file, json.error());
  std::cout << *json << "\n";
  return 0;
}

}  // namespace
}  // namespace exemplar::conformance

int main(int argc, char** argv) {
  const std::string_view command = argc > 1 ? argv[1] : "";
  if (command == "--help") {
    std::cout << exemplar::conformance::kUsage;
    return 0;
  }
  if (argc == 3 && command == "write") return exemplar::conformance::Write(argv[2]);
  if (argc == 3 && command == "read") return exemplar::conformance::Read(argv[2], false);
  if (argc == 3 && command == "read-indexed") return exemplar::conformance::Read(argv[2], true);
  std::cerr << exemplar::conformance::kUsage;
  return 2;
}
