#include <array>
#include <nlohmann/json.hpp>

#include "exemplar/learning/inspection.hpp"
#include "json_values.hpp"

namespace exemplar::learning {
namespace {

using nlohmann::json;

json FromMatrices(const std::vector<Eigen::MatrixXd>& matrices) {
  json list = json::array();
  for (const Eigen::MatrixXd& matrix : matrices) list.push_back(FromMatrix(matrix));
  return list;
}

std::vector<Eigen::MatrixXd> ToMatrices(const json& j) {
  std::vector<Eigen::MatrixXd> matrices;
  for (const json& matrix : j) matrices.push_back(ToMatrix(matrix));
  return matrices;
}

json FromPoint(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

Eigen::Vector3d ToPoint(const json& j) {
  const auto v = j.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

json FromQuery(const InspectedQuery& query) {
  return {{"base_T_target", FromPose(query.base_T_target)},
          {"base_p_contact", FromPoint(query.base_p_contact)},
          {"absolute", FromMatrix(query.absolute)},
          {"objective", FromMatrix(query.objective)},
          {"blended", FromMatrix(query.blended)},
          {"answer", FromMatrix(query.answer)}};
}

InspectedQuery ToQuery(const json& j) {
  return {.base_T_target = ToPose(j.at("base_T_target")),
          .base_p_contact = ToPoint(j.at("base_p_contact")),
          .absolute = ToMatrix(j.at("absolute")),
          .objective = ToMatrix(j.at("objective")),
          .blended = ToMatrix(j.at("blended")),
          .answer = ToMatrix(j.at("answer"))};
}

json FromMap(const ContactErrorMap& map) {
  return {{"x_m", map.x_m},
          {"y_m", map.y_m},
          {"z_m", map.z_m},
          {"absolute", FromMatrix(map.absolute)},
          {"blended", FromMatrix(map.blended)},
          {"answer", FromMatrix(map.answer)}};
}

ContactErrorMap ToMap(const json& j) {
  return {.x_m = j.at("x_m").get<std::vector<double>>(),
          .y_m = j.at("y_m").get<std::vector<double>>(),
          .z_m = j.at("z_m").get<double>(),
          .absolute = ToMatrix(j.at("absolute")),
          .blended = ToMatrix(j.at("blended")),
          .answer = ToMatrix(j.at("answer"))};
}

bool AllAre(const std::vector<Eigen::MatrixXd>& paths, std::size_t count, Eigen::Index frames) {
  if (paths.size() != count) return false;
  for (const Eigen::MatrixXd& path : paths) {
    if (path.rows() != frames || path.cols() != 3) return false;
  }
  return true;
}

bool Fits(const Inspection& inspection) {
  const std::size_t n = inspection.base_paths.size();
  const Eigen::Index frames = n == 0 ? 0 : inspection.base_paths[0].rows();
  if (!AllAre(inspection.base_paths, n, frames)) return false;
  if (!inspection.obstacle.empty()) return true;
  const Objectivity& objectivity = inspection.objectivity;
  bool good = n > 0 && frames > 0 && AllAre(inspection.object_paths, n, frames) &&
              inspection.base_T_target.size() == n && objectivity.upsilon.size() == frames &&
              objectivity.absolute_variance.size() == frames &&
              objectivity.object_variance.size() == frames && inspection.contact_frame >= 0 &&
              inspection.contact_frame < frames;
  for (const Inspection::Window& contact : inspection.contacts) {
    good = good && contact.first >= 0 && contact.first <= contact.last && contact.last < frames;
  }
  if (inspection.query.has_value()) {
    const InspectedQuery& query = *inspection.query;
    good =
        good && AllAre({query.absolute, query.objective, query.blended, query.answer}, 4, frames);
  }
  if (inspection.map.has_value()) {
    const ContactErrorMap& map = *inspection.map;
    for (const Eigen::MatrixXd* part : {&map.absolute, &map.blended, &map.answer}) {
      good = good && part->size() > 0 &&
             part->rows() == static_cast<Eigen::Index>(map.y_m.size()) &&
             part->cols() == static_cast<Eigen::Index>(map.x_m.size());
    }
  }
  return good;
}

}  // namespace

json ToJson(const Inspection& inspection) {
  json contacts = json::array();
  for (const Inspection::Window& contact : inspection.contacts) {
    contacts.push_back({contact.first, contact.last});
  }
  const Objectivity& objectivity = inspection.objectivity;
  return {{"obstacle", inspection.obstacle},
          {"through_joints", inspection.through_joints},
          {"base_paths", FromMatrices(inspection.base_paths)},
          {"object_paths", FromMatrices(inspection.object_paths)},
          {"base_T_target", FromPoses(inspection.base_T_target)},
          {"absolute_variance", FromVector(objectivity.absolute_variance)},
          {"object_variance", FromVector(objectivity.object_variance)},
          {"upsilon", FromVector(objectivity.upsilon)},
          {"upsilon_assumed", objectivity.undefined},
          {"contacts", std::move(contacts)},
          {"contact_frame", inspection.contact_frame},
          {"contact_found", inspection.contact_found},
          {"query", inspection.query ? FromQuery(*inspection.query) : json(nullptr)},
          {"map", inspection.map ? FromMap(*inspection.map) : json(nullptr)}};
}

Result<Inspection> InspectionFromJson(const json& stored) {
  Inspection inspection;
  try {
    inspection.obstacle = stored.at("obstacle").get<std::string>();
    inspection.through_joints = stored.at("through_joints").get<bool>();
    inspection.base_paths = ToMatrices(stored.at("base_paths"));
    inspection.object_paths = ToMatrices(stored.at("object_paths"));
    inspection.base_T_target = ToPoses(stored.at("base_T_target"));
    inspection.objectivity.absolute_variance = ToVector(stored.at("absolute_variance"));
    inspection.objectivity.object_variance = ToVector(stored.at("object_variance"));
    inspection.objectivity.upsilon = ToVector(stored.at("upsilon"));
    inspection.objectivity.undefined = stored.at("upsilon_assumed").get<bool>();
    for (const json& contact : stored.at("contacts")) {
      const auto window = contact.get<std::array<int, 2>>();
      inspection.contacts.push_back({window[0], window[1]});
    }
    inspection.contact_frame = stored.at("contact_frame").get<int>();
    inspection.contact_found = stored.at("contact_found").get<bool>();
    if (!stored.at("query").is_null()) inspection.query = ToQuery(stored.at("query"));
    if (!stored.at("map").is_null()) inspection.map = ToMap(stored.at("map"));
  } catch (const json::exception& e) {
    return Error{ErrorCode::kDataLoss, std::string("inspection JSON: ") + e.what(), "inspection"};
  }
  if (!Fits(inspection)) {
    return Error{ErrorCode::kDataLoss, "inspection JSON: its parts differ in size", "inspection"};
  }
  return inspection;
}

}  // namespace exemplar::learning
