#pragma once
// Trials in, a skill out; a skill and a situation in, a motion out. Pure functions.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/demonstration/motion.hpp"
#include "exemplar/learning/aligned.hpp"

namespace exemplar::learning {

/// How well a method predicted each trial from the others, inside the training set.
struct MethodScore {
  std::string method;
  double frechet_m = 0;
  double end_error_m = 0;
  std::vector<double> frechet_by_trial_m;
  bool chosen = false;
};

/// What learning found, for people and programs.
struct SkillReport {
  std::string skill;
  int version = 0;
  std::string method;  ///< chosen one
  std::string target;
  std::map<std::string, std::string> options;
  int frames = 0;
  double duration_s = 0;
  std::vector<std::string> joint_names;
  struct TrialPart {
    std::string id;
    std::string source;
    double duration_s = 0;
    int candidates = 0;             ///< beginnings found
    std::vector<double> markers_s;  ///< chosen, own time
    double c = 0, k = 0;
    double cutoff_hz = 0;
    geometry::Pose base_T_target;
    std::vector<std::string> notes;  ///< outlier, no contact where others have it, drags N_min down
  };
  std::vector<TrialPart> trials;
  std::vector<double> markers_s;  ///< common time
  /// A meeting of the tool with an object, on the common time.
  struct ContactPart {
    std::string object;
    double begin_s = 0, end_s = 0;
    Eigen::Vector3d object_p_contact = Eigen::Vector3d::Zero();  ///< mean, in the object's frame
    double spread_m = 0;
    bool touch_measured = false;
  };
  std::vector<ContactPart> contacts;  ///< all, in time order
  /// Of the first one with the target; the same for the two members that follow.
  std::optional<double> contact_begin_s, contact_end_s;
  Eigen::Vector3d target_p_contact =
      Eigen::Vector3d::Zero();  ///< mean contact point in the target's frame
  double contact_spread_m = 0;
  double mean_correlation = 0, plain_correlation = 0;
  std::vector<MethodScore> methods;
  std::vector<std::string> notes;  ///< what was chosen, and why
  std::vector<std::string> warnings;
};

/// All that is learned. An opaque immutable value; cheap to copy, thread-safe.
class Skill {
 public:
  struct Data;
  explicit Skill(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  const SkillReport& report() const;
  const Alignment& alignment() const;
  const Data& data() const { return *data_; }
  /// The same skill under another name and version.
  Skill Named(std::string name, int version) const;

 private:
  std::shared_ptr<const Data> data_;
};

/// A trial and what the store calls it.
struct NamedTrial {
  std::string id;
  demonstration::Trial trial;
};

/// PAPER.md sections 3 to 5. `tool`: the robot model for trials that have joints but no poses; its
/// joints may be a subset of the trials'. Errors name trial and stream. The result's joints are the
/// model's chain where there is one, else all joints of the trials.
Result<Skill> LearnSkill(std::span<const NamedTrial> trials, const LearnOptions& options,
                         std::shared_ptr<const demonstration::ToolKinematics> tool = nullptr,
                         const Progress& progress = {}, std::stop_token stop = {});

/// The motion for a situation. Errors name the object; far extrapolation is answered with a
/// warning.
Result<demonstration::SkillMotion> Answer(const Skill& skill,
                                          const demonstration::SkillQuery& query);

/// Queries `skill` in the situation of `trial` (its object poses at contact, its start) and
/// compares the answer with what the person did there.
struct Evaluation {
  demonstration::Deviation deviation;
  demonstration::SkillMotion answer;
  demonstration::SkillQuery query;
};
Result<Evaluation> Evaluate(const Skill& skill, const demonstration::Trial& trial);

/// For storage and `--format json`. FromJson(ToJson(s)) answers every query as s does.
nlohmann::json ToJson(const SkillReport& report);
nlohmann::json ToJson(const Skill& skill);
Result<Skill> SkillFromJson(const nlohmann::json& json,
                            std::shared_ptr<const demonstration::ToolKinematics> tool = nullptr);

/// For storage: the JSON document in CBOR, its arrays of numbers as bytes of doubles.
/// SkillFromBytes also reads CBOR that has them as arrays, as versions up to 0.1 wrote it;
/// kDataLoss for what is neither.
std::string ToBytes(const Skill& skill);
Result<Skill> SkillFromBytes(std::string_view bytes,
                             std::shared_ptr<const demonstration::ToolKinematics> tool = nullptr);

}  // namespace exemplar::learning
