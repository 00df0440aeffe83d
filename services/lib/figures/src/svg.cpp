#include "exemplar/figures/svg.hpp"

#include <cmath>

#include "exemplar/base/text.hpp"
#include "exemplar/base/xml.hpp"

namespace exemplar::figures {
namespace {

// A tenth of a pixel is finer than anybody sees.
std::string Px(double value) {
  std::string text = FormatFixed(std::isfinite(value) ? value : 0, 1);
  if (text.ends_with(".0")) text.resize(text.size() - 2);
  return text == "-0" ? "0" : text;
}

std::string Attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + EscapeXml(value) + "\"";
}

std::string Attribute(std::string_view name, double value) { return Attribute(name, Px(value)); }

std::string Points(const std::vector<Point>& points) {
  std::string text;
  for (const Point& point : points) {
    if (!text.empty()) text += ' ';
    text += Px(point.x) + "," + Px(point.y);
  }
  return Attribute("points", text);
}

std::string Opacity(std::string_view name, double opacity) {
  return opacity < 1 ? Attribute(name, FormatFixed(opacity, 2)) : std::string();
}

std::string Of(const Stroke& stroke) {
  std::string text = Attribute("stroke", stroke.colour) + Attribute("stroke-width", stroke.width);
  if (!stroke.dash.empty()) text += Attribute("stroke-dasharray", stroke.dash);
  return text + Opacity("stroke-opacity", stroke.opacity);
}

std::string Of(const Rect& rect) {
  return Attribute("x", rect.left) + Attribute("y", rect.top) + Attribute("width", rect.width) +
         Attribute("height", rect.height);
}

std::string_view NameOf(Anchor anchor) {
  switch (anchor) {
    case Anchor::kStart:
      return "start";
    case Anchor::kMiddle:
      return "middle";
    case Anchor::kEnd:
      break;
  }
  return "end";
}

}  // namespace

void Svg::Line(Point from, Point to, const Stroke& stroke) {
  body_ += "<line" + Attribute("x1", from.x) + Attribute("y1", from.y) + Attribute("x2", to.x) +
           Attribute("y2", to.y) + Of(stroke) + "/>\n";
}

void Svg::Polyline(const std::vector<Point>& points, const Stroke& stroke) {
  if (points.empty()) return;
  body_ +=
      "<polyline fill=\"none\" stroke-linejoin=\"round\"" + Points(points) + Of(stroke) + "/>\n";
}

void Svg::Polygon(const std::vector<Point>& points, std::string_view fill, double opacity) {
  body_ += "<polygon" + Points(points) + Attribute("fill", fill) +
           Opacity("fill-opacity", opacity) + "/>\n";
}

void Svg::Box(const Rect& rect, std::string_view fill, double opacity) {
  body_ += "<rect" + Of(rect) + Attribute("fill", fill) + Opacity("fill-opacity", opacity) + "/>\n";
}

void Svg::Frame(const Rect& rect, const Stroke& stroke) {
  body_ += "<rect fill=\"none\"" + Of(rect) + Of(stroke) + "/>\n";
}

void Svg::Cell(const Rect& rect, std::string_view fill) {
  body_ += "<rect shape-rendering=\"crispEdges\"" + Of(rect) + Attribute("fill", fill) + "/>\n";
}

void Svg::Mark(Point at, Symbol symbol, double size, std::string_view colour) {
  const double r = size / 2;
  switch (symbol) {
    case Symbol::kDisc:
      body_ += "<circle" + Attribute("cx", at.x) + Attribute("cy", at.y) + Attribute("r", r) +
               Attribute("fill", colour) + "/>\n";
      return;
    case Symbol::kRing:
      body_ += "<circle fill=\"white\" stroke-width=\"1.8\"" + Attribute("cx", at.x) +
               Attribute("cy", at.y) + Attribute("r", r) + Attribute("stroke", colour) + "/>\n";
      return;
    case Symbol::kTriangle:
      Polygon({{at.x, at.y - r}, {at.x + r, at.y + r}, {at.x - r, at.y + r}}, colour, 1);
      return;
    case Symbol::kSquare:
      Box({at.x - r, at.y - r, size, size}, colour);
      return;
    case Symbol::kCross:
      break;
  }
  const Stroke stroke{.colour = std::string(colour), .width = 2.2};
  Line({at.x - r, at.y - r}, {at.x + r, at.y + r}, stroke);
  Line({at.x - r, at.y + r}, {at.x + r, at.y - r}, stroke);
}

void Svg::Text(Point at, std::string_view text, Anchor anchor, double size) {
  body_ += "<text" + Attribute("x", at.x) + Attribute("y", at.y) +
           Attribute("text-anchor", NameOf(anchor)) + Attribute("font-size", size) + ">" +
           EscapeXml(text) + "</text>\n";
}

void Svg::UprightText(Point at, std::string_view text, double size) {
  body_ += "<text text-anchor=\"middle\"" + Attribute("font-size", size) +
           Attribute("transform", "translate(" + Px(at.x) + " " + Px(at.y) + ") rotate(-90)") +
           ">" + EscapeXml(text) + "</text>\n";
}

void Svg::BeginClip(const Rect& rect) {
  const std::string id = "clip" + std::to_string(clips_++);
  body_ += "<clipPath id=\"" + id + "\"><rect" + Of(rect) + "/></clipPath>\n<g clip-path=\"url(#" +
           id + ")\">\n";
}

void Svg::EndClip() { body_ += "</g>\n"; }

std::string Svg::Document(double width, double height, std::string_view title) const {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + Px(width) + " " + Px(height) +
         "\" width=\"" + Px(width) + "\" height=\"" + Px(height) +
         "\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"13\" "
         "fill=\"#222222\">\n<title>" +
         EscapeXml(title) + "</title>\n<rect" + Of(Rect{0, 0, width, height}) +
         " fill=\"white\"/>\n" + body_ + "</svg>\n";
}

double TextWidth(std::string_view text, double size) {
  std::size_t characters = 0;
  for (const char c : text) {
    if ((static_cast<unsigned char>(c) & 0xC0U) != 0x80U) ++characters;  // UTF-8
  }
  return 0.55 * size * static_cast<double>(characters);
}

}  // namespace exemplar::figures
