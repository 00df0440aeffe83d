#include "figure_files.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "exemplar/figures/figures.hpp"
#include "session.hpp"

namespace exemplar::cli {

Result<std::vector<std::string>> WriteFigures(const std::string& document,
                                              const std::string& folder) {
  const nlohmann::json json = nlohmann::json::parse(document, nullptr, false);
  if (!json.is_object()) {
    return Error{ErrorCode::kDataLoss, "the server's document of the skill is no JSON object"};
  }
  if (!json.contains("inspection")) {
    return FailedPrecondition(
        "the server's document of the skill has no part \"inspection\": it is older than this "
        "command");
  }
  const Result<learning::Skill> skill = learning::SkillFromJson(json);
  if (!skill) return skill.error();
  const Result<learning::Inspection> inspection =
      learning::InspectionFromJson(json.at("inspection"));
  if (!inspection) return inspection.error();

  const std::filesystem::path path(folder);
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path)) {
    return FailedPrecondition("--figures: cannot make folder " + folder +
                                  (error ? ": " + error.message() : ": a file has that name"),
                              "figures");
  }
  const std::vector<figures::Figure> all = figures::DrawFigures(
      {.report = skill->report(), .alignment = skill->alignment(), .inspection = *inspection});
  std::vector<std::string> lines;
  for (const figures::Figure& figure : all) {
    const std::string file = (path / figures::FileName(figure)).string();
    if (Status written = Write(figure.svg, file); !written) return written.error();
    lines.push_back(file + "  " + (figure.drawn ? figure.title : figure.caption));
  }
  const std::string index = (path / "index.html").string();
  const Status written = Write(figures::IndexHtml(skill->report(), all), index);
  if (!written) return written.error();
  lines.push_back(index + "  all of them with captions");
  return lines;
}

}  // namespace exemplar::cli
