#include "exemplar/ircp/check.hpp"

#include <cmath>
#include <span>
#include <string>
#include <string_view>

#include "exemplar/base/text.hpp"

namespace exemplar::ircp {
namespace {

/// Collects the first fault; every check after it does nothing.
class Checks {
 public:
  Checks& Key(std::string_view field, const std::string& text, bool may_be_empty = false) {
    if (text.empty() && !may_be_empty) {
      Fail(field, "is empty");
    } else if (text.find('\0') != std::string::npos) {
      Fail(field, "contains a NUL byte");
    } else if (text.size() > kMaxKeyBytes) {
      Fail(field, "has " + std::to_string(text.size()) + " bytes, at most " +
                      std::to_string(kMaxKeyBytes) + " are allowed");
    }
    return *this;
  }

  Checks& Finite(std::string_view field, double value) {
    if (!std::isfinite(value)) Fail(field, FormatDouble(value) + " is not a finite number");
    return *this;
  }

  Checks& Finite(std::string_view field, std::span<const double> values,
                 std::span<const std::string> names = {}) {
    for (std::size_t i = 0; i < values.size() && status_.ok(); ++i) {
      if (std::isfinite(values[i])) continue;
      std::string place = std::string(field) + "[" + std::to_string(i) + "]";
      if (i < names.size()) place += " (\"" + names[i] + "\")";
      Fail(place, FormatDouble(values[i]) + " is not a finite number");
    }
    return *this;
  }

  /// One value a name.
  Checks& Channels(std::string_view names_field, const std::vector<std::string>& names,
                   std::string_view field, const std::vector<double>& values,
                   bool may_be_empty = false) {
    if (values.size() != names.size() && !(may_be_empty && values.empty())) {
      Fail(field, "has " + std::to_string(values.size()) + " values for " +
                      std::to_string(names.size()) + " " + std::string(names_field));
      return *this;
    }
    return Finite(field, values, names);
  }

  Checks& Pose(std::string_view field, const geometry::Pose& pose, bool has_orientation) {
    Finite(field, std::span<const double>(pose.translation.data(), 3));
    if (!has_orientation || !status_.ok()) return *this;
    const double norm = pose.rotation.norm();
    // Not "norm within bounds is false" but "is not true": NaN fails too.
    if (!(std::abs(norm - 1) < 1e-3)) {
      Fail(field, "orientation has length " + FormatDouble(norm) + ", must be 1");
    }
    return *this;
  }

  Checks& PoseIf(bool there, std::string_view field, const geometry::Pose& pose,
                 bool has_orientation) {
    return there ? Pose(field, pose, has_orientation) : *this;
  }

  /// `width` values for each of `rows`.
  Checks& Rows(std::string_view field, const std::vector<double>& values, std::size_t rows,
               std::size_t width) {
    if (values.size() != rows * width) {
      Fail(field, "has " + std::to_string(values.size()) + " values for " + std::to_string(rows) +
                      " times of " + std::to_string(width));
    }
    return Finite(field, values);
  }

  const Status& status() const { return status_; }

 private:
  void Fail(std::string_view field, const std::string& what) {
    if (status_.ok()) {
      status_ = InvalidArgument(std::string(field) + ": " + what, std::string(field));
    }
  }
  Status status_;
};

}  // namespace

Status Check(const SuitSample& sample) {
  return Checks()
      .Key("source", sample.header.source)
      .Channels("names", sample.names, "positions", sample.positions)
      .status();
}

Status Check(const EndEffectorSample& sample) {
  return Checks()
      .Key("source", sample.header.source)
      .Key("hand", sample.hand, true)
      .PoseIf(sample.has_pose, "base_T_tool", sample.base_T_tool, sample.has_orientation)
      .Finite("hand_open", sample.hand_open)
      .Finite("wrench", sample.wrench)
      .status();
}

Status Check(const TactileSample& sample) {
  return Checks()
      .Key("source", sample.header.source)
      .Channels("sensors", sample.sensors, "forces_n", sample.forces_n)
      .status();
}

Status Check(const CameraSample& sample) {
  return Checks().Key("source", sample.header.source).status();
}

Status Check(const ObjectSample& sample) {
  return Checks()
      .Key("source", sample.header.source)
      .Key("name", sample.name)
      .Pose("base_T_object", sample.base_T_object, sample.has_orientation)
      .Finite("position_variance_m2", sample.position_variance_m2)
      .Finite("rotation_variance_rad2", sample.rotation_variance_rad2)
      .status();
}

Status Check(const JointStateSample& sample) {
  return Checks()
      .Key("source", sample.header.source)
      .Channels("names", sample.names, "positions", sample.positions)
      .Channels("names", sample.names, "velocities", sample.velocities, true)
      .Channels("names", sample.names, "efforts", sample.efforts, true)
      .Finite("hand_open", sample.hand_open)
      .Channels("touch_sensors", sample.touch_sensors, "touch_n", sample.touch_n)
      .status();
}

Status Check(const JointCommandSample& sample) {
  return Checks()
      .Key("source", sample.header.source)
      .Channels("names", sample.names, "positions", sample.positions)
      .Channels("names", sample.names, "velocities", sample.velocities, true)
      .Finite("hand_open", sample.hand_open)
      .status();
}

Status Check(const PlanSample& sample) {
  return Checks()
      .Key("source", sample.header.source)
      .Finite("times_s", sample.times_s)
      .Rows("positions", sample.positions, sample.times_s.size(), sample.names.size())
      .Rows("tool_m", sample.tool_m, sample.times_s.size(), 3)
      .status();
}

Status Check(const CommandSample& sample) {
  return Checks()
      .Key("source", sample.header.source)
      .Key("program", sample.program)
      .Key("request_id", sample.request_id)
      .Key("action", sample.action)
      .status();
}

Status Check(const StatusSample& sample) {
  return Checks().Key("source", sample.header.source).Key("program", sample.program).status();
}

Status Check(const SafetySample& sample) {
  return Checks().Key("source", sample.header.source).status();
}

Status Check(const ClockSample& sample) {
  return Checks().Key("source", sample.header.source).status();
}

}  // namespace exemplar::ircp
