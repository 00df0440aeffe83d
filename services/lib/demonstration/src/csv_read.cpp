#include <algorithm>
#include <cmath>

#include "clock_repair.hpp"
#include "csv_layout.hpp"
#include "csv_text.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/demonstration/csv.hpp"

namespace exemplar::demonstration {
namespace {

/// Beyond this no length, angle or force of a demonstration lies: such a cell is a fault.
constexpr double kLargestValue = 1e6;
constexpr double kEpoch_s = 1e8;  ///< a first time beyond this is a Unix time
/// One sample in so many may be unusable and is then left out.
constexpr std::size_t kSamplesPerFault = 20;

constexpr double kNormNotice = 1e-3;  ///< text with few digits stays below
constexpr double kNormExact = 1e-9;

/// Reads the streams of one file; each keeps the rows in which it has values.
class TrialReader {
 public:
  TrialReader(std::string_view source, const CsvHeader& header, const CsvRows& rows,
              const RepairedClock& clock)
      : source_(source), header_(header), rows_(rows), clock_(clock) {}

  Result<Trial> Read(const CsvLayout& layout) {
    trial_.source = std::string(source_);
    trial_.prismatic_joints = layout.prismatic_joints;
    if (clock_.first_s >= kEpoch_s) trial_.start = Stamp::FromSeconds(clock_.first_s);
    for (const PoseColumns& columns : layout.end_effectors) {
      if (const Status s = ReadPoses(columns, trial_.end_effectors); !s.ok()) return s.error();
    }
    for (const PoseColumns& columns : layout.objects) {
      if (const Status s = ReadPoses(columns, trial_.objects); !s.ok()) return s.error();
    }
    const std::pair<const ScalarColumns*, ScalarSeries*> groups[] = {
        {&layout.joints, &trial_.joints}, {&layout.measured_joints, &trial_.measured_joints},
        {&layout.hands, &trial_.hands},   {&layout.tactile, &trial_.tactile},
        {&layout.wrench, &trial_.wrench}, {&layout.label, &trial_.label}};
    for (const auto& [columns, series] : groups) {
      if (const Status s = ReadScalars(*columns, *series); !s.ok()) return s.error();
    }
    AddTorques();
    if (const Status s = CheckHands(layout.hands); !s.ok()) return s.error();
    if (const Status s = CheckLabel(); !s.ok()) return s.error();
    trial_.notices = std::move(notices_);
    if (Status valid = Validate(trial_); !valid.ok()) return WithPlace(valid.error(), source_);
    return std::move(trial_);
  }

 private:
  const std::string& ColumnName(int column) const {
    return header_.names[static_cast<std::size_t>(column)];
  }
  double Cell(std::size_t row, int column) const {
    return rows_.columns[static_cast<std::size_t>(column)][row];
  }
  std::string PlaceOf(std::size_t row, int column) const {
    return Place(source_, rows_.lines[row]) + ColumnName(column) + ": ";
  }
  Error ErrorAt(std::size_t row, int column, const std::string& what) const {
    return InvalidArgument(PlaceOf(row, column) + what, ColumnName(column));
  }

  /// Indices into the repaired clock at which the group has a value in every column. Rows in which
  /// the whole group is empty are no samples of it; a few that are not finite are left out.
  Result<std::vector<std::size_t>> UsableSamples(std::span<const int> columns) {
    std::vector<std::size_t> usable;
    usable.reserve(clock_.rows.size());
    std::size_t faults = 0;
    std::pair<std::size_t, int> first_fault;
    for (std::size_t i = 0; i < clock_.rows.size(); ++i) {
      const std::size_t row = clock_.rows[i];
      std::size_t empty = 0;
      int empty_column = -1;
      bool finite = true;
      for (const int column : columns) {
        const double value = Cell(row, column);
        if (std::isnan(value)) {
          ++empty;
          empty_column = column;
        } else if (std::isinf(value)) {
          if (finite && faults++ == 0) first_fault = {row, column};
          finite = false;
        } else if (std::abs(value) > kLargestValue) {
          return ErrorAt(row, column, FormatDouble(value) + " lies beyond 1e6; SI units?");
        }
      }
      if (empty == columns.size()) continue;
      if (empty > 0) {
        return ErrorAt(row, empty_column, "is empty, while columns that belong to it are not");
      }
      if (finite) usable.push_back(i);
    }
    if (faults > 0) {
      const auto [row, column] = first_fault;
      const std::string counted =
          std::to_string(faults) + " of " + std::to_string(faults + usable.size()) + " samples";
      if (faults > std::max<std::size_t>(1, (faults + usable.size()) / kSamplesPerFault)) {
        return ErrorAt(row, column, "is not finite, as " + counted + " are not");
      }
      notices_.push_back(PlaceOf(row, column) + "is not finite; " + counted + " were left out");
    }
    return usable;
  }

