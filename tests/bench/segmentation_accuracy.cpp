// How well candidate markers and the chosen ones meet known boundaries, for each of the options of
// segmentation: on generated trials, on people's labels (grating), and at the button of
// rail_pressing. Prints tables; docs/segmentation.md holds them.
//
// usage: segmentation_accuracy ["NAME=VALUE;NAME=VALUE"]...   (variants; without: those of the
// page)

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "exemplar/base/rng.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/demonstration/csv.hpp"
#include "exemplar/learning/aligned.hpp"
#include "meetings.hpp"

namespace {

using namespace exemplar;
using Eigen::Vector3d;
using learning::Alignment;
using learning::LearnOptions;
using learning::UniformTrial;

struct Variant {
  std::string name;
  LearnOptions options;
};

/// A trial with the boundaries that its maker put in.
struct Known {
  demonstration::Trial trial;
  std::vector<double> begins_s;
};

double MinimumJerk(double s) {
  const double x = std::clamp(s, 0.0, 1.0);
  return x * x * x * (10 - 15 * x + 6 * x * x);
}

/// A stretch of a made motion.
struct Leg {
  double duration_s = 0;
  Vector3d by = Vector3d::Zero();  ///< shift of the tool (m)
  double turn_rad = 0;             ///< about the tool's z
  double lift_m = 0;               ///< up and down again on the way
  bool begins = false;             ///< a boundary
  double early_s = 0;              ///< begins before the leg before it has ended
};

Known Make(const std::vector<Leg>& legs, Rng& rng) {
  constexpr double kRate_hz = 100;
  constexpr double kNoise_m = 3e-4;
  constexpr double kNoise_rad = 2e-3;
  Known known;
  std::vector<double> begin_s;
  double end_s = 0;
  for (const Leg& leg : legs) {
    begin_s.push_back(end_s - leg.early_s);
    if (leg.begins) known.begins_s.push_back(begin_s.back());
    // Up and down again: the top is a boundary too.
    if (leg.lift_m != 0) known.begins_s.push_back(begin_s.back() + leg.duration_s / 2);
    end_s = begin_s.back() + leg.duration_s;
  }
  demonstration::PoseSeries tool;
  for (int k = 0; k <= static_cast<int>(end_s * kRate_hz); ++k) {
    const double t = k / kRate_hz;
    Vector3d p(.4, 0, .4);
    double angle = 0;
    for (std::size_t i = 0; i < legs.size(); ++i) {
      const double part = (t - begin_s[i]) / legs[i].duration_s;
      p += MinimumJerk(part) * legs[i].by;
      p.z() += legs[i].lift_m * (MinimumJerk(2 * part) - MinimumJerk(2 * part - 1));
      angle += MinimumJerk(part) * legs[i].turn_rad;
    }
    for (double& coordinate : p) coordinate += rng.Normal(0, kNoise_m);
    const Vector3d noise(rng.Normal(0, kNoise_rad), rng.Normal(0, kNoise_rad),
                         angle + rng.Normal(0, kNoise_rad));
    tool.time_s.push_back(t);
    tool.base_T_frame.push_back({p, geometry::ExpSo3(noise)});
  }
  geometry::MakeSignsContinuous(tool.base_T_frame);
  known.trial.end_effectors.push_back(std::move(tool));
  return known;
}

Vector3d Near(const Vector3d& p, double spread, Rng& rng) {
  return p + Vector3d(rng.Uniform(-spread, spread), rng.Uniform(-spread, spread),
                      rng.Uniform(-spread, spread));
}

/// A quick reach, a slow press, a quick way back.
Known SlowPress(Rng& rng) {
  const Vector3d reach = Near({.25, .1, -.2}, .04, rng);
  const Vector3d press(0, 0, -rng.Uniform(.02, .03));
  return Make({{rng.Uniform(.3, .5)},
               {rng.Uniform(.8, 1.2), reach, 0, 0, true},
               {rng.Uniform(.05, .2)},
               {rng.Uniform(.9, 1.3), press, 0, 0, true},
               {rng.Uniform(.2, .5)},
               {rng.Uniform(.8, 1.2), -reach - press, 0, 0, true},
               {rng.Uniform(.3, .5)}},
              rng);
}

/// The tool begins to turn while it still reaches, then pushes.
Known TurnOnTheWay(Rng& rng) {
  const Vector3d reach = Near({.25, .1, -.2}, .04, rng);
  return Make({{rng.Uniform(.3, .5)},
               {rng.Uniform(1.2, 1.6), reach, 0, 0, true},
               {rng.Uniform(.7, 1.0), {}, rng.Uniform(1.0, 1.6), 0, true, rng.Uniform(.5, .6)},
               {rng.Uniform(.1, .3)},
               {rng.Uniform(.7, 1.0), Near({.12, 0, 0}, .01, rng), 0, 0, true},
               {rng.Uniform(.3, .5)}},
              rng);
}

/// Over an obstacle without a stop: up, and down.
Known OverAWall(Rng& rng) {
  const Vector3d reach = Near({.3, .1, -.05}, .04, rng);
  return Make({{rng.Uniform(.3, .5)},
               {rng.Uniform(1.6, 2.2), reach, 0, rng.Uniform(.12, .18), true},
               {rng.Uniform(.2, .5)},
               {rng.Uniform(.9, 1.2), -reach, 0, 0, true},
               {rng.Uniform(.3, .5)}},
              rng);
}

/// A suit, and the robot that follows it as far as the button. The suit reads each joint with a
/// bent scale and more noise, the person feels no button and sinks on, and the robot is late.
Known SuitAndRobot(Rng& rng) {
  constexpr double kRate_hz = 60;
  constexpr double kLate_s = 0.05;
  const double rest_s = rng.Uniform(.3, .5);
  const double reach_s = rng.Uniform(.9, 1.3);
  const double hold_s = rng.Uniform(.5, .9);
  const double back_s = rng.Uniform(.8, 1.2);
  const double sinks_rad = rng.Uniform(.1, .2);
  const Eigen::Vector3d far(rng.Uniform(.6, .9), rng.Uniform(-.8, -.5), rng.Uniform(.3, .5));
  const auto there = [&](double t) {
    return MinimumJerk((t - rest_s) / reach_s) -
           MinimumJerk((t - rest_s - reach_s - hold_s) / back_s);
  };
  const auto samples =
      static_cast<Eigen::Index>((2 * rest_s + reach_s + hold_s + back_s) * kRate_hz);
  Known known;
  known.begins_s = {rest_s + kLate_s, rest_s + reach_s + hold_s + kLate_s};
  Eigen::MatrixXd suit(samples, 3), robot(samples, 3);
  std::vector<double> time_s;
  for (Eigen::Index k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / kRate_hz;
    time_s.push_back(t);
    const double sunk = MinimumJerk((t - rest_s - .8 * reach_s) / (.2 * reach_s + hold_s)) -
                        MinimumJerk((t - rest_s - reach_s - hold_s) / back_s);
    for (Eigen::Index j = 0; j < 3; ++j) {
      const double q = far[j] * there(t) + (j == 0 ? sinks_rad * sunk : 0);
      suit(k, j) = 1.1 * q + .15 * std::sin(2 * q) + rng.Normal(0, 3e-3);
      robot(k, j) = far[j] * there(t - kLate_s) + rng.Normal(0, 2e-4);
    }
  }
  const std::vector<std::string> names = {"shoulder", "elbow", "wrist"};
  known.trial.joints = {names, time_s, suit};
  known.trial.measured_joints = {names, time_s, robot};
  return known;
}

struct Tally {
  int known = 0, said = 0, met = 0;
  std::vector<double> error_s;
};

/// One to one in time order, within `tolerance_s`.
void Count(const std::vector<double>& known_s, const std::vector<double>& said_s,
           double tolerance_s, Tally& tally) {
  tally.known += static_cast<int>(known_s.size());
  tally.said += static_cast<int>(said_s.size());
  std::vector<bool> used(said_s.size(), false);
  for (const double known : known_s) {
    int nearest = -1;
    for (std::size_t k = 0; k < said_s.size(); ++k) {
      if (used[k] || std::abs(said_s[k] - known) > tolerance_s) continue;
      if (nearest < 0 ||
          std::abs(said_s[k] - known) < std::abs(said_s[static_cast<std::size_t>(nearest)] - known))
        nearest = static_cast<int>(k);
    }
    if (nearest < 0) continue;
    used[static_cast<std::size_t>(nearest)] = true;
    ++tally.met;
    tally.error_s.push_back(std::abs(said_s[static_cast<std::size_t>(nearest)] - known));
  }
}

double Median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

void Print(const char* what, const Tally& tally) {
  std::printf("%s %4.2f %4.2f %4.0f", what, tally.said > 0 ? 1.0 * tally.met / tally.said : 0.0,
              tally.known > 0 ? 1.0 * tally.met / tally.known : 0.0, 1e3 * Median(tally.error_s));
}

std::vector<double> Candidates(const learning::Segmentation& segmentation) {
  std::vector<double> times;
  for (const learning::Marker& marker : segmentation.markers) {
    if (marker.kind == learning::MarkerKind::kBeginning) times.push_back(marker.time_s);
  }
  return times;
}

std::vector<double> Chosen(const learning::AlignedTrial& trial) {
  std::vector<double> times;
  for (const int m : trial.chosen) {
    times.push_back(trial.segmentation.markers[static_cast<std::size_t>(m)].time_s);
  }
  return times;
}

Result<Alignment> AlignRaw(const std::vector<demonstration::Trial>& raw,
                           const LearnOptions& options) {
  std::vector<UniformTrial> prepared;
  for (const demonstration::Trial& trial : raw) {
    Result<UniformTrial> uniform = learning::Prepare(trial, options, nullptr);
    if (!uniform.ok()) return uniform.error();
    uniform->id = "trial" + std::to_string(prepared.size());
    prepared.push_back(*std::move(uniform));
  }
  return learning::Align(std::move(prepared), options);
}

/// Groups of five trials of a kind: all candidates, and those chosen.
void Generated(const char* name, Known (*make)(Rng&), const Variant& variant) {
  constexpr int kGroups = 12;
  constexpr double kTolerance_s = 0.3;
  Tally candidates, chosen;
  double correlation = 0;
  Rng rng(11);
  for (int g = 0; g < kGroups; ++g) {
    std::vector<demonstration::Trial> raw;
    std::vector<std::vector<double>> begins_s;
    for (int j = 0; j < 5; ++j) {
      Known known = make(rng);
      known.trial.source = std::to_string(j);
      raw.push_back(std::move(known.trial));
      begins_s.push_back(std::move(known.begins_s));
    }
    const Result<Alignment> aligned = AlignRaw(raw, variant.options);
    if (!aligned.ok()) {
      std::printf("%s\n", aligned.error().message.c_str());
      return;
    }
    correlation += aligned->mean_correlation / kGroups;
    for (std::size_t j = 0; j < raw.size(); ++j) {
      Count(begins_s[j], Candidates(aligned->trials[j].segmentation), kTolerance_s, candidates);
      Count(begins_s[j], Chosen(aligned->trials[j]), kTolerance_s, chosen);
    }
  }
  std::printf("%-16s %-34s", name, variant.name.c_str());
  Print(" candidates", candidates);
  Print("   chosen", chosen);
  std::printf("   r %.3f\n", correlation);
}

// ---- real trials --------------------------------------------------------------------------------

std::filesystem::path DataFolder() {
  if (const char* folder = std::getenv("EXEMPLAR_DATA")) return folder;
  return std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "../shared/data";
}

std::vector<demonstration::Trial> ReadFolder(const std::string& set, const std::string& prefix) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(DataFolder() / set)) {
    const std::string name = entry.path().filename().string();
    if (entry.path().extension() == ".csv" && name.compare(0, prefix.size(), prefix) == 0) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<demonstration::Trial> trials;
  for (const std::filesystem::path& file : files) {
    std::ifstream stream(file);
    std::stringstream text;
    text << stream.rdbuf();
    Result<demonstration::Trial> trial =
        demonstration::ReadCsv(text.str(), file.filename().string());
    if (trial.ok()) trials.push_back(*std::move(trial));
  }
  return trials;
}

