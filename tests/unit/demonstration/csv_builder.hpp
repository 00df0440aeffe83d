#pragma once
// Small CSV files for the tests, made in the test.

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "exemplar/demonstration/csv.hpp"

namespace exemplar::demonstration {

inline constexpr const char* kToolHeader = "time_s,ee_x_m,ee_y_m,ee_z_m,ee_qx,ee_qy,ee_qz,ee_qw";

/// A header and rows, each ended by a newline.
inline std::string Csv(const std::string& header, const std::vector<std::string>& rows) {
  std::string text = header + "\n";
  for (const std::string& row : rows) text += row + "\n";
  return text;
}

/// `count` rows of kToolHeader at 100 Hz.
inline std::vector<std::string> ToolRows(int count) {
  std::vector<std::string> rows;
  for (int i = 0; i < count; ++i) {
    const std::string n = std::to_string(i);
    rows.push_back(std::to_string(i / 100) + "." + (i % 100 < 10 ? "0" : "") +
                   std::to_string(i % 100) + ",0." + n + ",0.2,0.3,0,0,0,1");
  }
  return rows;
}

inline Trial MustRead(const std::string& text) {
  Result<Trial> trial = ReadCsv(text, "trial.csv");
  EXPECT_TRUE(trial.ok()) << trial.error().message;
  return trial.ok() ? *trial : Trial{};
}

inline std::string ErrorOf(const std::string& text) {
  const Result<Trial> trial = ReadCsv(text, "trial.csv");
  EXPECT_FALSE(trial.ok());
  return trial.ok() ? std::string() : trial.error().message;
}

}  // namespace exemplar::demonstration
