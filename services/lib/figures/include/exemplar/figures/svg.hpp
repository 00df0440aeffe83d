#pragma once
// SVG as text: elements in pixels, y downwards.

#include <string>
#include <string_view>
#include <vector>

namespace exemplar::figures {

struct Point {
  double x = 0;
  double y = 0;
};

struct Rect {
  double left = 0;
  double top = 0;
  double width = 0;
  double height = 0;
  double right() const { return left + width; }
  double bottom() const { return top + height; }
};

/// How a line is drawn.
struct Stroke {
  std::string colour = "#222222";
  double width = 1;
  std::string dash = {};  ///< "5 3", or empty: solid
  double opacity = 1;
};

enum class Anchor { kStart, kMiddle, kEnd };

enum class Symbol { kDisc, kRing, kTriangle, kSquare, kCross };

/// A document that grows element by element. Thread-compatible.
class Svg {
 public:
  void Line(Point from, Point to, const Stroke& stroke);
  void Polyline(const std::vector<Point>& points, const Stroke& stroke);
  void Polygon(const std::vector<Point>& points, std::string_view fill, double opacity);
  void Box(const Rect& rect, std::string_view fill, double opacity = 1);
  void Frame(const Rect& rect, const Stroke& stroke);
  /// Without seams between neighbours.
  void Cell(const Rect& rect, std::string_view fill);
  void Mark(Point at, Symbol symbol, double size, std::string_view colour);
  void Text(Point at, std::string_view text, Anchor anchor, double size = 13);
  /// Reads upwards.
  void UprightText(Point at, std::string_view text, double size = 13);
  void BeginClip(const Rect& rect);
  void EndClip();

  /// The whole document, on white.
  std::string Document(double width, double height, std::string_view title) const;

 private:
  std::string body_;
  int clips_ = 0;
};

/// About how wide a text is drawn, px.
double TextWidth(std::string_view text, double size = 13);

}  // namespace exemplar::figures
