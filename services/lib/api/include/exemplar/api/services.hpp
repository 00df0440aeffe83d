#pragma once
// What the services offer, in the domain's own values. Each interface has one implementation in the
// service that does the work and one in rpc/ that calls it over gRPC.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/demonstration/motion.hpp"
#include "exemplar/demonstration/trial.hpp"
#include "exemplar/learning/skill.hpp"
#include "exemplar/learning/suggest.hpp"

namespace exemplar::api {

// ---------------------------------------------------------------- trials

struct TrialInfo {
  std::string id;
  std::string skill;
  std::string source;
  Stamp submitted;
  double duration_s = 0;
  std::vector<std::string> streams;  ///< "joints (9)", "end effector", "object target", ...
  std::uint64_t samples = 0;
  std::vector<std::string> notices;
  std::string person = {};  ///< whose demonstration it is, a pseudonymous id; empty: unknown
};

struct SubmitResult {
  TrialInfo info;
  bool duplicate = false;  ///< the same trial was there already; nothing was stored twice
};

struct TrialSegments {
  std::string id;
  std::vector<double> time_s;
  learning::Segmentation segmentation;
};

/// Implementations are thread-safe.
class TrialApi {
 public:
  virtual ~TrialApi() = default;
  /// `file` is a CSV or MCAP file's bytes; `name` its name (for errors, and to tell the format by
  /// the ending; content decides where the ending does not). Durable when it returns. `person`
  /// empty: as the recording's metadata "person" says, else unknown.
  virtual Result<SubmitResult> Submit(const std::string& skill, const std::string& name,
                                      std::string file, const std::string& person = {}) = 0;
  /// Empty: of all skills, of everybody.
  virtual Result<std::vector<TrialInfo>> List(const std::string& skill,
                                              const std::string& person = {}) = 0;
  virtual Result<TrialInfo> Get(const std::string& id) = 0;
  virtual Result<demonstration::Trial> Load(const std::string& id) = 0;
  /// Of a stored trial, or of a file that is not stored.
  virtual Result<TrialSegments> Segments(const std::string& id,
                                         const std::map<std::string, std::string>& options) = 0;
  virtual Result<TrialSegments> SegmentsOfFile(
      const std::string& name, std::string file,
      const std::map<std::string, std::string>& options) = 0;
  virtual Result<std::string> ExportCsv(const std::string& id) = 0;
  virtual Status Delete(const std::string& id) = 0;
  /// Whose demonstration a trial is (empty: unknown): of a stored one, or of one that a skill
  /// version was learned from.
  virtual Status SetPerson(const std::string& /*id*/, const std::string& /*person*/) {
    return FailedPrecondition("these trials keep no persons");
  }
};

// ---------------------------------------------------------------- skills

struct SkillInfo {
  std::string name;
  int version = 0;  ///< the current one
  int versions = 0;
  std::string method;
  std::string target;
  int trials = 0;
  Stamp learned;
};

struct VersionInfo {
  int version = 0;
  bool current = false;
  std::string method;
  std::vector<std::string> trial_ids;
  Stamp learned;
};

/// Implementations are thread-safe; Query never waits for Learn.
class SkillApi {
 public:
  virtual ~SkillApi() = default;
  virtual Result<learning::SkillReport> Learn(const std::string& name,
                                              const std::map<std::string, std::string>& options,
                                              const learning::Progress& progress,
                                              std::stop_token stop) = 0;
  virtual Result<std::vector<SkillInfo>> List() = 0;
  /// version 0: the current one.
  virtual Result<learning::SkillReport> Show(const std::string& name, int version) = 0;
  virtual Result<std::vector<VersionInfo>> Versions(const std::string& name) = 0;
  virtual Status Rollback(const std::string& name, int version) = 0;
  virtual Status Delete(const std::string& name) = 0;
  virtual Result<demonstration::SkillMotion> Query(const std::string& name, int version,
                                                   const demonstration::SkillQuery& query) = 0;
  /// Against a trial file that is not part of the skill.
  virtual Result<learning::Evaluation> Evaluate(const std::string& name, int version,
                                                const std::string& file_name, std::string file) = 0;
  /// Where another demonstration would tell most.
  virtual Result<learning::Suggestions> Suggest(const std::string& name, int version,
                                                const learning::SuggestOptions& options) = 0;
  /// The skill as a JSON document: learning::ToJson(skill) with its "inspection" beside it. Figures
  /// are drawn from it.
  virtual Result<std::string> ExportJson(const std::string& name, int version) = 0;
};

// ---------------------------------------------------------------- executor

struct ExecuteRequest {
  std::string skill;
  int version = 0;
  std::vector<geometry::NamedPose> objects;  ///< empty: as seen on ircp/objects
  /// Where the motion is to begin; the robot goes there first. Absent: where the tool is now.
  std::optional<geometry::Pose> start;
  double speed = 1.0;  ///< 0 < speed <= 1
  /// The skill's target moves, and is followed as it is seen on ircp/objects.
  bool follow = false;
  /// Who asks: named to others while the robot is this execution's. Over the network: the call's
  /// request id.
  std::string client = {};
  /// For callers over the network: Execute returns once the robot moves (the result's state says
  /// so), and the end of the call does not end the motion. Implementations need not look at it.
  bool detached = false;
};

struct PlanSummary {
  double duration_s = 0;
  int frames = 0;
  double max_position_error_m = 0;
  double max_contact_error_m = 0;
  double clearance_m = 0;
  std::string clearance_between;  ///< "forearm and table"
  double time_stretch = 1;
  std::vector<std::string> warnings;
};

struct ExecutionFeedback {
  std::string state;  ///< "planning", "executing", ...
  double time_s = 0;
  double duration_s = 0;
  double tracking_error_rad = 0;
  double touch_n = 0;
};

struct ExecutionResult {
  std::string state;  ///< "done", "aborted", ...
  std::string detail;
  PlanSummary plan;
  double tracking_error_rad = 0;  ///< largest
  double clearance_m = 0;         ///< smallest of the measured states
  std::optional<double>
      contact_error_m;  ///< measured tool to contact point, smallest within the contact window
  std::optional<double> touch_onset_s;
  double touch_max_n = 0;
  std::uint64_t commands_sent = 0;
  double lateness_p99_s = 0;
  double lateness_max_s = 0;
  std::vector<geometry::NamedPose> objects;  ///< poses that were used
  std::vector<geometry::Pose> base_T_tool;   ///< as measured, with its times, for figures
  std::vector<double> tool_time_s;
};

struct SeenObject {
  geometry::NamedPose pose;
  double age_s = 0;
};

struct RobotStatus {
  std::string state;
  std::string detail;
  double speed = 1;
  std::vector<std::string> joint_names;
  Eigen::VectorXd joints;  ///< empty when no state was received
  double state_age_s = 0;
  geometry::Pose base_T_tool;
  std::vector<SeenObject> objects;
};

struct TeleoperationRequest {
  std::string suit;                ///< source of ircp/suit; empty: the first that is heard
  std::vector<std::string> touch;  ///< objects of the scene that the touch links may touch
  /// As ExecuteRequest's: Teleoperate returns once the mode is on, and the end of the call does not
  /// end the mode.
  bool detached = false;
};

struct TeleoperationFeedback {
  std::string state;   ///< "teleoperating", ...
  std::string phase;   ///< "holding", "approaching", "following", "blocked"
  std::string detail;  ///< why it holds, what is in the way
  double time_s = 0;
  double behind_rad = 0;          ///< largest: the operator's posture against the commanded one
  std::string behind_joint;       ///< which joint that is
  double tracking_error_rad = 0;  ///< largest: commanded against measured
  double touch_n = 0;
  std::optional<double> clearance_m;  ///< of the last measured state
  double suit_rate_hz = 0;
};

struct TeleoperationResult {
  std::string state;  ///< "done", "aborted", "protective_stop", ...
  std::string detail;
  double duration_s = 0;
  double following_s = 0;  ///< the approach aside
  std::uint64_t suit_samples = 0;
  std::uint64_t suit_samples_left_out = 0;  ///< malformed, late, of another suit
  std::uint64_t commands_sent = 0;
  std::uint64_t holds = 0;
  std::uint64_t blocks = 0;
  double tracking_error_rad = 0;      ///< largest
  std::optional<double> clearance_m;  ///< smallest of the measured states
  double touch_max_n = 0;
  /// From the reception of a suit sample until its command was handed over for writing.
  double latency_p50_s = 0;
  double latency_p99_s = 0;
  double latency_max_s = 0;
};

/// Implementations are thread-safe.
class ExecutorApi {
 public:
  virtual ~ExecutorApi() = default;
  virtual Result<PlanSummary> Plan(const ExecuteRequest& request) = 0;
  /// Returns at the end of the motion. Feedback comes about ten times a second.
  virtual Result<ExecutionResult> Execute(
      const ExecuteRequest& request, const std::function<void(const ExecutionFeedback&)>& feedback,
      std::stop_token stop) = 0;
  virtual Result<RobotStatus> GetStatus() = 0;
  virtual Status Pause() = 0;
  virtual Status Resume() = 0;
  virtual Status Cancel() = 0;
  virtual Status Stop() = 0;
  virtual Status Reset() = 0;
  virtual Status SetSpeed(double factor) = 0;
  /// The robot follows ircp/suit while the dead-man on ircp/safety is held. Returns when the mode
  /// has ended and the robot rests. Feedback comes about ten times a second.
  virtual Result<TeleoperationResult> Teleoperate(
      const TeleoperationRequest& /*request*/,
      const std::function<void(const TeleoperationFeedback&)>& /*feedback*/,
      std::stop_token /*stop*/) {  // NOLINT(performance-unnecessary-value-param): as overridden
    return FailedPrecondition("this executor cannot be teleoperated");
  }
  virtual Status EndTeleoperation() {
    return FailedPrecondition("this executor cannot be teleoperated");
  }
};

// ---------------------------------------------------------------- recorder

struct RecordStart {
  std::string name;  ///< of the file, without ending; empty: made from the time
  std::map<std::string, std::string> metadata;
  std::vector<std::string> expected_topics;  ///< wait until these have a writer; may be empty
  double timeout_s = 5;
  /// A new file (NAME_0001.mcap, ...) after this much; 0: as the recorder was told.
  std::uint64_t split_bytes = 0;
  double split_s = 0;
};

/// Something happened that is worth keeping: in a recording it is marked; without one, a recording
/// begins that holds the seconds before it as well.
struct RecordEvent {
  std::string note;
  std::string name;                             ///< of a recording that begins; as RecordStart's
  std::map<std::string, std::string> metadata;  ///< likewise
};

struct TopicFigures {
  std::string topic;
  std::string type;
  std::uint64_t sent = 0;  ///< since the first one that came, up to the last announced one
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  double rate_hz = 0;
  bool has_schema = false;
  int writers = 0;
};

struct RecorderStatus {
  std::string state;  ///< closed, ready, recording, paused, stopped
  std::string detail;
  std::string file;  ///< the present or last one, absolute
  double duration_s = 0;
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;
  std::vector<TopicFigures> topics;  ///< since the recorder started
  std::uint64_t lost = 0;            ///< of all topics, since the recorder started
  double rate_hz = 0;                ///< samples a second of all topics
  double bytes_per_s = 0;            ///< their bytes
  std::uint64_t disk_free_bytes = 0;
  int part = 0;                ///< of a recording that is split, from 1; else 0
  int pauses = 0;              ///< of this recording
  std::uint64_t left_out = 0;  ///< samples that came while it was paused
  double buffered_s = 0;       ///< what an event would keep from before it
};

/// Implementations are thread-safe.
class RecorderApi {
 public:
  virtual ~RecorderApi() = default;
  virtual Result<RecorderStatus> Start(const RecordStart& request) = 0;
  virtual Result<RecorderStatus> Stop() = 0;
  virtual Result<RecorderStatus> Pause() = 0;
  virtual Result<RecorderStatus> Resume() = 0;
  virtual Result<RecorderStatus> MarkEvent(const RecordEvent& event) = 0;
  virtual Result<RecorderStatus> GetStatus() = 0;
};

}  // namespace exemplar::api
