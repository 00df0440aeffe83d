#pragma once
#include <google/protobuf/message.h>

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "exemplar/base/result.hpp"

namespace exemplar::rpc {

/// An empty message of a type that is linked here.
std::unique_ptr<google::protobuf::Message> NewMessage(const google::protobuf::Descriptor& type);

/// Reads a JSON object. Errors name the line and column (from `first_line`) of text that is not
/// JSON, else the field at fault.
Status ReadJson(std::string_view json, int first_line, google::protobuf::Message& message);

/// Sets the field at `path` ("skill.name"), or adds to it where it is a list.
Status SetField(const std::string& path, const std::string& value,
                google::protobuf::Message& message);

/// One line. Fields by their names in the .proto, those of numbers and lists always.
Result<std::string> WriteJson(const google::protobuf::Message& message);

}  // namespace exemplar::rpc