/// Changes of the person's label.
std::vector<double> LabelChanges(const demonstration::Trial& trial) {
  std::vector<double> changes;
  for (Eigen::Index k = 1; k < trial.label.values.rows(); ++k) {
    if (trial.label.values(k, 0) != trial.label.values(k - 1, 0)) {
      changes.push_back(trial.label.time_s[static_cast<std::size_t>(k)]);
    }
  }
  return changes;
}

void Grating(const Variant& variant) {
  constexpr double kTolerance_s = 0.5;
  const std::vector<demonstration::Trial> raw = ReadFolder("grating", "trial");
  const Result<Alignment> aligned = AlignRaw(raw, variant.options);
  if (!aligned.ok()) {
    std::printf("grating: %s\n", aligned.error().message.c_str());
    return;
  }
  Tally candidates, chosen;
  for (std::size_t j = 0; j < raw.size(); ++j) {
    Count(LabelChanges(raw[j]), Candidates(aligned->trials[j].segmentation), kTolerance_s,
          candidates);
    Count(LabelChanges(raw[j]), Chosen(aligned->trials[j]), kTolerance_s, chosen);
  }
  std::printf("%-16s %-34s", "grating", variant.name.c_str());
  Print(" candidates", candidates);
  Print("   chosen", chosen);
  std::printf("   r %.3f\n", aligned->mean_correlation);
}

