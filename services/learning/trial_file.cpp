#include "learning/trial_file.hpp"

#include <algorithm>
#include <cctype>

#include "exemplar/base/ids.hpp"
#include "exemplar/demonstration/csv.hpp"
#include "exemplar/recording/about.hpp"

namespace exemplar::learning_service {
namespace {

constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};

bool EndsWithIgnoringCase(std::string_view text, std::string_view ending) {
  if (text.size() < ending.size()) return false;
  return std::equal(ending.begin(), ending.end(), text.end() - ending.size(), [](char a, char b) {
    return a == std::tolower(static_cast<unsigned char>(b));
  });
}

/// Collects what makes two trials the same, in a form that no two different trials share.
class Content {
 public:
  void Add(std::string_view text) {
    Add(text.size());
    bytes_ += text;
  }
  void Add(std::size_t number) { AddBytes(&number, sizeof number); }
  void Add(double number) {
    if (number == 0) number = 0;  // -0 equals 0
    AddBytes(&number, sizeof number);
  }
  void Add(const std::vector<double>& numbers) {
    Add(numbers.size());
    for (const double number : numbers) Add(number);
  }
  void Add(const demonstration::ScalarSeries& series) {
    Add(series.names.size());
    for (const std::string& name : series.names) Add(name);
    Add(series.time_s);
    for (Eigen::Index i = 0; i < series.values.size(); ++i) Add(series.values.data()[i]);
  }
  void Add(const std::vector<demonstration::PoseSeries>& all) {
    Add(all.size());
    for (const demonstration::PoseSeries& series : all) {
      Add(series.name);
      Add(std::size_t{series.has_orientation});
      Add(series.time_s);
      for (const geometry::Pose& pose : series.base_T_frame) {
        for (int i = 0; i < 3; ++i) Add(pose.translation[i]);
        for (int i = 0; i < 4; ++i) Add(pose.rotation.coeffs()[i]);
      }
    }
  }
  const std::string& bytes() const { return bytes_; }

 private:
  void AddBytes(const void* data, std::size_t size) {
    bytes_.append(static_cast<const char*>(data), size);
  }
  std::string bytes_;
};

}  // namespace

Result<demonstration::Trial> ReadTrialFile(std::string_view name, std::string_view bytes,
                                           const McapTrialReader& read_mcap) {
  const bool is_mcap = bytes.substr(0, kMcapMagic.size()) == kMcapMagic;
  const auto read = [&]() -> Result<demonstration::Trial> {
    if (bytes.empty()) return InvalidArgument(std::string(name) + " is empty");
    if (is_mcap) return read_mcap(bytes, name);
    if (EndsWithIgnoringCase(name, ".mcap")) {
      return InvalidArgument(std::string(name) + " does not begin as an MCAP file does");
    }
    return demonstration::ReadCsv(bytes, name);
  };
  Result<demonstration::Trial> trial = read();
  if (trial) {
    if (trial->source.empty()) trial->source = name;
    return trial;
  }
  Error error = trial.error();
  if (error.field.empty()) error.field = "file";
  return error;
}

std::string PersonOfFile(std::string_view bytes) {
  if (bytes.substr(0, kMcapMagic.size()) != kMcapMagic) return {};
  recording::MemorySource source(
      {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  const Result<recording::About> about = recording::ReadAbout(source);
  return about ? about->person() : std::string();
}

std::string TrialFingerprint(const demonstration::Trial& trial) {
  Content content;
  content.Add(trial.joints);
  content.Add(trial.end_effectors);
  content.Add(trial.objects);
  for (const auto* series : {&trial.hands, &trial.tactile, &trial.wrench, &trial.label}) {
    content.Add(*series);
  }
  return ContentHash(content.bytes());
}

std::vector<std::string> StreamNames(const demonstration::Trial& trial) {
  std::vector<std::string> names;
  const auto add_scalars = [&](const demonstration::ScalarSeries& series, const char* name) {
    if (!series.empty()) {
      names.push_back(std::string(name) + " (" + std::to_string(series.names.size()) + ")");
    }
  };
  add_scalars(trial.joints, "joints");
  add_scalars(trial.measured_joints, "measured joints");
  for (const demonstration::PoseSeries& hand : trial.end_effectors) {
    names.push_back(hand.name.empty() ? "end effector" : "end effector " + hand.name);
  }
  for (const demonstration::PoseSeries& object : trial.objects) {
    names.push_back("object " + object.name);
  }
  add_scalars(trial.hands, "hands");
  add_scalars(trial.tactile, "tactile");
  if (!trial.wrench.empty()) names.emplace_back("wrench");
  if (!trial.label.empty()) names.emplace_back("label");
  return names;
}

std::uint64_t SampleCount(const demonstration::Trial& trial) {
  std::size_t most = trial.joints.size();
  for (const auto& series : trial.end_effectors) most = std::max(most, series.size());
  for (const auto& series : trial.objects) most = std::max(most, series.size());
  return most;
}

}  // namespace exemplar::learning_service
