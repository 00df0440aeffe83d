#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "exemplar/base/text.hpp"
#include "exemplar/learning/aligned.hpp"
#include "exemplar/signal/low_pass.hpp"
#include "exemplar/signal/resample.hpp"
#include "exemplar/signal/statistics.hpp"
#include "static_pose.hpp"

namespace exemplar::learning {
namespace {

constexpr std::size_t kLeastSamples = 5;  // of a motion: fewer have no speed to speak of
constexpr int kMostFrames = 36000;        // ten minutes at 60 Hz; longer trials get a coarser base
constexpr int kMostOversampling = 4;      // of the base, for sources faster than it
constexpr double kGapLimit_s = 0.5;

// The trial's uniform time base, in the trial's own time.
struct Base {
  double first_s = 0;
  double last_s = 0;
  int frames = 0;
  double rate_hz() const { return (frames - 1) / (last_s - first_s); }
};

struct Smoothed {
  Eigen::MatrixXd values;  // one row a frame of the base
  double cutoff_hz = 0;
  double noise = 0;
  std::size_t repeated = 0;  // samples that only repeat the one before
};

// Onto a grid at least as fine as the source, low-pass there, then down to the base.
Smoothed Smooth(std::vector<double> time_s, Eigen::MatrixXd values, const Base& base,
                double cutoff_hz, bool may_be_held = true) {
  Smoothed result;
  const std::vector<std::size_t> news =
      may_be_held ? signal::FindNews(time_s, values) : std::vector<std::size_t>();
  if (may_be_held && news.size() < time_s.size()) {
    result.repeated = time_s.size() - news.size();
    for (std::size_t k = 0; k < news.size(); ++k) {
      time_s[k] = time_s[news[k]];
      values.row(static_cast<Eigen::Index>(k)) = values.row(static_cast<Eigen::Index>(news[k]));
    }
    time_s.resize(news.size());
    values.conservativeResize(static_cast<Eigen::Index>(news.size()), Eigen::NoChange);
  }
  const double interval_s = signal::MedianInterval(time_s);
  const double source_hz = interval_s > 0 ? 1 / interval_s : base.rate_hz();
  const int fold = std::clamp(static_cast<int>(std::ceil(source_hz / base.rate_hz() - 0.01)), 1,
                              kMostOversampling);
  const std::vector<double> fine_s =
      signal::EvenTimes(base.first_s, base.last_s, (base.frames - 1) * fold + 1);
  const double fine_hz = base.rate_hz() * fold;
  Eigen::MatrixXd fine = signal::Interpolate(time_s, values, fine_s);

  const double highest_hz = signal::kHighestCutoff * std::min(fine_hz, source_hz);
  result.cutoff_hz = std::min(cutoff_hz, highest_hz);
  if (cutoff_hz <= 0 && time_s.size() > 1) {
    // The noise is that of the source's own samples: finer ones are interpolated.
    const double even_hz = std::min(source_hz, fine_hz);
    const double duration_s = time_s.back() - time_s.front();
    const int count = std::max(2, static_cast<int>(std::lround(duration_s * even_hz)) + 1);
    const signal::CutoffChoice choice = signal::ChooseCutoff(
        signal::Interpolate(time_s, values,
                            signal::EvenTimes(time_s.front(), time_s.back(), count)),
        even_hz);
    result.cutoff_hz = std::min(choice.cutoff_hz, highest_hz);
    result.noise = choice.noise;
  }
  if (result.cutoff_hz > 0) fine = signal::LowPass(fine, fine_hz, result.cutoff_hz);
  result.values.resize(base.frames, values.cols());
  for (int k = 0; k < base.frames; ++k) result.values.row(k) = fine.row(k * fold);
  return result;
}

std::string CutoffNote(const std::string& stream, const Smoothed& smoothed,
                       const std::string& unit) {
  std::string note = stream + ": ";
  if (smoothed.repeated > 0) {
    note += std::to_string(smoothed.repeated) + " samples repeat the one before, taken as held; ";
  }
  if (smoothed.cutoff_hz == 0) return note + "no low-pass, no noise found";
  note += "cut-off " + FormatFixed(smoothed.cutoff_hz, 1) + " Hz";
  if (smoothed.noise > 0) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2g", smoothed.noise);
    note += ", noise " + std::string(text) + " " + unit;
  }
  return note;
}

void NoteGaps(const std::string& stream, const std::vector<double>& time_s,
              std::vector<std::string>& notes) {
  const double limit_s = std::max(kGapLimit_s, 5 * signal::MedianInterval(time_s));
  for (const signal::Gap& gap : signal::FindGaps(time_s, limit_s)) {
    notes.push_back(stream + ": no sample from " + FormatFixed(gap.begin_s, 2) + " to " +
                    FormatFixed(gap.end_s, 2) + " s, bridged");
  }
}

Eigen::MatrixXd Positions(const demonstration::PoseSeries& series) {
  Eigen::MatrixXd positions(static_cast<Eigen::Index>(series.size()), 3);
  for (std::size_t k = 0; k < series.size(); ++k) {
    positions.row(static_cast<Eigen::Index>(k)) = series.base_T_frame[k].translation;
  }
  return positions;
}

Eigen::MatrixXd Quaternions(const demonstration::PoseSeries& series) {
  Eigen::MatrixXd quaternions(static_cast<Eigen::Index>(series.size()), 4);
  for (std::size_t k = 0; k < series.size(); ++k) {
    quaternions.row(static_cast<Eigen::Index>(k)) = series.base_T_frame[k].rotation.coeffs();
  }
  return quaternions;
}

struct SmoothedPoses {
  std::vector<geometry::Pose> poses;
  Smoothed position;
};

SmoothedPoses SmoothPoses(const demonstration::PoseSeries& series, const Base& base,
                          double cutoff_hz) {
  SmoothedPoses result;
  result.position = Smooth(series.time_s, Positions(series), base, cutoff_hz);
  result.poses.resize(static_cast<std::size_t>(base.frames));
  for (int k = 0; k < base.frames; ++k) {
    result.poses[static_cast<std::size_t>(k)].translation = result.position.values.row(k);
  }
  if (!series.has_orientation) return result;
  const Smoothed rotation = Smooth(series.time_s, Quaternions(series), base, cutoff_hz);
  for (int k = 0; k < base.frames; ++k) {
    const Eigen::Vector4d coefficients = rotation.values.row(k);
    const double norm = coefficients.norm();
    // Half a turn between two samples leaves nothing to average: keep the sample before.
    Eigen::Quaterniond& out = result.poses[static_cast<std::size_t>(k)].rotation;
    if (norm > 1e-3) {
      out.coeffs() = coefficients / norm;
    } else if (k > 0) {
      out = result.poses[static_cast<std::size_t>(k) - 1].rotation;
    }
  }
  return result;
}

// The sum of the sensors' forces above their levels at rest.
struct Force {
  std::vector<double> time_s;
  Eigen::VectorXd above_rest_n;
};

std::optional<Force> MeasuredForce(const demonstration::Trial& trial) {
  constexpr double kRestPart = 0.1;
  if (!trial.tactile.empty()) {
    Force force{trial.tactile.time_s,
                Eigen::VectorXd::Zero(static_cast<Eigen::Index>(trial.tactile.size()))};
    for (Eigen::Index c = 0; c < trial.tactile.values.cols(); ++c) {
      const Eigen::VectorXd sensor = trial.tactile.values.col(c);
      force.above_rest_n.array() += sensor.array() - signal::Quantile(sensor, kRestPart);
    }
    return force;
  }
  std::vector<Eigen::Index> axes;
  for (std::size_t c = 0; c < trial.wrench.names.size(); ++c) {
    const std::string& name = trial.wrench.names[c];
    if (name.starts_with("f")) axes.push_back(static_cast<Eigen::Index>(c));
  }
  if (trial.wrench.empty() || axes.empty()) return std::nullopt;
  Eigen::VectorXd norm = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(trial.wrench.size()));
  for (const Eigen::Index axis : axes) norm += trial.wrench.values.col(axis).cwiseAbs2();
  norm = norm.cwiseSqrt();
  return Force{trial.wrench.time_s, norm.array() - signal::Quantile(norm, kRestPart)};
}

