#include <algorithm>

#include "csv_layout.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/demonstration/csv.hpp"

namespace exemplar::demonstration {
namespace {

/// Every stream's stamps; the densest is the one with the most samples.
const std::vector<double>& DensestTimes(const Trial& trial) {
  const std::vector<double>* densest = &trial.joints.time_s;
  const auto consider = [&](const std::vector<double>& time_s) {
    if (time_s.size() > densest->size()) densest = &time_s;
  };
  for (const PoseSeries& series : trial.end_effectors) consider(series.time_s);
  for (const PoseSeries& series : trial.objects) consider(series.time_s);
  for (const ScalarSeries* series : {&trial.hands, &trial.tactile, &trial.wrench, &trial.label}) {
    consider(series->time_s);
  }
  return *densest;
}

/// The sample at or before a time, and how far it is to the next one; walks forward only. Before
/// the first and after the last sample those are held.
class Walker {
 public:
  explicit Walker(const std::vector<double>& time_s) : time_s_(time_s) {}
  void MoveTo(double t) {
    while (index_ + 1 < time_s_.size() && time_s_[index_ + 1] <= t) ++index_;
    fraction_ = 0;
    if (index_ + 1 < time_s_.size() && t > time_s_[index_]) {
      fraction_ = (t - time_s_[index_]) / (time_s_[index_ + 1] - time_s_[index_]);
    }
  }
  std::size_t index() const { return index_; }
  double fraction() const { return fraction_; }  ///< in [0, 1)

 private:
  const std::vector<double>& time_s_;
  std::size_t index_ = 0;
  double fraction_ = 0;
};

class PoseWriter {
 public:
  PoseWriter(const PoseSeries& series, const std::string& prefix)
      : series_(series), walker_(series.time_s), prefix_(prefix) {}

  void Header(std::string& out) const {
    const std::string stem = prefix_ + (series_.name.empty() ? "" : series_.name + "_");
    for (const std::string_view component :
         PoseComponents().first(series_.has_orientation ? 7 : 3)) {
      (out += ',') += stem;
      out += component;
    }
  }
  void Row(double t, std::string& out) {
    walker_.MoveTo(t);
    geometry::Pose pose = series_.base_T_frame[walker_.index()];
    if (walker_.fraction() > 0) {
      pose = geometry::Interpolate(pose, series_.base_T_frame[walker_.index() + 1],
                                   walker_.fraction());
    }
    for (const double value : pose.translation) (out += ',') += FormatDouble(value);
    if (!series_.has_orientation) return;
    for (const double value : pose.rotation.coeffs()) (out += ',') += FormatDouble(value);
  }

 private:
  const PoseSeries& series_;
  Walker walker_;
  std::string prefix_;
};

class ScalarWriter {
 public:
  /// `steps`: values hold until the next one (labels), else they are interpolated.
  ScalarWriter(const ScalarSeries& series, std::vector<std::string> columns, bool steps)
      : series_(series), walker_(series.time_s), columns_(std::move(columns)), steps_(steps) {}

  void Header(std::string& out) const {
    for (const std::string& column : columns_) (out += ',') += column;
  }
  void Row(double t, std::string& out) {
    walker_.MoveTo(t);
    const Eigen::Index row = static_cast<Eigen::Index>(walker_.index());
    for (Eigen::Index c = 0; c < series_.values.cols(); ++c) {
      double value = series_.values(row, c);
      if (walker_.fraction() > 0 && !steps_) {
        value += walker_.fraction() * (series_.values(row + 1, c) - value);
      }
      (out += ',') += FormatDouble(value);
    }
  }

 private:
  const ScalarSeries& series_;
  Walker walker_;
  std::vector<std::string> columns_;
  bool steps_;
};

std::vector<std::string> ColumnNames(const ScalarSeries& series, const std::string& prefix,
                                     const std::string& suffix) {
  std::vector<std::string> columns;
  for (const std::string& name : series.names) columns.push_back(prefix + name + suffix);
  return columns;
}

std::vector<ScalarWriter> MakeScalarWriters(const Trial& trial) {
  std::vector<ScalarWriter> writers;
  const auto joint_columns = [&](const ScalarSeries& joints, const std::string& suffix) {
    std::vector<std::string> columns;
    for (const std::string& joint : joints.names) {
      const bool prismatic = std::find(trial.prismatic_joints.begin(), trial.prismatic_joints.end(),
                                       joint) != trial.prismatic_joints.end();
      columns.push_back(joint + (prismatic ? "_m" : "_rad") + suffix);
    }
    return columns;
  };
  if (!trial.joints.empty()) {
    writers.emplace_back(trial.joints, joint_columns(trial.joints, ""), false);
  }
  if (!trial.measured_joints.empty()) {
    writers.emplace_back(trial.measured_joints, joint_columns(trial.measured_joints, "_measured"),
                         false);
  }
  if (!trial.hands.empty()) {
    std::vector<std::string> columns;
    for (const std::string& hand : trial.hands.names) {
      columns.push_back(hand.empty() ? "hand_open" : "hand_" + hand + "_open");
    }
    writers.emplace_back(trial.hands, std::move(columns), false);
  }
  if (!trial.tactile.empty()) {
    writers.emplace_back(trial.tactile, ColumnNames(trial.tactile, "tactile_", "_n"), false);
  }
  if (!trial.wrench.empty()) {
    std::vector<std::string> columns = ColumnNames(trial.wrench, "wrench_", "");
    for (std::string& column : columns) column += column.at(7) == 'f' ? "_n" : "_nm";
    writers.emplace_back(trial.wrench, std::move(columns), false);
  }
  if (!trial.label.empty()) {
    writers.emplace_back(trial.label, std::vector<std::string>{"label"}, true);
  }
  return writers;
}

}  // namespace

std::string WriteCsv(const Trial& trial) {
  std::vector<PoseWriter> poses;
  for (const PoseSeries& hand : trial.end_effectors) {
    if (!hand.empty()) poses.emplace_back(hand, "ee_");
  }
  for (const PoseSeries& object : trial.objects) {
    if (!object.empty()) poses.emplace_back(object, "object_");
  }
  std::vector<ScalarWriter> scalars = MakeScalarWriters(trial);

  std::string out = "time_s";
  for (const PoseWriter& writer : poses) writer.Header(out);
  for (const ScalarWriter& writer : scalars) writer.Header(out);
  out += '\n';
  for (const double t : DensestTimes(trial)) {
    out += FormatDouble(t);
    for (PoseWriter& writer : poses) writer.Row(t, out);
    for (ScalarWriter& writer : scalars) writer.Row(t, out);
    out += '\n';
  }
  return out;
}

}  // namespace exemplar::demonstration
