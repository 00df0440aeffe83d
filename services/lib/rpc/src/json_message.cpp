#include "json_message.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "exemplar/base/json_check.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::rpc {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr int kDeepest = 64;

/// "line 3, column 7" of the byte with that number, from 1.
std::string PlaceOf(std::string_view text, std::size_t byte, int first_line) {
  const std::string_view before = text.substr(0, std::min(byte, text.size()));
  const auto line = first_line + std::count(before.begin(), before.end(), '\n');
  const std::size_t start = before.rfind('\n');
  const std::size_t column = before.size() - (start == std::string_view::npos ? 0 : start + 1);
  return "line " + std::to_string(line) + ", column " +
         std::to_string(std::max<std::size_t>(column, 1));
}

Error NoSuchField(const Descriptor& type, const std::string& name, const std::string& path) {
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(type.field_count()));
  for (int i = 0; i < type.field_count(); ++i) names.push_back(type.field(i)->name());
  const std::optional<std::string> near = NearestName(name, names);
  return InvalidArgument(path + ": " + type.name() + " has no such field" +
                             (near ? "; did you mean " + *near + "?" : std::string()),
                         path);
}

/// The message type that the fields of `path` (without indexes and quotes) lead to; null: none.
const Descriptor* TypeAt(const Descriptor& type, std::string_view path) {
  const Descriptor* at = &type;
  for (const std::string_view part : Split(path, '.')) {
    const std::string name(part.substr(0, part.find('[')));
    const FieldDescriptor* field = at->FindFieldByName(name);
    if (field == nullptr) field = at->FindFieldByCamelcaseName(name);
    if (field == nullptr || field->message_type() == nullptr) return nullptr;
    at = field->message_type();
  }
  return at;
}

/// Protobuf says "(skill.version): invalid value ..." and "(skill) vresion: Cannot find field.".
Error ErrorOf(const Descriptor& type, const std::string& said) {
  std::string path;
  std::string rest = said;
  if (rest.starts_with('(')) {
    const std::size_t close = rest.find(')');
    path = rest.substr(1, close - 1);
    rest = rest.substr(std::min(rest.size(), close + 1));
  }
  constexpr std::string_view kNoField = ": Cannot find field.";
  if (rest.ends_with(kNoField)) {
    const std::string name(Trim(rest.substr(0, rest.size() - kNoField.size())));
    const Descriptor* const owner = path.empty() ? &type : TypeAt(type, path);
    const std::string full = path.empty() ? name : path + "." + name;
    if (owner != nullptr) return NoSuchField(*owner, name, full);
    return InvalidArgument(full + ": there is no such field", full);
  }
  const std::size_t text = rest.find_first_not_of(": ");
  rest = text == std::string::npos ? "this is not of the field's type" : rest.substr(text);
  return InvalidArgument(path.empty() ? rest : path + ": " + rest, path);
}

}  // namespace

std::unique_ptr<Message> NewMessage(const Descriptor& type) {
  const Message* prototype =
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
  return std::unique_ptr<Message>(prototype->New());
}

Status ReadJson(std::string_view json, int first_line, Message& message) {
  // Protobuf's own reader takes more than JSON, and does not say where it failed.
  if (const auto fault = FindJsonFault(json, kDeepest)) {
    if (fault->too_deep) return InvalidArgument("the JSON is nested too deep");
    return InvalidArgument(PlaceOf(json, fault->byte, first_line) + ": this is not JSON");
  }
  const std::size_t first = json.find_first_not_of(" \t\r\n");
  if (json[first] != '{') return InvalidArgument("the request must be a JSON object");
  const auto status = google::protobuf::util::JsonStringToMessage(
      google::protobuf::StringPiece(json.data(), json.size()), &message);
  if (status.ok()) return {};
  return ErrorOf(*message.GetDescriptor(),
                 {status.message().data(), static_cast<std::size_t>(status.message().size())});
}

Status SetField(const std::string& path, const std::string& value, Message& message) {
  Message* at = &message;
  const std::vector<std::string_view> parts = Split(path, '.');
  const FieldDescriptor* field = nullptr;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    field = at->GetDescriptor()->FindFieldByName(std::string(parts[i]));
    if (field == nullptr) return NoSuchField(*at->GetDescriptor(), std::string(parts[i]), path);
    if (i + 1 == parts.size()) break;
    if (field->message_type() == nullptr || field->is_repeated()) {
      return InvalidArgument(path + ": " + field->name() + " has no fields of its own", path);
    }
    at = at->GetReflection()->MutableMessage(at, field);
  }
  if (field->message_type() != nullptr) {
    return InvalidArgument(path + ": a message cannot be given in the query; send it as JSON",
                           path);
  }
  // Read as its JSON would be, so that there is one way in which values are read.
  const bool bare = field->cpp_type() != FieldDescriptor::CPPTYPE_STRING &&
                    field->cpp_type() != FieldDescriptor::CPPTYPE_ENUM;
  nlohmann::json text = value;
  if (bare && !FindJsonFault(value, kDeepest)) text = nlohmann::json::parse(value);
  nlohmann::json object;
  object[field->name()] = field->is_repeated() ? nlohmann::json::array({text}) : text;
  const std::unique_ptr<Message> read = NewMessage(*at->GetDescriptor());
  const Status done =
      ReadJson(object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace), 1, *read);
  if (!done) return InvalidArgument(path + ": \"" + value + "\" is not of the field's type", path);
  at->MergeFrom(*read);
  return {};
}

Result<std::string> WriteJson(const Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(message, &json, options);
  if (!status.ok()) return Internal("the answer cannot be written as JSON: " + status.ToString());
  return json;
}

}  // namespace exemplar::rpc