// Which joints the skill sees: the robot model's, in its order, where the trial has them all.
Result<std::vector<Eigen::Index>> PickJoints(const demonstration::Trial& trial,
                                             const demonstration::ToolKinematics* tool,
                                             UniformTrial& out) {
  std::vector<Eigen::Index> columns;
  const std::vector<std::string>& names = trial.joints.names;
  if (trial.joints.empty()) return columns;
  if (tool != nullptr) {
    std::string missing;
    for (const std::string& joint : tool->joint_names()) {
      const auto found = std::find(names.begin(), names.end(), joint);
      if (found == names.end()) {
        missing = joint;
        break;
      }
      columns.push_back(found - names.begin());
    }
    if (missing.empty()) {
      out.joint_names = tool->joint_names();
      return columns;
    }
    if (trial.end_effectors.empty()) {
      std::string message = trial.source + ": joints: the robot model's joint \"" + missing +
                            "\" is not among the trial's, and there is no tool pose";
      if (const auto nearest = NearestName(missing, names)) {
        message += "; it has \"" + *nearest + "\"";
      }
      return InvalidArgument(std::move(message), "joints");
    }
    out.notes.push_back("joints: the robot model's joint \"" + missing +
                        "\" is not among them; kept as recorded");
    columns.clear();
  }
  for (std::size_t c = 0; c < names.size(); ++c) columns.push_back(static_cast<Eigen::Index>(c));
  out.joint_names = names;
  return columns;
}

