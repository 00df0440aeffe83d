#include "csv_layout.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "csv_text.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::demonstration {
namespace {

constexpr std::array<std::string_view, 7> kPoseComponents = {"x_m", "y_m", "z_m", "qx",
                                                             "qy",  "qz",  "qw"};
constexpr std::array<std::string_view, 6> kWrenchColumns = {
    "wrench_fx_n", "wrench_fy_n", "wrench_fz_n", "wrench_tx_nm", "wrench_ty_nm", "wrench_tz_nm"};

std::optional<std::string> StripSuffix(std::string_view text, std::string_view suffix) {
  if (text == suffix) return std::string();
  if (text.size() <= suffix.size() + 1 || !text.ends_with(suffix)) return std::nullopt;
  text.remove_suffix(suffix.size());
  if (!text.ends_with('_')) return std::nullopt;
  text.remove_suffix(1);
  return std::string(text);
}

/// The name without a unit at its end ("x_mm" -> "x").
std::string_view WithoutUnit(std::string_view name) {
  constexpr std::array<std::string_view, 16> kUnits = {
      "_m",   "_mm",  "_cm",     "_km",      "_um", "_in", "_inch", "_ft",
      "_rad", "_deg", "_degree", "_degrees", "_n",  "_nm", "_kn",   "_mn"};
  for (const std::string_view unit : kUnits) {
    if (name.size() > unit.size() && name.ends_with(unit)) {
      name.remove_suffix(unit.size());
      return name;
    }
  }
  return name;
}

/// What was probably meant by a column of an end effector or object that is not one of the
/// format's; empty when it is something else.
std::string MeantPoseColumn(std::string_view name) {
  const std::string_view core = WithoutUnit(name);
  const std::size_t at = core.rfind('_');
  const std::string_view stem = core.substr(0, at + 1);
  const std::string_view last = core.substr(at + 1);
  for (const std::string_view axis : {"x", "y", "z"}) {
    if (last == axis || last == std::string("p") + std::string(axis)) {
      return std::string(stem) + std::string(axis) + "_m, in metres";
    }
  }
  for (const std::string_view part : {"qx", "qy", "qz", "qw"}) {
    if (last == part) return std::string(core) + ", without unit";
  }
  for (const std::string_view part : {"w", "rx", "ry", "rz", "roll", "pitch", "yaw"}) {
    if (last == part) {
      return "a quaternion " + std::string(stem) + "qx, " + std::string(stem) + "qy, " +
             std::string(stem) + "qz, " + std::string(stem) + "qw for the orientation";
    }
  }
  return {};
}

class LayoutReader {
 public:
  LayoutReader(std::string_view source, std::size_t line) : place_(Place(source, line)) {}

