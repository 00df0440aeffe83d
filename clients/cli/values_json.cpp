#include <nlohmann/json.hpp>

#include "values.hpp"

namespace exemplar::cli {

using nlohmann::json;

namespace {

json FromVector(const Eigen::VectorXd& vector) {
  return std::vector<double>(vector.data(), vector.data() + vector.size());
}

json FromPoint(const Eigen::Vector3d& point) { return {point.x(), point.y(), point.z()}; }

/// A list of rows.
json FromMatrix(const Eigen::MatrixXd& matrix) {
  json rows = json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) rows.push_back(FromVector(matrix.row(i)));
  return rows;
}

json FromPoses(const std::vector<geometry::Pose>& poses, bool has_orientation) {
  json list = json::array();
  for (const geometry::Pose& pose : poses) list.push_back(ToJson(pose, has_orientation));
  return list;
}

template <class Value>
json FromList(const std::vector<Value>& values, json (*from)(const Value&)) {
  json list = json::array();
  for (const Value& value : values) list.push_back(from(value));
  return list;
}

json FromObjects(const std::vector<geometry::NamedPose>& objects) {
  json list = json::array();
  for (const geometry::NamedPose& object : objects) list.push_back(ToJson(object));
  return list;
}

json FromContact(const demonstration::Contact& contact) {
  return {{"object", contact.object},
          {"first", contact.first},
          {"last", contact.last},
          {"base_p_contact", FromPoint(contact.base_p_contact)},
          {"touch_measured", contact.touch_measured}};
}

json FromMarker(const learning::Marker& marker) {
  return {{"time_s", marker.time_s},
          {"frame", marker.frame},
          {"kind", marker.kind == learning::MarkerKind::kBeginning ? "beginning" : "ending"},
          {"cause", marker.cause},
          {"score", marker.score}};
}

json FromOptional(const std::optional<double>& value) { return value ? json(*value) : json(); }

}  // namespace

json ToJson(const geometry::Pose& pose, bool has_orientation) {
  json object = {{"position", FromPoint(pose.translation)}, {"has_orientation", has_orientation}};
  if (has_orientation) {
    const auto& q = pose.rotation;
    object["quaternion"] = {q.x(), q.y(), q.z(), q.w()};
  }
  return object;
}

json ToJson(const geometry::NamedPose& pose) {
  json object = ToJson(pose.base_T_object, pose.has_orientation);
  object["name"] = pose.name;
  return object;
}

json ToJson(const api::TrialInfo& info) {
  return {{"id", info.id},
          {"skill", info.skill},
          {"source", info.source},
          {"submitted", ToIso8601(info.submitted)},
          {"duration_s", info.duration_s},
          {"samples", info.samples},
          {"streams", info.streams},
          {"notices", info.notices},
          {"person", info.person}};
}

json ToJson(const api::TrialSegments& segments) {
  const learning::Segmentation& segmentation = segments.segmentation;
  return {{"id", segments.id},
          {"c", segmentation.c},
          {"k", segmentation.k},
          {"c_tactile", segmentation.c_tactile},
          {"c_replaced", segmentation.c_replaced},
          {"markers", FromList(segmentation.markers, FromMarker)},
          {"time_s", segments.time_s},
          {"msv", FromVector(segmentation.msv)},
          {"touch_term", FromVector(segmentation.touch_term)},
          {"c_along", FromVector(segmentation.c_along)},
          {"high_along", FromVector(segmentation.high_along)}};
}

json ToJson(const learning::Suggestions& suggestions) {
  json places = json::array();
  for (const learning::Suggestion& place : suggestions.places) {
    places.push_back({{"target", ToJson(place.target)},
                      {"sigma_m", place.sigma_m},
                      {"nearest_trial_m", place.nearest_trial_m},
                      {"reason", place.reason}});
  }
  return {{"places", std::move(places)},
          {"typical_sigma_m", suggestions.typical_sigma_m},
          {"notes", suggestions.notes}};
}

json ToJson(const api::SkillInfo& info) {
  return {{"name", info.name},
          {"version", info.version},
          {"versions", info.versions},
          {"method", info.method},
          {"target", info.target},
          {"trials", info.trials},
          {"learned", ToIso8601(info.learned)}};
}

json ToJson(const api::VersionInfo& info) {
  return {{"version", info.version},
          {"current", info.current},
          {"method", info.method},
          {"trial_ids", info.trial_ids},
          {"learned", ToIso8601(info.learned)}};
}