const demonstration::PoseSeries* MainHand(const demonstration::Trial& trial) {
  const demonstration::PoseSeries* first = nullptr;
  for (const demonstration::PoseSeries& hand : trial.end_effectors) {
    if (hand.empty()) continue;
    if (hand.name.empty()) return &hand;
    if (first == nullptr) first = &hand;
  }
  return first;
}

Result<Base> TimeBase(const demonstration::Trial& trial, const demonstration::PoseSeries* hand,
                      double rate_hz, std::vector<std::string>& notes) {
  Base base{-1e300, 1e300, 0};
  std::size_t samples = 0;
  const auto bound = [&](const std::vector<double>& time_s) {
    base.first_s = std::max(base.first_s, time_s.front());
    base.last_s = std::min(base.last_s, time_s.back());
    samples = std::max(samples, time_s.size());
  };
  if (!trial.joints.empty()) bound(trial.joints.time_s);
  if (hand != nullptr) bound(hand->time_s);
  if (samples == 0) {
    return InvalidArgument(trial.source + ": neither joints nor end effector: there is no motion",
                           "joints");
  }
  if (samples < kLeastSamples) {
    return InvalidArgument(trial.source + ": " + std::to_string(samples) +
                               " samples of motion, needs at least " +
                               std::to_string(kLeastSamples),
                           "time_s");
  }
  const double duration_s = base.last_s - base.first_s;
  if (!(duration_s > 0)) {
    return InvalidArgument(trial.source + ": joints and end effector share no time", "time_s");
  }
  const double frames = std::round(duration_s * rate_hz) + 1;
  base.frames =
      static_cast<int>(std::clamp(frames, static_cast<double>(kLeastSamples), 1.0 * kMostFrames));
  if (frames > kMostFrames) {
    notes.push_back("time: " + FormatFixed(duration_s, 0) + " s at " + FormatDouble(rate_hz) +
                    " Hz would be " + FormatFixed(frames, 0) + " frames; taken at " +
                    FormatFixed(base.rate_hz(), 1) + " Hz");
  }
  return base;
}

}  // namespace

