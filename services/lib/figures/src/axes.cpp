#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "exemplar/base/text.hpp"
#include "exemplar/figures/plot.hpp"

namespace exemplar::figures {

std::string TrialColour(std::size_t i) {
  static constexpr std::array kPalette = {kBlue,   kVermilion, kGreen,    kPurple,  kSky,
                                          kOrange, "#666666",  "#8b5a2b", "#004d40"};
  return kPalette[i % kPalette.size()];
}

std::string HeatColour(double s) {
  // Anchors of viridis (S. van der Walt, N. Smith).
  static constexpr std::array<std::array<int, 3>, 9> kAnchors = {{{68, 1, 84},
                                                                  {71, 44, 122},
                                                                  {59, 81, 139},
                                                                  {44, 113, 142},
                                                                  {33, 144, 141},
                                                                  {39, 173, 129},
                                                                  {92, 200, 99},
                                                                  {170, 220, 50},
                                                                  {253, 231, 37}}};
  const double at = std::clamp(std::isfinite(s) ? s : 0.0, 0.0, 1.0) * (kAnchors.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kAnchors.size() - 2);
  const double part = at - static_cast<double>(below);
  std::array<char, 8> text{};
  std::array<unsigned, 3> rgb{};
  for (std::size_t k = 0; k < 3; ++k) {
    rgb[k] = static_cast<unsigned>(
        std::lround((1 - part) * kAnchors[below][k] + part * kAnchors[below + 1][k]));
  }
  std::snprintf(text.data(), text.size(), "#%02x%02x%02x", rgb[0] & 0xFFU, rgb[1] & 0xFFU,
                rgb[2] & 0xFFU);
  return text.data();
}

void Range::Include(double value) {
  if (!std::isfinite(value)) return;
  low = empty ? value : std::min(low, value);
  high = empty ? value : std::max(high, value);
  empty = false;
}

std::vector<double> Ticks(double low, double high, int count) {
  if (!(high > low)) return {low};
  double step = std::pow(10, std::floor(std::log10((high - low) / count)));
  for (const double factor : {1.0, 2.0, 5.0, 10.0}) {
    if ((high - low) / (step * factor) <= count) {
      step *= factor;
      break;
    }
  }
  std::vector<double> ticks;
  const double first = std::ceil(low / step - 1e-9);
  const double last = std::floor(high / step + 1e-9);
  for (double i = first; i <= last; ++i) ticks.push_back(i * step);
  return ticks;
}

std::string TickText(double value, double step) {
  if (std::abs(value) < 1e-9 * step) return "0";
  const int decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  if (decimals <= 4 && std::abs(value) < 1e5) {
    return FormatFixed(value, decimals);
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

void PagePart::AddLegend(LegendEntry entry) {
  if (entry.label.empty()) return;
  for (const LegendEntry& there : legend_) {
    if (there.label == entry.label) return;
  }
  legend_.push_back(std::move(entry));
}

std::vector<Rect> Page::Row(int count, double top, double height) const {
  constexpr double kLeft = 76, kBetween = 84, kRight = 24;
  const double width = (width_ - kLeft - kRight - kBetween * (count - 1)) / count;
  std::vector<Rect> boxes;
  for (int i = 0; i < count; ++i) {
    boxes.push_back({kLeft + i * (width + kBetween), top, width, height});
  }
  return boxes;
}

std::string Page::ToSvg() const {
  constexpr double kMargin = 24, kLineHeight = 24, kSample = 28;
  Svg svg;
  svg.Text({kMargin, 32}, title_, Anchor::kStart, 18);
  std::vector<LegendEntry> legend;
  double bottom = kTop;
  for (const auto& part : parts_) {
    part->Draw(svg);
    bottom = std::max(bottom, part->bottom());
    for (const LegendEntry& entry : part->legend()) {
      if (std::none_of(legend.begin(), legend.end(),
                       [&](const LegendEntry& there) { return there.label == entry.label; })) {
        legend.push_back(entry);
      }
    }
  }
  double x = kMargin;
  double y = bottom + 22;
  for (const LegendEntry& entry : legend) {
    const double width = kSample + 8 + TextWidth(entry.label) + 22;
    if (x > kMargin && x + width > width_) {
      x = kMargin;
      y += kLineHeight;
    }
    const Point middle{x + kSample / 2, y - 4.5};
    if (entry.area) {
      svg.Box({x, y - 11, kSample, 13}, entry.stroke.colour, entry.stroke.opacity);
    } else if (entry.symbol.has_value()) {
      svg.Mark(middle, *entry.symbol, 10, entry.stroke.colour);
    } else {
      svg.Line({x, middle.y}, {x + kSample, middle.y}, entry.stroke);
    }
    svg.Text({x + kSample + 8, y}, entry.label, Anchor::kStart);
    x += width;
  }
  const double height = legend.empty() ? bottom + 12 : y + 18;
  return svg.Document(width_, height, title_);
}

}  // namespace exemplar::figures