  std::vector<double> TimesOf(const std::vector<std::size_t>& samples) const {
    std::vector<double> time_s;
    time_s.reserve(samples.size());
    for (const std::size_t i : samples) time_s.push_back(clock_.time_s[i]);
    return time_s;
  }

  void NoticeEmpty(int column) {
    notices_.push_back(std::string(source_) + ": " + ColumnName(column) +
                       ": has no value in any row: ignored");
  }

  Status ReadPoses(const PoseColumns& pose, std::vector<PoseSeries>& group) {
    const std::span<const int> columns(pose.columns.data(), pose.has_orientation() ? 7 : 3);
    Result<std::vector<std::size_t>> samples = UsableSamples(columns);
    if (!samples.ok()) return samples.error();
    if (samples->empty()) {
      NoticeEmpty(columns.front());
      return {};
    }
    PoseSeries series;
    series.name = pose.name;
    series.time_s = TimesOf(*samples);
    series.has_orientation = pose.has_orientation();
    series.base_T_frame.reserve(samples->size());
    std::size_t normalised = 0;
    std::size_t first_normalised = 0;
    for (const std::size_t i : *samples) {
      const std::size_t row = clock_.rows[i];
      geometry::Pose& base_T_frame = series.base_T_frame.emplace_back();
      base_T_frame.translation = {Cell(row, columns[0]), Cell(row, columns[1]),
                                  Cell(row, columns[2])};
      if (!pose.has_orientation()) continue;
      Eigen::Vector4d xyzw(Cell(row, columns[3]), Cell(row, columns[4]), Cell(row, columns[5]),
                           Cell(row, columns[6]));
      const double norm = xyzw.norm();
      if (norm < 0.5 || norm > 2) {
        return ErrorAt(row, columns[3],
                       norm < 1e-6 ? std::string("the quaternion is zero, which is no orientation")
                                   : "the quaternion has length " + FormatDouble(norm) +
                                         ", must be 1 (x, y, z, w)");
      }
      if (std::abs(norm - 1) > kNormExact) xyzw /= norm;
      if (std::abs(norm - 1) > kNormNotice && normalised++ == 0) first_normalised = row;
      base_T_frame.rotation.coeffs() = xyzw;
    }
    if (normalised > 0) {
      notices_.push_back(PlaceOf(first_normalised, columns[3]) + std::to_string(normalised) +
                         " quaternion(s) were off unit length and were normalised (first here)");
    }
    MendSigns(series, *samples, columns[3]);
    group.push_back(std::move(series));
    return {};
  }

  void MendSigns(PoseSeries& series, const std::vector<std::size_t>& samples, int column) {
    if (!series.has_orientation) return;
    std::size_t flips = 0;
    std::size_t first = 0;
    for (std::size_t i = 1; i < series.size(); ++i) {
      const double cosine =
          series.base_T_frame[i - 1].rotation.dot(series.base_T_frame[i].rotation);
      if (cosine < 0 && flips++ == 0) first = i;
    }
    if (flips == 0) return;
    geometry::MakeSignsContinuous(series.base_T_frame);
    notices_.push_back(PlaceOf(clock_.rows[samples[first]], column) +
                       "the quaternion's sign flips at " + std::to_string(flips) +
                       " row(s); made continuous (first here)");
  }

  Status ReadScalars(const ScalarColumns& columns, ScalarSeries& series) {
    if (columns.columns.empty()) return {};
    Result<std::vector<std::size_t>> samples = UsableSamples(columns.columns);
    if (!samples.ok()) return samples.error();
    if (samples->empty()) {
      NoticeEmpty(columns.columns.front());
      return {};
    }
    series.names = columns.names;
    series.time_s = TimesOf(*samples);
    series.values.resize(static_cast<Eigen::Index>(samples->size()),
                         static_cast<Eigen::Index>(columns.columns.size()));
    for (std::size_t c = 0; c < columns.columns.size(); ++c) {
      for (std::size_t i = 0; i < samples->size(); ++i) {
        series.values(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(c)) =
            Cell(clock_.rows[(*samples)[i]], columns.columns[c]);
      }
    }
    return {};
  }

  void AddTorques() {
    if (trial_.wrench.names.size() != 3) return;
    for (const char* torque : {"tx", "ty", "tz"}) trial_.wrench.names.emplace_back(torque);
    trial_.wrench.values.conservativeResize(Eigen::NoChange, 6);
    trial_.wrench.values.rightCols(3).setZero();
  }