Result<UniformTrial> Prepare(const demonstration::Trial& trial, const LearnOptions& options,
                             const demonstration::ToolKinematics* tool) {
  if (const Status valid = demonstration::Validate(trial); !valid.ok()) {
    return WithPlace(valid.error(), trial.source);
  }
  if (options.joints == JointSource::kMeasured) {
    if (trial.measured_joints.empty()) {
      return InvalidArgument(trial.source +
                                 ": joints=measured is asked for, and no robot's joints were "
                                 "recorded beside the suit's",
                             "joints");
    }
    demonstration::Trial measured = trial;
    measured.joints = std::exchange(measured.measured_joints, {});
    LearnOptions as_they_are = options;
    as_they_are.joints = JointSource::kSuit;
    return Prepare(measured, as_they_are, tool);
  }
  UniformTrial out;
  out.id = trial.source;
  const demonstration::PoseSeries* hand = MainHand(trial);
  Result<std::vector<Eigen::Index>> columns = PickJoints(trial, tool, out);
  if (!columns) return columns.error();
  const Result<Base> base = TimeBase(trial, hand, options.sample_rate_hz, out.notes);
  if (!base) return base.error();
  const auto frames = static_cast<std::size_t>(base->frames);
  out.time_s = signal::EvenTimes(0, base->last_s - base->first_s, base->frames);

  out.joints.resize(base->frames, 0);
  if (!columns->empty()) {
    NoteGaps("joints", trial.joints.time_s, out.notes);
    Eigen::MatrixXd values(trial.joints.values.rows(), static_cast<Eigen::Index>(columns->size()));
    for (std::size_t c = 0; c < columns->size(); ++c) {
      values.col(static_cast<Eigen::Index>(c)) = trial.joints.values.col((*columns)[c]);
    }
    Smoothed joints = Smooth(trial.joints.time_s, values, *base, options.cutoff_hz);
    out.notes.push_back(CutoffNote("joints", joints, "rad"));
    out.cutoff_hz = joints.cutoff_hz;
    out.joints = std::move(joints.values);
  }
  if (hand != nullptr) {
    const std::string stream = hand->name.empty() ? "tool" : "tool " + hand->name;
    if (trial.end_effectors.size() > 1) {
      out.notes.push_back(stream + ": the one end effector of " +
                          std::to_string(trial.end_effectors.size()) + " that is learned");
    }
    NoteGaps(stream, hand->time_s, out.notes);
    SmoothedPoses poses = SmoothPoses(*hand, *base, options.cutoff_hz);
    out.notes.push_back(CutoffNote(stream, poses.position, "m"));
    if (columns->empty()) out.cutoff_hz = poses.position.cutoff_hz;
    out.base_T_tool = std::move(poses.poses);
    out.has_orientation = hand->has_orientation;
  } else if (tool != nullptr) {
    out.base_T_tool.reserve(frames);
    for (int k = 0; k < base->frames; ++k) {
      out.base_T_tool.push_back(tool->ToolPose(out.joints.row(k).transpose()));
    }
    geometry::MakeSignsContinuous(out.base_T_tool);
  }

  std::vector<double> base_s = out.time_s;
  for (double& t : base_s) t += base->first_s;
  if (!trial.hands.empty()) {
    const auto main = std::find(trial.hands.names.begin(), trial.hands.names.end(), "");
    const auto column = main == trial.hands.names.end() ? 0 : main - trial.hands.names.begin();
    const Eigen::VectorXd open =
        signal::Interpolate(trial.hands.time_s, trial.hands.values.col(column), base_s);
    out.hand_open.assign(open.begin(), open.end());
  }
  if (const std::optional<Force> force = MeasuredForce(trial)) {
    // Force that rests at one value is not a sample held: nothing is touched.
    out.touch_n = Smooth(force->time_s, force->above_rest_n, *base, 0, /*may_be_held=*/false)
                      .values.col(0)
                      .cwiseMax(0);
  }
  double extent_m = 0;
  if (!out.base_T_tool.empty()) {
    Eigen::AlignedBox3d box;
    for (const geometry::Pose& pose : out.base_T_tool) box.extend(pose.translation);
    extent_m = box.diagonal().norm();
  }
  for (const demonstration::PoseSeries& object : trial.objects) {
    if (object.empty()) continue;
    const std::string stream = "object " + object.name;
    NoteGaps(stream, object.time_s, out.notes);
    out.object_names.push_back(object.name);
    out.object_has_orientation.push_back(object.has_orientation);
    if (const std::optional<geometry::Pose> base_T_object = StaticPose(object, extent_m)) {
      out.base_T_object.emplace_back(frames, *base_T_object);
      continue;
    }
    if (const std::optional<geometry::Pose> base_T_object =
            trial.hands.empty() ? std::nullopt : TakenFrom(object, extent_m)) {
      out.notes.push_back(stream + ": the hand takes it; where it stood before counts");
      out.base_T_object.emplace_back(frames, *base_T_object);
      continue;
    }
    SmoothedPoses poses = SmoothPoses(object, *base, 0);
    out.notes.push_back(stream + ": it moves");
    out.base_T_object.push_back(std::move(poses.poses));
  }
  return out;
}

}  // namespace exemplar::learning
