#pragma once
// A skill that needs no learning service.

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/api/services.hpp"

namespace exemplar::executor::test {

inline const Eigen::Vector3d kTarget(0.6, -0.2, 0.04);

/// A learning service that knows one skill: press the target from above.
class PressSkill final : public api::SkillApi {
 public:
  Result<learning::SkillReport> Learn(const std::string&, const std::map<std::string, std::string>&,
                                      const learning::Progress&, std::stop_token) override {
    return Internal("not asked here");
  }
  Result<std::vector<api::SkillInfo>> List() override { return std::vector<api::SkillInfo>{}; }
  Result<learning::SkillReport> Show(const std::string& name, int) override {
    if (name != "press") return NotFound("no skill \"" + name + "\"", "skill");
    learning::SkillReport report;
    report.target = "target";
    return report;
  }
  Result<std::vector<api::VersionInfo>> Versions(const std::string&) override {
    return std::vector<api::VersionInfo>{};
  }
  Status Rollback(const std::string&, int) override { return {}; }
  Status Delete(const std::string&) override { return {}; }
  Result<learning::Evaluation> Evaluate(const std::string&, int, const std::string&,
                                        std::string) override {
    return Internal("not asked here");
  }
  Result<learning::Suggestions> Suggest(const std::string&, int,
                                        const learning::SuggestOptions&) override {
    return Internal("not asked here");
  }
  Result<std::string> ExportJson(const std::string&, int) override { return std::string("{}"); }

  Result<demonstration::SkillMotion> Query(const std::string& name, int,
                                           const demonstration::SkillQuery& query) override {
    if (error) return *error;
    if (name != "press") return NotFound("no skill \"" + name + "\"", "skill");
    last_query = query;
    if (on_query) on_query();
    demonstration::SkillMotion motion;
    motion.skill = name;
    motion.objects = query.objects;
    const Eigen::Vector3d target = query.objects.front().base_T_object.translation;
    const Eigen::Vector3d above = target + Eigen::Vector3d(0, 0, 0.08);
    const Eigen::Vector3d pressed = target - Eigen::Vector3d(0, 0, 0.003);
    const geometry::Pose start = *query.start;
    int first = -1;
    int last = -1;
    for (int k = 0; k <= 180; ++k) {
      const double t = k / 60.0;
      Eigen::Vector3d p = start.translation + Ease(t) * (above - start.translation);
      p += Ease((t - 1.0) / 0.6) * (pressed - above);
      p += Ease((t - 2.0) / 0.8) * (above - pressed);
      motion.time_s.push_back(t);
      motion.base_T_tool.push_back({p, start.rotation});
      if (t > 1 && p.z() <= target.z()) {
        if (first < 0) first = k;
        last = k;
      }
    }
    motion.contacts.push_back({"target", first, last, target, true});
    return motion;
  }

  std::optional<Error> error;
  std::function<void()> on_query;
  std::optional<demonstration::SkillQuery> last_query;

 private:
  static double Ease(double r) {
    r = std::clamp(r, 0.0, 1.0);
    return r * r * r * (10 - 15 * r + 6 * r * r);
  }
};

}  // namespace exemplar::executor::test
