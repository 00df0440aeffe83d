// Any bytes go through the CSV reader. What it takes is a valid trial that can be written and read.

#include <cstdlib>
#include <string_view>

#include "exemplar/demonstration/csv.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace exemplar::demonstration;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const exemplar::Result<Trial> trial = ReadCsv(text, "fuzz.csv");
  if (!trial.ok()) return 0;
  if (!Validate(*trial).ok()) std::abort();
  if (!ReadCsv(WriteCsv(*trial), "written.csv").ok()) std::abort();
  return 0;
}
