#pragma once
// Values as words of the command line, and as text and JSON.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/api/services.hpp"
#include "exemplar/base/result.hpp"

namespace exemplar::cli {

/// "x,y,z" or "x,y,z,qx,qy,qz,qw" (m; the quaternion is made unit). The error names `option`.
struct ReadPose {
  geometry::Pose pose;
  bool has_orientation = false;
};
Result<ReadPose> ParsePose(std::string_view text, std::string_view option);
/// "NAME=x,y,z[,qx,qy,qz,qw]"; no name twice.
Result<std::vector<geometry::NamedPose>> ParseObjects(const std::vector<std::string>& words);
/// "1,2,3" or "elbow=1,wrist=2".
Status ParseJointStart(std::string_view text, demonstration::SkillQuery& query);
/// "name=value", each name once. The error names `option`.
Result<std::map<std::string, std::string>> ParsePairs(const std::vector<std::string>& words,
                                                      std::string_view option);

nlohmann::json ToJson(const geometry::Pose& pose, bool has_orientation);
nlohmann::json ToJson(const geometry::NamedPose& pose);
nlohmann::json ToJson(const api::TrialInfo& info);
nlohmann::json ToJson(const api::TrialSegments& segments);
nlohmann::json ToJson(const api::SkillInfo& info);
nlohmann::json ToJson(const api::VersionInfo& info);
nlohmann::json ToJson(const learning::Suggestions& suggestions);
nlohmann::json ToJson(const demonstration::SkillQuery& query);
nlohmann::json ToJson(const demonstration::SkillMotion& motion);
nlohmann::json ToJson(const learning::Evaluation& evaluation);
nlohmann::json ToJson(const api::PlanSummary& plan);
nlohmann::json ToJson(const api::ExecutionResult& result);
nlohmann::json ToJson(const api::RobotStatus& status);
nlohmann::json ToJson(const api::RecorderStatus& status);

/// "0.400 -0.200 0.050", with " (no orientation)" or the quaternion behind it.
std::string PoseText(const geometry::Pose& pose, bool has_orientation);
/// Without the fraction: "2026-11-22 03:24:33Z".
std::string TimeText(Stamp stamp);

}  // namespace exemplar::cli
