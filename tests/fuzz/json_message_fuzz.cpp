// The first line of the input names a message of the API ("ExecuteRequest"), the rest is its JSON,
// or, behind a question mark, a field of a query ("skill.name=press"). What is read goes over the
// wire, and is the same when it was written as JSON and read again.

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/field_comparator.h>
#include <google/protobuf/util/message_differencer.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "exemplar/v1/data.pb.h"
#include "exemplar/v1/executor.pb.h"
#include "exemplar/v1/recorder.pb.h"
#include "exemplar/v1/skill.pb.h"
#include "exemplar/v1/topic.pb.h"
#include "exemplar/v1/trial.pb.h"
#include "json_message.hpp"

namespace {

using namespace exemplar;

void Require(bool condition) {
  if (!condition) std::abort();
}

const google::protobuf::Descriptor* TypeOf(std::string_view name) {
  for (const google::protobuf::FileDescriptor* file :
       {v1::ErasePersonRequest::descriptor()->file(), v1::ExecuteRequest::descriptor()->file(),
        v1::StartRecordingRequest::descriptor()->file(),
        v1::LearnSkillRequest::descriptor()->file(),
        v1::SubscribeTopicsRequest::descriptor()->file(),
        v1::SubmitTrialRequest::descriptor()->file()}) {
    const auto* type = file->FindMessageTypeByName(std::string(name));
    if (type != nullptr) return type;
  }
  return nullptr;
}

void CheckRead(const google::protobuf::Message& message) {
  std::string wire;
  Require(message.SerializeToString(&wire));
  const auto received = rpc::NewMessage(*message.GetDescriptor());
  Require(received->ParseFromString(wire));
  const auto json = rpc::WriteJson(message);
  Require(json.ok());
  const auto again = rpc::NewMessage(*message.GetDescriptor());
  Require(rpc::ReadJson(*json, 1, *again).ok());
  google::protobuf::util::DefaultFieldComparator nan_is_nan;
  nan_is_nan.set_treat_nan_as_equal(true);
  google::protobuf::util::MessageDifferencer differencer;
  differencer.set_field_comparator(&nan_is_nan);
  // A zero's sign is lost in JSON: -0 is set, 0 is not.
  differencer.set_message_field_comparison(google::protobuf::util::MessageDifferencer::EQUIVALENT);
  Require(differencer.Compare(message, *again));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  const std::string_view input(reinterpret_cast<const char*>(data), size);
  const std::size_t line = input.find('\n');
  if (line == std::string_view::npos) return 0;
  const auto* const type = TypeOf(input.substr(0, line));
  if (type == nullptr) return 0;
  const std::string_view text = input.substr(line + 1);
  const auto message = rpc::NewMessage(*type);
  Status read;
  if (text.starts_with('?')) {
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos) return 0;
    read = rpc::SetField(std::string(text.substr(1, equals - 1)),
                         std::string(text.substr(equals + 1)), *message);
  } else {
    read = rpc::ReadJson(text, 1, *message);
  }
  Require(read.ok() || !read.error().message.empty());
  if (read.ok()) CheckRead(*message);
  return 0;
}