/// Is there a chosen marker where each person comes to the object, and where they leave it?
void AtTheObject(const std::string& set, const Variant& variant) {
  constexpr double kTolerance_s = 0.4;
  Tally come, come_chosen, leave, leave_chosen;
  double correlation = 0;
  std::string counts;
  for (int user = 1; user <= 5; ++user) {
    const Result<Alignment> aligned =
        AlignRaw(ReadFolder(set, "user0" + std::to_string(user)), variant.options);
    if (!aligned.ok()) continue;
    correlation += aligned->mean_correlation / 5;
    counts += " " + std::to_string(aligned->knots_s.size() - 2);
    std::vector<learning::MeetingTrial> paths;
    for (const learning::AlignedTrial& trial : aligned->trials) {
      learning::MeetingTrial path;
      const auto n = static_cast<Eigen::Index>(trial.own.time_s.size());
      path.shifted.resize(n, 3);
      path.turned.resize(n, 3);
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const geometry::Pose& object = trial.own.base_T_object[0][k];
        const Vector3d from = trial.own.base_T_tool[k].translation - object.translation;
        path.shifted.row(i) = from.transpose();
        path.turned.row(i) = (object.rotation.conjugate() * from).transpose();
      }
      paths.push_back(std::move(path));
    }
    for (const learning::Meeting& meeting : learning::FindMeetings(paths)) {
      for (std::size_t j = 0; j < paths.size(); ++j) {
        const learning::AlignedTrial& trial = aligned->trials[j];
        const auto at = [&](int frame) {
          return trial.own.time_s[static_cast<std::size_t>(frame)];
        };
        const std::vector<double> candidates = Candidates(trial.segmentation);
        const std::vector<double> chosen = Chosen(trial);
        Count({at(meeting.stays[j].first)}, candidates, kTolerance_s, come);
        Count({at(meeting.stays[j].first)}, chosen, kTolerance_s, come_chosen);
        if (meeting.stays[j].last + 2 >= static_cast<int>(trial.own.time_s.size())) continue;
        Count({at(meeting.stays[j].last)}, candidates, kTolerance_s, leave);
        Count({at(meeting.stays[j].last)}, chosen, kTolerance_s, leave_chosen);
      }
    }
  }
  const auto recall = [](const Tally& t) { return t.known > 0 ? 1.0 * t.met / t.known : 0.0; };
  std::printf("%-16s %-34s comes %.2f %.2f  leaves %.2f %.2f   markers%s   r %.3f\n", set.c_str(),
              variant.name.c_str(), recall(come), recall(come_chosen), recall(leave),
              recall(leave_chosen), counts.c_str(), correlation);
}

