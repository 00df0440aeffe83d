#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "exemplar/figures/plot.hpp"

namespace exemplar::figures {
namespace {

constexpr double kAzimuth = -52 * std::numbers::pi / 180;  // of the eye
constexpr double kElevation = 24 * std::numbers::pi / 180;
// An axis is at least this part of the longest one, so that flat motions keep a box.
constexpr double kLeastPart = 0.3;

Point Flat(const Eigen::Vector3d& p) {
  const double towards = std::cos(kAzimuth) * p.x() + std::sin(kAzimuth) * p.y();
  return {-std::sin(kAzimuth) * p.x() + std::cos(kAzimuth) * p.y(),
          -(std::cos(kElevation) * p.z() - std::sin(kElevation) * towards)};
}

// Fits the box with corners low and high into `rect`, leaving room for the labels.
class Projection {
 public:
  Projection(const Eigen::Vector3d& low, const Eigen::Vector3d& high, const Rect& rect) {
    Range xs, ys;
    for (const double x : {low.x(), high.x()}) {
      for (const double y : {low.y(), high.y()}) {
        for (const double z : {low.z(), high.z()}) {
          const Point point = Flat({x, y, z});
          xs.Include(point.x);
          ys.Include(point.y);
        }
      }
    }
    constexpr double kLeft = 66, kRight = 26, kTop = 16, kBottom = 48;
    const double width = rect.width - kLeft - kRight;
    const double height = rect.height - kTop - kBottom;
    scale_ = std::min(width / xs.length(), height / ys.length());
    offset_ = {rect.left + kLeft + (width - scale_ * xs.length()) / 2 - scale_ * xs.low,
               rect.top + kTop + (height - scale_ * ys.length()) / 2 - scale_ * ys.low};
  }
  Point At(const Eigen::Vector3d& p) const {
    const Point flat = Flat(p);
    return {offset_.x + scale_ * flat.x, offset_.y + scale_ * flat.y};
  }
  Point At(double x, double y, double z) const { return At(Eigen::Vector3d(x, y, z)); }
  double scale() const { return scale_; }

 private:
  double scale_ = 1;
  Point offset_;
};

std::vector<double> AxisTicks(double low, double high, double scale) {
  return Ticks(low, high, std::clamp(static_cast<int>((high - low) * scale / 36), 3, 7));
}

double StepOf(const std::vector<double>& ticks) {
  return ticks.size() > 1 ? ticks[1] - ticks[0] : std::max(std::abs(ticks.front()), 1e-12);
}

void DrawBox(Svg& svg, const Projection& to, const Eigen::Vector3d& low,
             const Eigen::Vector3d& high, const std::string& unit) {
  const Stroke grid{.colour = kGrid};
  const Stroke edge{.colour = "#888888"};
  const std::vector<double> xs = AxisTicks(low.x(), high.x(), to.scale());
  const std::vector<double> ys = AxisTicks(low.y(), high.y(), to.scale());
  const std::vector<double> zs = AxisTicks(low.z(), high.z(), to.scale());
  // Floor, the wall at the left (least x) and the wall behind (greatest y) face the eye.
  for (const double x : xs) {
    svg.Line(to.At(x, low.y(), low.z()), to.At(x, high.y(), low.z()), grid);
    svg.Line(to.At(x, high.y(), low.z()), to.At(x, high.y(), high.z()), grid);
    const Point at = to.At(x, low.y(), low.z());
    svg.Text({at.x - 5, at.y + 15}, TickText(x, StepOf(xs)), Anchor::kMiddle, 11);
  }
  for (const double y : ys) {
    svg.Line(to.At(low.x(), y, low.z()), to.At(high.x(), y, low.z()), grid);
    svg.Line(to.At(low.x(), y, low.z()), to.At(low.x(), y, high.z()), grid);
    const Point at = to.At(high.x(), y, low.z());
    svg.Text({at.x + 6, at.y + 13}, TickText(y, StepOf(ys)), Anchor::kStart, 11);
  }
  for (const double z : zs) {
    svg.Line(to.At(low.x(), low.y(), z), to.At(low.x(), high.y(), z), grid);
    svg.Line(to.At(low.x(), high.y(), z), to.At(high.x(), high.y(), z), grid);
    const Point at = to.At(low.x(), low.y(), z);
    svg.Text({at.x - 6, at.y + 4}, TickText(z, StepOf(zs)), Anchor::kEnd, 11);
  }
  const std::array<Point, 6> corners = {
      to.At(low.x(), low.y(), low.z()),   to.At(high.x(), low.y(), low.z()),
      to.At(high.x(), high.y(), low.z()), to.At(high.x(), high.y(), high.z()),
      to.At(low.x(), high.y(), high.z()), to.At(low.x(), low.y(), high.z())};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    svg.Line(corners[i], corners[(i + 1) % corners.size()], edge);
  }
  const Point back = to.At(low.x(), high.y(), low.z());
  svg.Line(back, corners[0], edge);
  svg.Line(back, corners[2], edge);
  svg.Line(back, corners[4], edge);

