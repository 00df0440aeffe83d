#include "open_api.hpp"

#include <google/protobuf/descriptor.h>

#include <map>
#include <nlohmann/json.hpp>

namespace exemplar::rpc {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using Json = nlohmann::ordered_json;

class Schemas {
 public:
  Json Reference(const Descriptor& type) {
    Add(type);
    return {{"$ref", "#/components/schemas/" + type.full_name()}};
  }
  Json Take() { return std::move(all_); }

 private:
  void Add(const Descriptor& type) {
    if (all_.contains(type.full_name())) return;
    all_[type.full_name()] = Json::object();  // a type may hold itself
    if (type.full_name() == "google.protobuf.Timestamp") {
      all_[type.full_name()] = {{"type", "string"}, {"format", "date-time"}};
      return;
    }
    Json properties = Json::object();
    for (int i = 0; i < type.field_count(); ++i) {
      const FieldDescriptor& field = *type.field(i);
      properties[field.name()] = Of(field);
    }
    all_[type.full_name()] = {{"type", "object"}, {"properties", std::move(properties)}};
  }

  Json Of(const FieldDescriptor& field) {
    if (field.is_map()) {
      return {{"type", "object"},
              {"additionalProperties", Single(*field.message_type()->FindFieldByName("value"))}};
    }
    if (!field.is_repeated()) return Single(field);
    return {{"type", "array"}, {"items", Single(field)}};
  }

  Json Single(const FieldDescriptor& field) {
    switch (field.type()) {
      case FieldDescriptor::TYPE_DOUBLE:
      case FieldDescriptor::TYPE_FLOAT:
        return {{"type", "number"}};
      case FieldDescriptor::TYPE_BOOL:
        return {{"type", "boolean"}};
      case FieldDescriptor::TYPE_STRING:
        return {{"type", "string"}};
      case FieldDescriptor::TYPE_BYTES:
        return {{"type", "string"}, {"format", "byte"}};
      case FieldDescriptor::TYPE_MESSAGE:
      case FieldDescriptor::TYPE_GROUP:
        return Reference(*field.message_type());
      case FieldDescriptor::TYPE_ENUM: {
        Json values = Json::array();
        for (int i = 0; i < field.enum_type()->value_count(); ++i) {
          values.push_back(field.enum_type()->value(i)->name());
        }
        return {{"type", "string"}, {"enum", std::move(values)}};
      }
      case FieldDescriptor::TYPE_INT64:
      case FieldDescriptor::TYPE_UINT64:
      case FieldDescriptor::TYPE_FIXED64:
      case FieldDescriptor::TYPE_SFIXED64:
      case FieldDescriptor::TYPE_SINT64:
        return {{"type", "string"}, {"format", "int64"}};  // beyond JavaScript's whole numbers
      default:
        return {{"type", "integer"}, {"format", "int32"}};
    }
  }

  Json all_ = Json::object();
};

Json Body(const Json& schema, bool lines, const std::string& what) {
  return {
      {"description", lines ? what + ", one a line" : what},
      {"content", {{lines ? "application/x-ndjson" : "application/json", {{"schema", schema}}}}}};
}

/// The fields of a request that a query can carry.
Json Parameters(const Descriptor& request) {
  Json parameters = Json::array();
  for (int i = 0; i < request.field_count(); ++i) {
    const FieldDescriptor& field = *request.field(i);
    if (field.message_type() != nullptr) continue;
    const Json value = {{"type", "string"}};
    parameters.push_back(
        {{"name", field.name()},
         {"in", "query"},
         {"schema", field.is_repeated() ? Json{{"type", "array"}, {"items", value}} : value}});
  }
  return parameters;
}

}  // namespace

std::string OpenApiOf(const std::vector<api::JsonMethod>& methods) {
  Schemas schemas;
  Json paths = Json::object();
  for (const api::JsonMethod& method : methods) {
    const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindMethodByName(
        method.service + "." + method.name);
    if (descriptor == nullptr) continue;
    const Json answers = {
        {"200", Body(schemas.Reference(*descriptor->output_type()), method.server_streaming,
                     "The answer")},
        {"default",
         {{"description", "The call failed"},
          {"content",
           {{"application/json", {{"schema", {{"$ref", "#/components/schemas/Error"}}}}}}}}}};
    const std::string tag = method.service.substr(method.service.rfind('.') + 1);
    Json post = {{"operationId", tag + "_" + method.name}, {"tags", {tag}}};
    post["requestBody"] =
        Body(schemas.Reference(*descriptor->input_type()), method.client_streaming, "The request");
    post["responses"] = answers;
    Json& path = paths["/" + method.service + "/" + method.name];
    path["post"] = std::move(post);
    if (!method.read_only || method.client_streaming) continue;
    path["get"] = {{"operationId", tag + "_" + method.name + "_get"},
                   {"tags", {tag}},
                   {"parameters", Parameters(*descriptor->input_type())},
                   {"responses", answers}};
  }
  Json components = schemas.Take();
  components["Error"] = {{"type", "object"},
                         {"properties",
                          {{"code", {{"type", "string"}}},
                           {"message", {{"type", "string"}}},
                           {"field", {{"type", "string"}}}}}};
  const Json document = {{"openapi", "3.0.3"},
                         {"info", {{"title", "Exemplar"}, {"version", "v1"}}},
                         {"paths", std::move(paths)},
                         {"components", {{"schemas", std::move(components)}}}};
  return document.dump(1);
}

}  // namespace exemplar::rpc
