#include "exemplar/learning/options.hpp"

#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "exemplar/base/text.hpp"

namespace exemplar::learning {
namespace {

template <class T>
using Choices = std::vector<std::pair<std::string, T>>;

const Choices<Method>& Methods() {
  static const Choices<Method> choices = {
      {"auto", Method::kAuto}, {"paper", Method::kPaper}, {"frames", Method::kFrames}};
  return choices;
}
const Choices<Selection>& Selections() {
  static const Choices<Selection> choices = {{"vote", Selection::kVote},
                                             {"joint", Selection::kJoint}};
  return choices;
}
const Choices<EpisodeRule>& Rules() {
  static const Choices<EpisodeRule> choices = {{"twitch", EpisodeRule::kTwitch},
                                               {"literal", EpisodeRule::kLiteral}};
  return choices;
}
const Choices<ForceRate>& ForceRates() {
  static const Choices<ForceRate> choices = {{"absolute", ForceRate::kAbsolute},
                                             {"signed", ForceRate::kSigned}};
  return choices;
}
const Choices<JointSource>& JointSources() {
  static const Choices<JointSource> choices = {{"suit", JointSource::kSuit},
                                               {"measured", JointSource::kMeasured}};
  return choices;
}
const Choices<AlignmentRule>& AlignmentRules() {
  static const Choices<AlignmentRule> choices = {{"markers", AlignmentRule::kMarkers},
                                                 {"elastic", AlignmentRule::kElastic}};
  return choices;
}
const Choices<ThresholdRule>& ThresholdRules() {
  static const Choices<ThresholdRule> choices = {{"trial", ThresholdRule::kTrial},
                                                 {"local", ThresholdRule::kLocal}};
  return choices;
}
const Choices<bool Cues::*>& AllCues() {
  static const Choices<bool Cues::*> choices = {{"orientation", &Cues::orientation},
                                                {"extrema", &Cues::extrema}};
  return choices;
}

Error Wrong(std::string_view name, std::string_view value, std::string_view wanted) {
  return InvalidArgument("option " + std::string(name) + ": \"" + std::string(value) +
                             "\" is not " + std::string(wanted),
                         std::string(name));
}

template <class T>
Result<T> Choose(std::string_view name, std::string_view value, const Choices<T>& choices) {
  std::vector<std::string> names;
  for (const auto& [word, choice] : choices) {
    if (word == value) return choice;
    names.push_back(word);
  }
  return Wrong(name, value, "one of " + Join(names, ", "));
}

template <class T>
std::string NameOf(T value, const Choices<T>& choices) {
  for (const auto& [word, choice] : choices) {
    if (choice == value) return word;
  }
  return {};
}

Result<Cues> ReadCues(const std::string& value) {
  Cues cues;
  for (const std::string_view word : Split(value, ',')) {
    const std::string_view name = Trim(word);
    if (name.empty() || name == "none") continue;
    const Result<bool Cues::*> cue = Choose("cues", name, AllCues());
    if (!cue) return cue.error();
    cues.*(*cue) = true;
  }
  return cues;
}

std::string NamesOf(const Cues& cues) {
  std::vector<std::string> names;
  for (const auto& [word, cue] : AllCues()) {
    if (cues.*cue) names.push_back(word);
  }
  return names.empty() ? "none" : Join(names, ",");
}

struct Range {
  double low, high;
};
Result<double> Number(std::string_view name, std::string_view value, Range range,
                      std::string_view unit) {
  const std::optional<double> number = ParseDouble(value);
  if (!number || !std::isfinite(*number) || *number < range.low || *number > range.high) {
    return Wrong(name, value,
                 "a number from " + FormatDouble(range.low) + " to " + FormatDouble(range.high) +
                     (unit.empty() ? "" : " " + std::string(unit)));
  }
  return *number;
}

const std::vector<std::string>& OptionNames() {
  static const std::vector<std::string> names = {
      "method", "selection", "rule",           "force_rate", "joints", "alignment", "threshold",
      "cues",   "target",    "sample_rate_hz", "cutoff_hz",  "frames", "leave_out"};
  return names;
}

Status Set(LearnOptions& options, const std::string& name, const std::string& value) {
  const auto take = [](auto result, auto& to) -> Status {
    if (!result) return result.error();
    to = *result;
    return {};
  };
  if (name == "method") return take(Choose(name, value, Methods()), options.method);
  if (name == "selection") return take(Choose(name, value, Selections()), options.selection);
  if (name == "rule") return take(Choose(name, value, Rules()), options.rule);
  if (name == "force_rate") return take(Choose(name, value, ForceRates()), options.force_rate);
  if (name == "joints") return take(Choose(name, value, JointSources()), options.joints);
  if (name == "alignment") return take(Choose(name, value, AlignmentRules()), options.alignment);
  if (name == "threshold") return take(Choose(name, value, ThresholdRules()), options.threshold);
  if (name == "cues") return take(ReadCues(value), options.cues);
  if (name == "sample_rate_hz") {
    return take(Number(name, value, {1, 1000}, "Hz"), options.sample_rate_hz);
  }
  if (name == "cutoff_hz") {
    return take(Number(name, value, {0, 500}, "Hz (0: chosen from the data)"), options.cutoff_hz);
  }
  if (name == "frames") {
    const Result<double> frames = Number(name, value, {0, 100000}, "");
    const std::optional<long long> whole = ParseInteger(value);
    if (!frames) return frames.error();
    if (!whole || (*whole > 0 && *whole < 2)) {
      return Wrong(name, value,
                   "a whole number of at least 2 (0: mean duration times sample rate)");
    }
    options.frames = static_cast<int>(*whole);
    return {};
  }
  if (name == "target") {
    options.target = value;
    return {};
  }
  if (name == "leave_out") {
    for (const std::string_view id : Split(value, ',')) {
      if (!Trim(id).empty()) options.leave_out.emplace_back(Trim(id));
    }
    return {};
  }
  std::string message = "option \"" + name + "\" is not known";
  if (const auto nearest = NearestName(name, OptionNames())) {
    message += "; did you mean \"" + *nearest + "\"?";
  } else {
    message += "; there are " + Join(OptionNames(), ", ");
  }
  return InvalidArgument(std::move(message), name);
}

}  // namespace

Result<LearnOptions> LearnOptions::FromStrings(const std::map<std::string, std::string>& options) {
  LearnOptions result;
  for (const auto& [name, value] : options) {
    if (const Status set = Set(result, name, value); !set) return set.error();
  }
  // The paper's rules go together, unless asked otherwise.
  if (result.method == Method::kPaper) {
    if (!options.contains("force_rate")) result.force_rate = ForceRate::kSigned;
    if (!options.contains("selection")) result.selection = Selection::kVote;
  }
  if (result.cutoff_hz > 0.4 * result.sample_rate_hz) {
    return Wrong("cutoff_hz", FormatDouble(result.cutoff_hz),
                 "at most 0.4 of sample_rate_hz, which is " + FormatDouble(result.sample_rate_hz));
  }
  return result;
}

std::map<std::string, std::string> LearnOptions::ToStrings() const {
  return {{"method", NameOf(method, Methods())},
          {"selection", NameOf(selection, Selections())},
          {"rule", NameOf(rule, Rules())},
          {"force_rate", NameOf(force_rate, ForceRates())},
          {"joints", NameOf(joints, JointSources())},
          {"alignment", NameOf(alignment, AlignmentRules())},
          {"threshold", NameOf(threshold, ThresholdRules())},
          {"cues", NamesOf(cues)},
          {"target", target},
          {"sample_rate_hz", FormatDouble(sample_rate_hz)},
          {"cutoff_hz", FormatDouble(cutoff_hz)},
          {"frames", std::to_string(frames)},
          {"leave_out", Join(leave_out, ",")}};
}

}  // namespace exemplar::learning