  Status CheckHands(const ScalarColumns& columns) {
    constexpr double kSlack = 0.05;  // sensors overshoot their stops a little
    Eigen::MatrixXd& open = trial_.hands.values;
    if (open.size() == 0) return {};
    if (open.minCoeff() >= 0 && open.maxCoeff() <= 1) return {};
    Eigen::Index row = 0;
    Eigen::Index channel = 0;
    if (open.minCoeff() < -kSlack || open.maxCoeff() > 1 + kSlack) {
      const double worst =
          (open.array() - 0.5).abs().maxCoeff(&row, &channel) >= 0 ? open(row, channel) : 0;
      const int column = columns.columns[static_cast<std::size_t>(channel)];
      return InvalidArgument(std::string(source_) + ": " + ColumnName(column) + ": is " +
                                 FormatDouble(worst) + " at " +
                                 FormatDouble(trial_.hands.time_s[static_cast<std::size_t>(row)]) +
                                 " s, must lie between 0 (closed) and 1 (open)",
                             ColumnName(column));
    }
    open = open.cwiseMax(0.0).cwiseMin(1.0);
    notices_.push_back(std::string(source_) +
                       ": hand_..._open: values just outside 0 to 1 were clamped");
    return {};
  }

  Status CheckLabel() const {
    for (Eigen::Index i = 0; i < trial_.label.values.size(); ++i) {
      const double label = trial_.label.values(i, 0);
      if (label == std::round(label)) continue;
      return InvalidArgument(std::string(source_) + ": label: " + FormatDouble(label) + " at " +
                                 FormatDouble(trial_.label.time_s[static_cast<std::size_t>(i)]) +
                                 " s is not a whole number",
                             "label");
    }
    return {};
  }

  std::string_view source_;
  const CsvHeader& header_;
  const CsvRows& rows_;
  const RepairedClock& clock_;
  Trial trial_;
  std::vector<std::string> notices_;
};

std::vector<bool> WantedColumns(const CsvLayout& layout, std::size_t width) {
  std::vector<bool> wanted(width, false);
  const auto want = [&](int column) {
    if (column >= 0) wanted[static_cast<std::size_t>(column)] = true;
  };
  want(layout.time);
  for (const std::vector<PoseColumns>* group : {&layout.end_effectors, &layout.objects}) {
    for (const PoseColumns& pose : *group) {
      for (const int column : pose.columns) want(column);
    }
  }
  for (const ScalarColumns* group : {&layout.joints, &layout.measured_joints, &layout.hands,
                                     &layout.tactile, &layout.wrench, &layout.label}) {
    for (const int column : group->columns) want(column);
  }
  return wanted;
}

/// Whether each row equals the one before it in every wanted column.
std::vector<bool> RepeatedRows(const CsvRows& rows) {
  std::vector<bool> repeats(rows.lines.size(), true);
  if (!repeats.empty()) repeats[0] = false;
  for (const std::vector<double>& column : rows.columns) {
    for (std::size_t i = 1; i < column.size(); ++i) {
      const bool same =
          column[i] == column[i - 1] || (std::isnan(column[i]) && std::isnan(column[i - 1]));
      if (!same) repeats[i] = false;
    }
  }
  return repeats;
}

void Append(std::vector<std::string>& to, std::vector<std::string> from) {
  std::move(from.begin(), from.end(), std::back_inserter(to));
}

}  // namespace

Result<Trial> ReadCsv(std::string_view text, std::string_view source) {
  Result<CsvHeader> header = ReadCsvHeader(text, source);
  if (!header.ok()) return header.error();
  Result<CsvLayout> layout = ReadCsvLayout(header->names, source, header->line);
  if (!layout.ok()) return layout.error();
  Result<CsvRows> rows =
      ReadCsvRows(text, source, *header, WantedColumns(*layout, header->names.size()));
  if (!rows.ok()) return rows.error();
  if (rows->lines.empty()) {
    return InvalidArgument(Place(source, header->line) + "the header is followed by no whole row");
  }
  Result<RepairedClock> clock = RepairClock(rows->columns[static_cast<std::size_t>(layout->time)],
                                            RepeatedRows(*rows), rows->lines, source);
  if (!clock.ok()) return clock.error();

  Result<Trial> trial = TrialReader(source, *header, *rows, *clock).Read(*layout);
  if (!trial.ok()) return trial.error();
  std::vector<std::string> notices = std::move(layout->notices);
  Append(notices, std::move(rows->notices));
  Append(notices, std::move(clock->notices));
  Append(notices, std::move(trial->notices));
  trial->notices = std::move(notices);
  return trial;
}

}  // namespace exemplar::demonstration