json ToJson(const demonstration::SkillQuery& query) {
  json object = {{"objects", FromObjects(query.objects)}};
  if (query.start) object["start"] = ToJson(*query.start, query.start_has_orientation);
  if (query.joint_start) {
    object["joint_start_names"] = query.joint_start_names;
    object["joint_start"] = FromVector(*query.joint_start);
  }
  return object;
}

json ToJson(const demonstration::SkillMotion& motion) {
  return {{"skill", motion.skill},
          {"version", motion.version},
          {"time_s", motion.time_s},
          {"joint_names", motion.joint_names},
          {"joints", FromMatrix(motion.joints)},
          {"base_T_tool", FromPoses(motion.base_T_tool, motion.has_orientation)},
          {"hand_open", motion.hand_open},
          {"object_names", motion.object_names},
          {"objectivity", FromMatrix(motion.objectivity)},
          {"sigma_m", motion.sigma_m},
          {"markers_s", motion.markers_s},
          {"contacts", FromList(motion.contacts, FromContact)},
          {"objects", FromObjects(motion.objects)},
          {"warnings", motion.warnings}};
}

json ToJson(const learning::Evaluation& evaluation) {
  return {{"deviation",
           {{"frechet_m", evaluation.deviation.frechet_m},
            {"end_error_m", evaluation.deviation.end_error_m},
            {"end_angle_rad", evaluation.deviation.end_angle_rad}}},
          {"query", ToJson(evaluation.query)},
          {"answer", ToJson(evaluation.answer)}};
}

json ToJson(const api::PlanSummary& plan) {
  return {{"duration_s", plan.duration_s},
          {"frames", plan.frames},
          {"max_position_error_m", plan.max_position_error_m},
          {"max_contact_error_m", plan.max_contact_error_m},
          {"clearance_m", plan.clearance_m},
          {"clearance_between", plan.clearance_between},
          {"time_stretch", plan.time_stretch},
          {"warnings", plan.warnings}};
}

json ToJson(const api::ExecutionResult& result) {
  return {{"state", result.state},
          {"detail", result.detail},
          {"plan", ToJson(result.plan)},
          {"tracking_error_rad", result.tracking_error_rad},
          {"clearance_m", result.clearance_m},
          {"contact_error_m", FromOptional(result.contact_error_m)},
          {"touch_onset_s", FromOptional(result.touch_onset_s)},
          {"touch_max_n", result.touch_max_n},
          {"commands_sent", result.commands_sent},
          {"lateness_p99_s", result.lateness_p99_s},
          {"lateness_max_s", result.lateness_max_s},
          {"objects", FromObjects(result.objects)},
          {"tool_time_s", result.tool_time_s},
          {"base_T_tool", FromPoses(result.base_T_tool, true)}};
}

json ToJson(const api::RobotStatus& status) {
  json objects = json::array();
  for (const api::SeenObject& object : status.objects) {
    json seen = ToJson(object.pose);
    seen["age_s"] = object.age_s;
    objects.push_back(std::move(seen));
  }
  return {{"state", status.state},
          {"detail", status.detail},
          {"speed", status.speed},
          {"joint_names", status.joint_names},
          {"joints", FromVector(status.joints)},
          {"state_age_s", status.state_age_s},
          {"tool", ToJson(status.base_T_tool, true)},
          {"objects", std::move(objects)}};
}

json ToJson(const api::RecorderStatus& status) {
  json topics = json::array();
  for (const api::TopicFigures& topic : status.topics) {
    topics.push_back({{"topic", topic.topic},
                      {"type", topic.type},
                      {"sent", topic.sent},
                      {"received", topic.received},
                      {"lost", topic.lost},
                      {"rate_hz", topic.rate_hz},
                      {"has_schema", topic.has_schema},
                      {"writers", topic.writers}});
  }
  return {{"state", status.state},
          {"detail", status.detail},
          {"file", status.file},
          {"duration_s", status.duration_s},
          {"messages", status.messages},
          {"bytes", status.bytes},
          {"lost", status.lost},
          {"rate_hz", status.rate_hz},
          {"bytes_per_s", status.bytes_per_s},
          {"disk_free_bytes", status.disk_free_bytes},
          {"part", status.part},
          {"pauses", status.pauses},
          {"left_out", status.left_out},
          {"buffered_s", status.buffered_s},
          {"topics", std::move(topics)}};
}

}  // namespace exemplar::cli
