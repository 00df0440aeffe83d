#include <algorithm>
#include <cassert>
#include <cmath>

#include "exemplar/figures/plot.hpp"

namespace exemplar::figures {
namespace {

constexpr double kRoom = 0.06;  // of the data's extent, beside it

Range Padded(Range range, double part) {
  if (range.empty) return {.low = 0, .high = 1, .empty = false};
  const double extent = range.length();
  const double size = std::max(std::abs(range.low), std::abs(range.high));
  const double room = extent > 1e-9 * size ? part * extent : (size > 0 ? 0.1 * size : 0.5);
  return {.low = range.low - room, .high = range.high + room, .empty = false};
}

Range Widened(const Range& range, double length) {
  const double middle = (range.low + range.high) / 2;
  return {.low = middle - length / 2, .high = middle + length / 2, .empty = false};
}

double StepOf(const std::vector<double>& ticks) {
  return ticks.size() > 1 ? ticks[1] - ticks[0] : std::max(std::abs(ticks.front()), 1e-12);
}

}  // namespace

void Panel::Line(const std::vector<double>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
                 const Stroke& stroke, const std::string& label) {
  assert(static_cast<Eigen::Index>(x.size()) == y.size());
  for (const double value : x) x_.Include(value);
  for (const double value : y) y_.Include(value);
  curves_.push_back({x, y, stroke});
  AddLegend({.label = label, .stroke = stroke, .symbol = {}});
}

void Panel::Marks(const std::vector<Point>& at, Symbol symbol, double size,
                  const std::string& colour, const std::string& label) {
  for (const Point& point : at) {
    x_.Include(point.x);
    y_.Include(point.y);
  }
  points_.push_back({at, symbol, size, colour});
  if (!at.empty()) {
    AddLegend({.label = label,
               .stroke = {.colour = colour == "white" ? kPale : colour},
               .symbol = symbol});
  }
}

void Panel::Horizontal(double y, const Stroke& stroke, const std::string& label) {
  y_.Include(y);
  horizontals_.push_back({.from = y, .to = y, .stroke = stroke});
  AddLegend({.label = label, .stroke = stroke, .symbol = {}});
}

void Panel::Vertical(double x, const Stroke& stroke, const std::string& label) {
  x_.Include(x);
  verticals_.push_back({.from = x, .to = x, .stroke = stroke});
  AddLegend({.label = label, .stroke = stroke, .symbol = {}});
}

void Panel::Stretch(double from, double to, const std::string& colour, const std::string& label) {
  x_.Include(from);
  x_.Include(to);
  const Stroke stroke{.colour = colour, .opacity = 0.15};
  verticals_.push_back({.from = from, .to = to, .stroke = stroke, .shaded = true});
  AddLegend({.label = label, .stroke = stroke, .symbol = {}, .area = true});
}

void Panel::Band(const std::vector<double>& x, const Eigen::Ref<const Eigen::VectorXd>& low,
                 const Eigen::Ref<const Eigen::VectorXd>& high, const std::string& colour,
                 const std::string& label) {
  assert(static_cast<Eigen::Index>(x.size()) == low.size() && low.size() == high.size());
  for (const double value : x) x_.Include(value);
  for (const double value : low) y_.Include(value);
  for (const double value : high) y_.Include(value);
  areas_.push_back({x, low, high, colour});
  AddLegend(
      {.label = label, .stroke = {.colour = colour, .opacity = 0.2}, .symbol = {}, .area = true});
}

void Panel::Heat(const std::vector<double>& x, const std::vector<double>& y,
                 const Eigen::MatrixXd& values, double full) {
  assert(x.size() > 1 && y.size() > 1);
  const double half_x = (x[1] - x[0]) / 2;
  const double half_y = (y[1] - y[0]) / 2;
  for (const double value : {x.front() - half_x, x.back() + half_x}) x_.Include(value);
  for (const double value : {y.front() - half_y, y.back() + half_y}) y_.Include(value);
  map_ = Map{x, y, values, full};
}

Range Panel::x_range() const {
  const double room = map_.has_value() || tight_x_ ? 0 : kRoom;
  const Range x = Padded(x_, room);
  if (!equal_) return x;
  const double scale =
      std::max(x.length() / box_.width, Padded(y_, map_ ? 0 : kRoom).length() / box_.height);
  return Widened(x, scale * box_.width);
}

Range Panel::y_range() const {
  const Range y = Padded(y_, map_.has_value() ? 0 : kRoom);
  if (!equal_) return y;
  const double scale =
      std::max(Padded(x_, map_.has_value() || tight_x_ ? 0 : kRoom).length() / box_.width,
               y.length() / box_.height);
  return Widened(y, scale * box_.height);
}

Point Panel::At(double x, double y) const {
  const Range xs = x_range();
  const Range ys = y_range();
  return {box_.left + (x - xs.low) / xs.length() * box_.width,
          box_.bottom() - (y - ys.low) / ys.length() * box_.height};
}

void Panel::DrawAxes(Svg& svg) const {
  const Range xs = x_range();
  const Range ys = y_range();
  const bool over_map = map_.has_value();
  const Stroke grid{.colour = kGrid};
  const Stroke tick_mark{.colour = kInk};
  const std::vector<double> x_ticks =
      Ticks(xs.low, xs.high, std::max(2, static_cast<int>(box_.width / 70)));
  for (const double value : x_ticks) {
    const double x = At(value, ys.low).x;
    if (!over_map) svg.Line({x, box_.top}, {x, box_.bottom()}, grid);
    if (over_map) svg.Line({x, box_.bottom()}, {x, box_.bottom() + 5}, tick_mark);
    svg.Text({x, box_.bottom() + 18}, TickText(value, StepOf(x_ticks)), Anchor::kMiddle, 12);
  }
  const std::vector<double> y_ticks =
      Ticks(ys.low, ys.high, std::max(2, static_cast<int>(box_.height / 36)));
  for (const double value : y_ticks) {
    const double y = At(xs.low, value).y;
    if (!over_map) svg.Line({box_.left, y}, {box_.right(), y}, grid);
    if (over_map) svg.Line({box_.left - 5, y}, {box_.left, y}, tick_mark);
    svg.Text({box_.left - 7, y + 4}, TickText(value, StepOf(y_ticks)), Anchor::kEnd, 12);
  }
  svg.Text({box_.left + box_.width / 2, box_.bottom() + 37}, text_.x, Anchor::kMiddle);
  svg.UprightText({box_.left - 52, box_.top + box_.height / 2}, text_.y);
  svg.Text({box_.left, box_.top - 9}, text_.title, Anchor::kStart, 14);
}

void Panel::DrawHeat(Svg& svg) const {
  const double half_x = (map_->x[1] - map_->x[0]) / 2;
  const double half_y = (map_->y[1] - map_->y[0]) / 2;
  for (std::size_t r = 0; r < map_->y.size(); ++r) {
    for (std::size_t c = 0; c < map_->x.size(); ++c) {
      const Point low = At(map_->x[c] - half_x, map_->y[r] - half_y);
      const Point high = At(map_->x[c] + half_x, map_->y[r] + half_y);
      const double value = map_->values(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
      // A little over the next cell, which is drawn later: no seam.
      svg.Cell({low.x, high.y - 0.6, high.x - low.x + 0.6, low.y - high.y + 0.6},
               HeatColour(value / map_->full));
    }
  }
}

void Panel::Draw(Svg& svg) const {
  DrawAxes(svg);
  svg.BeginClip(box_);
  if (map_.has_value()) DrawHeat(svg);
  for (const Across& stretch : verticals_) {
    if (!stretch.shaded) continue;
    const double left = At(stretch.from, 0).x;
    const double width = std::max(1.5, At(stretch.to, 0).x - left);
    svg.Box({left, box_.top, width, box_.height}, stretch.stroke.colour, stretch.stroke.opacity);
  }
  for (const Area& area : areas_) {
    std::vector<Point> outline;
    const auto n = static_cast<Eigen::Index>(area.x.size());
    for (Eigen::Index i = 0; i < n; ++i) {
      outline.push_back(At(area.x[static_cast<std::size_t>(i)], area.low[i]));
    }
    for (Eigen::Index i = n; i-- > 0;) {
      outline.push_back(At(area.x[static_cast<std::size_t>(i)], area.high[i]));
    }
    svg.Polygon(outline, area.colour, 0.2);
  }
  for (const Across& line : horizontals_) {
    const double y = At(0, line.from).y;
    svg.Line({box_.left, y}, {box_.right(), y}, line.stroke);
  }
  for (const Across& line : verticals_) {
    if (line.shaded) continue;
    const double x = At(line.from, 0).x;
    svg.Line({x, box_.top}, {x, box_.bottom()}, line.stroke);
  }
  for (const Curve& curve : curves_) {
    std::vector<Point> piece;
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      const double y = curve.y[static_cast<Eigen::Index>(i)];
      if (std::isfinite(curve.x[i]) && std::isfinite(y)) {
        piece.push_back(At(curve.x[i], y));
      } else {
        svg.Polyline(piece, curve.stroke);
        piece.clear();
      }
    }
    svg.Polyline(piece, curve.stroke);
  }
  for (const Points& points : points_) {
    for (const Point& point : points.at) {
      svg.Mark(At(point.x, point.y), points.symbol, points.size, points.colour);
    }
  }
  svg.EndClip();
  svg.Frame(box_, {.colour = kInk});
}

void ColourBar::Draw(Svg& svg) const {
  constexpr int kSteps = 64;
  for (int i = 0; i < kSteps; ++i) {
    const double height = box_.height / kSteps;
    svg.Cell({box_.left, box_.bottom() - (i + 1) * height, box_.width, height + 0.5},
             HeatColour((i + 0.5) / kSteps));
  }
  svg.Frame(box_, {.colour = kInk});
  const std::vector<double> ticks =
      Ticks(0, full_, std::max(2, static_cast<int>(box_.height / 40)));
  for (const double value : ticks) {
    const double y = box_.bottom() - value / full_ * box_.height;
    svg.Line({box_.right(), y}, {box_.right() + 5, y}, {.colour = kInk});
    svg.Text({box_.right() + 8, y + 4}, TickText(value, StepOf(ticks)), Anchor::kStart, 12);
  }
  svg.UprightText({box_.right() + 52, box_.top + box_.height / 2}, label_);
}

}  // namespace exemplar::figures
