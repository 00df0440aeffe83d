#include "capture_suit/recorder_remote.hpp"

#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::capture_suit {
namespace {

constexpr Duration kAnswerTimeout = std::chrono::seconds(10);

}  // namespace

RecorderRemote::RecorderRemote(std::unique_ptr<ircp::ControlClient> client,
                               std::string demonstrator)
    : client_(std::move(client)), demonstrator_(std::move(demonstrator)) {}

Result<RecorderRemote> RecorderRemote::Create(ircp::Bus& bus, const Clock& clock,
                                              std::uint64_t seed, const std::string& demonstrator) {
  auto client = ircp::ControlClient::Create(bus, clock, "recorder", "suit", seed);
  if (!client) return client.error();
  return RecorderRemote(std::move(*client), demonstrator);
}

Status RecorderRemote::Start(const std::string& name, const std::string& source,
                             const std::vector<ircp::TopicCount>& streams, std::stop_token stop) {
  std::vector<std::string> topics;
  topics.reserve(streams.size());
  for (const ircp::TopicCount& stream : streams) topics.push_back(stream.topic);
  std::map<std::string, std::string> arguments = {
      {"name", name}, {"source", source}, {"expect", Join(topics, ",")}};
  if (!demonstrator_.empty()) arguments["person"] = demonstrator_;
  return Call("start", std::move(arguments), std::move(stop));
}

Status RecorderRemote::Stop(std::stop_token stop) { return Call("stop", {}, std::move(stop)); }

Status RecorderRemote::Call(const std::string& action, std::map<std::string, std::string> arguments,
                            std::stop_token stop) {
  const Result<ircp::Answer> answer =
      client_->Call(action, std::move(arguments), kAnswerTimeout, std::move(stop));
  if (!answer) return WithPlace(answer.error(), "recorder " + action);
  return {};
}

std::string RecordingName(const std::string& name, std::size_t index, std::size_t count) {
  if (count == 1 && !name.empty()) return name;
  const std::string number = std::to_string(index + 1);
  return (name.empty() ? "trial" : name) + "-" +
         std::string(number.size() < 3 ? 3 - number.size() : 0, '0') + number;
}

}  // namespace exemplar::capture_suit