  Result<CsvLayout> Read(std::span<const std::string> names) {
    std::set<std::string_view> seen;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (!names[i].empty() && !seen.insert(names[i]).second) {
        return InvalidArgument(place_ + "column \"" + names[i] + "\" stands twice in the header",
                               names[i]);
      }
    }
    const bool has_time = seen.contains("time_s");
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Status read = Add(names[i], static_cast<int>(i));
      if (!read.ok()) return read.error();
    }
    if (!has_time) return MissingTime(names);
    for (const std::vector<PoseColumns>* group : {&layout_.end_effectors, &layout_.objects}) {
      const std::string prefix = group == &layout_.objects ? "object_" : "ee_";
      for (const PoseColumns& pose : *group) {
        const Status whole = CheckWhole(pose, prefix);
        if (!whole.ok()) return whole.error();
      }
    }
    const Status wrench = ReadWrench();
    if (!wrench.ok()) return wrench.error();
    if (layout_.joints.names.empty() && layout_.end_effectors.empty()) {
      return InvalidArgument(place_ +
                             "neither joints (<joint>_rad or <joint>_m) nor an end effector "
                             "(ee_x_m, ee_y_m, ee_z_m) among the columns: " +
                             Join(names, ", "));
    }
    return std::move(layout_);
  }

 private:
  Status Add(const std::string& name, int column) {
    if (name == "time_s") {
      layout_.time = column;
    } else if (name == "label") {
      layout_.label = {{"label"}, {column}};
    } else if (AddPose(name, "ee_", layout_.end_effectors, true, column) ||
               AddPose(name, "object_", layout_.objects, false, column)) {
      return {};
    } else if (name == "hand_open") {
      AddScalar(layout_.hands, "", column);
    } else if (name.starts_with("hand_") && name.ends_with("_open")) {
      AddScalar(layout_.hands, name.substr(5, name.size() - 10), column);
    } else if (name.starts_with("tactile_") && name.ends_with("_n") && name.size() > 10) {
      AddScalar(layout_.tactile, name.substr(8, name.size() - 10), column);
    } else if (const auto* wrench = std::find(kWrenchColumns.begin(), kWrenchColumns.end(), name);
               wrench != kWrenchColumns.end()) {
      wrench_[static_cast<std::size_t>(wrench - kWrenchColumns.begin())] = column;
    } else if (const std::string slip = Slip(name); !slip.empty()) {
      return InvalidArgument(place_ + "column \"" + name + "\": " + slip, name);
    } else if (const auto measured = StripSuffix(name, "rad_measured");
               measured && !measured->empty()) {
      AddScalar(layout_.measured_joints, *measured, column);
    } else if (const auto sliding = StripSuffix(name, "m_measured"); sliding && !sliding->empty()) {
      AddScalar(layout_.measured_joints, *sliding, column);
    } else if (name.ends_with("_rad") && name.size() > 4) {
      AddScalar(layout_.joints, name.substr(0, name.size() - 4), column);
    } else if (name.ends_with("_m") && name.size() > 2) {
      layout_.prismatic_joints.push_back(name.substr(0, name.size() - 2));
      AddScalar(layout_.joints, layout_.prismatic_joints.back(), column);
    } else {
      Ignore(name, column);
    }
    return {};
  }

  bool AddPose(std::string_view name, std::string_view prefix, std::vector<PoseColumns>& group,
               bool may_be_unnamed, int column) {
    if (!name.starts_with(prefix)) return false;
    name.remove_prefix(prefix.size());
    for (std::size_t i = 0; i < kPoseComponents.size(); ++i) {
      const std::optional<std::string> frame = StripSuffix(name, kPoseComponents[i]);
      if (!frame || (frame->empty() && !may_be_unnamed)) continue;
      auto pose = std::find_if(group.begin(), group.end(),
                               [&](const PoseColumns& p) { return p.name == *frame; });
      if (pose == group.end()) {
        group.emplace_back().name = *frame;
        pose = std::prev(group.end());
      }
      pose->columns[i] = column;
      return true;
    }
    return false;
  }

  static void AddScalar(ScalarColumns& group, std::string name, int column) {
    group.names.push_back(std::move(name));
    group.columns.push_back(column);
  }

  /// Why a column of the format is not one as it stands; empty for any other name.
  static std::string Slip(std::string_view name) {
    if (name.starts_with("ee_") || name.starts_with("object_")) {
      const std::string meant = MeantPoseColumn(name);
      if (!meant.empty()) return "the unit is missing or another one; expected " + meant;
    }
    if (name.starts_with("tactile_") && !name.ends_with("_rad")) {
      return "the unit is missing or another one; expected " + std::string(WithoutUnit(name)) +
             "_n, in newtons";
    }
    if (name.starts_with("wrench_")) {
      for (const std::string_view column : kWrenchColumns) {
        if (WithoutUnit(name) == WithoutUnit(column)) {
          return "the unit is missing or another one; expected " + std::string(column);
        }
      }
    }
    for (const std::string_view unit : {"_deg", "_degree", "_degrees"}) {
      if (name.ends_with(unit)) {
        return "angles are in radians; expected " +
               std::string(name.substr(0, name.size() - unit.size())) + "_rad";
      }
    }
    return {};
  }

  void Ignore(const std::string& name, int column) {
    if (name.empty()) {
      layout_.notices.push_back(place_ + "column " + std::to_string(column + 1) +
                                " has no name: ignored");
      return;
    }
    layout_.notices.push_back(place_ + "column \"" + name +
                              "\" is none of the format's: ignored (a joint would be " + name +
                              "_rad or " + name + "_m)");
  }

  Error MissingTime(std::span<const std::string> names) const {
    std::string message = place_ + "no column time_s (seconds) in the header";
    for (const std::string& name : names) {
      if (name == "t" || name.starts_with("time") || name.starts_with("Time") ||
          name.starts_with("stamp")) {
        return InvalidArgument(message + "; \"" + name + "\" has no unit or another one", "time_s");
      }
    }
    return InvalidArgument(message + ": " + Join(names, ", "), "time_s");
  }

  Status CheckWhole(const PoseColumns& pose, const std::string& prefix) const {
    const std::string stem = prefix + (pose.name.empty() ? "" : pose.name + "_");
    const bool any_rotation = std::any_of(pose.columns.begin() + 3, pose.columns.end(),
                                          [](int column) { return column >= 0; });
    for (std::size_t i = 0; i < pose.columns.size(); ++i) {
      if (pose.columns[i] >= 0 || (i >= 3 && !any_rotation)) continue;
      const std::string missing = stem + std::string(kPoseComponents[i]);
      return InvalidArgument(
          place_ + "column \"" + missing + "\" is missing beside the other " + stem + "... columns",
          missing);
    }
    return {};
  }

  Status ReadWrench() {
    const auto present = [&](std::size_t i) { return wrench_[i] >= 0; };
    bool any = false;
    for (std::size_t i = 0; i < 6; ++i) any = any || present(i);
    if (!any) return {};
    const bool torques = present(3) || present(4) || present(5);
    for (std::size_t i = 0; i < (torques ? 6u : 3u); ++i) {
      if (!present(i)) {
        return InvalidArgument(place_ + "column \"" + std::string(kWrenchColumns[i]) +
                                   "\" is missing beside the other wrench_... columns",
                               std::string(kWrenchColumns[i]));
      }
      AddScalar(layout_.wrench, std::string(kWrenchColumns[i].substr(7, 2)), wrench_[i]);
    }
    if (!torques) {
      layout_.notices.push_back(place_ + "no torques beside the forces: taken as zero");
    }
    return {};
  }

  std::string place_;
  CsvLayout layout_;
  std::array<int, 6> wrench_{-1, -1, -1, -1, -1, -1};
};

}  // namespace

std::span<const std::string_view> PoseComponents() { return kPoseComponents; }

Result<CsvLayout> ReadCsvLayout(std::span<const std::string> names, std::string_view source,
                                std::size_t header_line) {
  return LayoutReader(source, header_line).Read(names);
}

}  // namespace exemplar::demonstration