  const Eigen::Vector3d middle = (low + high) / 2;
  const Point x_at = to.At(middle.x(), low.y(), low.z());
  svg.Text({x_at.x - 22, x_at.y + 37}, "x in " + unit, Anchor::kMiddle, 12);
  const Point y_at = to.At(high.x(), middle.y(), low.z());
  svg.Text({y_at.x + 30, y_at.y + 34}, "y in " + unit, Anchor::kMiddle, 12);
  const Point z_at = to.At(low.x(), low.y(), middle.z());
  svg.UprightText({z_at.x - 48, z_at.y}, "z in " + unit, 12);
}

}  // namespace

void Panel3::Path(const Eigen::Ref<const Eigen::MatrixXd>& points, const Stroke& stroke,
                  const std::string& label) {
  if (points.rows() == 0) return;
  curves_.push_back({points, stroke});
  AddLegend({.label = label, .stroke = stroke, .symbol = {}});
}

void Panel3::Mark(const Eigen::Vector3d& at, Symbol symbol, double size, const std::string& colour,
                  const std::string& label) {
  marks_.push_back({at, symbol, size, colour});
  AddLegend({.label = label, .stroke = {.colour = colour}, .symbol = symbol});
}

Eigen::Vector3d Panel3::low() const {
  Eigen::Vector3d result;
  std::array<Range, 3> ranges;
  double longest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    Range& range = ranges[static_cast<std::size_t>(axis)];
    for (const Curve& curve : curves_) {
      for (const double value : curve.points.col(axis)) range.Include(value);
    }
    for (const Single& mark : marks_) range.Include(mark.at[axis]);
    longest = std::max(longest, range.length());
  }
  if (!(longest > 0)) longest = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const Range& range = ranges[static_cast<std::size_t>(axis)];
    const double extent = std::max(1.06 * range.length(), kLeastPart * longest);
    result[axis] = (range.low + range.high) / 2 - extent / 2;
  }
  return result;
}

Eigen::Vector3d Panel3::high() const {
  // The box is centred on the data.
  const Eigen::Vector3d corner = low();
  Eigen::Vector3d result;
  for (int axis = 0; axis < 3; ++axis) {
    Range range;
    for (const Curve& curve : curves_) {
      for (const double value : curve.points.col(axis)) range.Include(value);
    }
    for (const Single& mark : marks_) range.Include(mark.at[axis]);
    result[axis] = range.low + range.high - corner[axis];
  }
  return result;
}

void Panel3::Draw(Svg& svg) const {
  const Eigen::Vector3d from = low();
  const Eigen::Vector3d until = high();
  const Projection to(from, until, box_);
  DrawBox(svg, to, from, until, unit_);
  const auto draw = [&](const Curve& curve, bool shadow) {
    std::vector<Point> line;
    for (Eigen::Index i = 0; i < curve.points.rows(); ++i) {
      Eigen::Vector3d point = curve.points.row(i).transpose();
      if (!point.allFinite()) continue;
      if (shadow) point.z() = from.z();
      line.push_back(to.At(point));
    }
    svg.Polyline(line, shadow ? Stroke{.colour = "#c8c8c8", .width = 1} : curve.stroke);
  };
  for (const Curve& curve : curves_) draw(curve, true);
  for (const Curve& curve : curves_) draw(curve, false);
  for (const Single& mark : marks_) {
    svg.Mark(to.At(mark.at), mark.symbol, mark.size, mark.colour);
  }
  svg.Text({box_.left, box_.top - 9}, title_, Anchor::kStart, 14);
}

}  // namespace exemplar::figures