Result<Variant> ReadVariant(const std::string& text) {
  std::map<std::string, std::string> options;
  for (const std::string_view pair : Split(text, ';')) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos) continue;
    options[std::string(pair.substr(0, equals))] = std::string(pair.substr(equals + 1));
  }
  const Result<LearnOptions> read = LearnOptions::FromStrings(options);
  if (!read.ok()) return read.error();
  return Variant{text, *read};
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> texts(argv + 1, argv + argc);
  if (texts.empty()) {
    texts = {"threshold=trial",          "threshold=local",
             "cues=orientation",         "cues=extrema",
             "cues=orientation,extrema", "threshold=local;cues=orientation,extrema"};
  }
  std::vector<Variant> variants;
  for (const std::string& text : texts) {
    Result<Variant> variant = ReadVariant(text);
    if (!variant.ok()) {
      std::fprintf(stderr, "%s\n", variant.error().message.c_str());
      return 2;
    }
    variants.push_back(*std::move(variant));
  }
  std::printf(
      "precision, recall, median error (ms) of all candidates and of the chosen markers; known "
      "boundaries within 300 ms (grating: 500 ms)\n");
  for (const Variant& variant : variants) Generated("slow press", SlowPress, variant);
  for (const Variant& variant : variants) Generated("turn on the way", TurnOnTheWay, variant);
  for (const Variant& variant : variants) Generated("over a wall", OverAWall, variant);
  for (const Variant& variant : variants) Generated("suit and robot", SuitAndRobot, variant);
  LearnOptions measured;
  measured.joints = learning::JointSource::kMeasured;
  Generated("suit and robot", SuitAndRobot, {"joints=measured", measured});
  if (!std::filesystem::is_directory(DataFolder())) {
    std::printf("skipped: no data at %s (set EXEMPLAR_DATA)\n", DataFolder().c_str());
    return 0;
  }
  for (const Variant& variant : variants) Grating(variant);
  std::printf(
      "a marker within 400 ms of coming to the object and of leaving it: candidates, "
      "chosen\n");
  for (const std::string set : {"rail_pressing", "rail_pushing"}) {
    for (const Variant& variant : variants) AtTheObject(set, variant);
  }
  return 0;
}
