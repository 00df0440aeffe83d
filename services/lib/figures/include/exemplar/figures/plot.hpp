#pragma once
// Diagrams: pages of panels with axes, units and one legend. Panels collect what is drawn and fit
// their axes to it.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "exemplar/figures/svg.hpp"

namespace exemplar::figures {

/// Okabe & Ito's colours, told apart by colour-blind people.
inline constexpr const char* kInk = "#222222";
inline constexpr const char* kGrid = "#dddddd";
inline constexpr const char* kPale = "#b8b8b8";
inline constexpr const char* kBlue = "#0072b2";
inline constexpr const char* kOrange = "#e69f00";
inline constexpr const char* kGreen = "#009e73";
inline constexpr const char* kVermilion = "#d55e00";
inline constexpr const char* kPurple = "#cc79a7";
inline constexpr const char* kSky = "#56b4e9";
inline constexpr const char* kRed = "#cc2222";
/// The i-th trial's colour; repeats after the palette's end.
std::string TrialColour(std::size_t i);
/// Dark to light with even steps in brightness; s in [0, 1].
std::string HeatColour(double s);

/// An interval of an axis. Empty until something is in it.
struct Range {
  double low = 0;
  double high = 0;
  bool empty = true;
  void Include(double value);
  double length() const { return high - low; }
};

/// Round values within [low, high], about `count` of them, steps of 1, 2 or 5 times a power of ten.
std::vector<double> Ticks(double low, double high, int count);
/// The tick as text, as exact as the step asks for.
std::string TickText(double value, double step);

struct LegendEntry {
  std::string label;
  Stroke stroke;
  std::optional<Symbol> symbol;
  bool area = false;
};

/// One thing to be drawn on a page.
class PagePart {
 public:
  virtual ~PagePart() = default;
  virtual void Draw(Svg& svg) const = 0;
  /// Everything drawn lies above this.
  virtual double bottom() const = 0;
  const std::vector<LegendEntry>& legend() const { return legend_; }

 protected:
  /// Nothing for an empty label or one that is there.
  void AddLegend(LegendEntry entry);

 private:
  std::vector<LegendEntry> legend_;
};

struct PanelText {
  std::string title;
  std::string x;  ///< with its unit: "time in s"
  std::string y;
};

/// Axes in the plane. `box` is the frame; ticks and labels lie around it: 64 px left, 44 below, 24
/// above. NaNs are not drawn.
class Panel final : public PagePart {
 public:
  Panel(const Rect& box, PanelText text) : box_(box), text_(std::move(text)) {}

  void Line(const std::vector<double>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
            const Stroke& stroke, const std::string& label = {});
  void Marks(const std::vector<Point>& at, Symbol symbol, double size, const std::string& colour,
             const std::string& label = {});
  void Horizontal(double y, const Stroke& stroke, const std::string& label = {});
  void Vertical(double x, const Stroke& stroke, const std::string& label = {});
  /// A stretch of x, shaded over the whole height.
  void Stretch(double from, double to, const std::string& colour, const std::string& label = {});
  /// The area between two curves.
  void Band(const std::vector<double>& x, const Eigen::Ref<const Eigen::VectorXd>& low,
            const Eigen::Ref<const Eigen::VectorXd>& high, const std::string& colour,
            const std::string& label = {});
  /// values(row, column) at (x[column], y[row]), evenly spaced. Coloured from 0 to `full`.
  void Heat(const std::vector<double>& x, const std::vector<double>& y,
            const Eigen::MatrixXd& values, double full);
  /// Makes the axes reach these values.
  void ReachX(double x) { x_.Include(x); }
  void ReachY(double y) { y_.Include(y); }
  /// One scale for both axes: the longer one fits.
  void EqualScale() { equal_ = true; }
  /// No room is left at the ends of x.
  void TightX() { tight_x_ = true; }

  /// What the axes show.
  Range x_range() const;
  Range y_range() const;
  Point At(double x, double y) const;

  void Draw(Svg& svg) const override;
  double bottom() const override { return box_.bottom() + 46; }

 private:
  struct Curve {
    std::vector<double> x;
    Eigen::VectorXd y;
    Stroke stroke;
  };
  struct Points {
    std::vector<Point> at;
    Symbol symbol;
    double size;
    std::string colour;
  };
  struct Area {
    std::vector<double> x;
    Eigen::VectorXd low, high;
    std::string colour;
  };
  struct Across {
    double from = 0, to = 0;
    Stroke stroke;
    bool shaded = false;
  };
  struct Map {
    std::vector<double> x, y;
    Eigen::MatrixXd values;
    double full = 1;
  };
  void DrawAxes(Svg& svg) const;
  void DrawHeat(Svg& svg) const;

  Rect box_;
  PanelText text_;
  Range x_, y_;
  bool equal_ = false;
  bool tight_x_ = false;
  std::vector<Curve> curves_;
  std::vector<Points> points_;
  std::vector<Area> areas_;
  std::vector<Across> horizontals_, verticals_;
  std::optional<Map> map_;
};

/// The scale of heat maps, upright.
class ColourBar final : public PagePart {
 public:
  ColourBar(const Rect& box, double full, std::string label)
      : box_(box), full_(full), label_(std::move(label)) {}
  void Draw(Svg& svg) const override;
  double bottom() const override { return box_.bottom() + 10; }

 private:
  Rect box_;
  double full_;
  std::string label_;
};

/// Paths in space, seen from the front, right and above, in parallel projection, one scale for all
/// axes. Paths' shadows lie on the floor.
class Panel3 final : public PagePart {
 public:
  Panel3(const Rect& box, std::string title, std::string unit)
      : box_(box), title_(std::move(title)), unit_(std::move(unit)) {}

  /// Rows are points.
  void Path(const Eigen::Ref<const Eigen::MatrixXd>& points, const Stroke& stroke,
            const std::string& label = {});
  void Mark(const Eigen::Vector3d& at, Symbol symbol, double size, const std::string& colour,
            const std::string& label = {});

  /// Low and high corner of what the axes show.
  Eigen::Vector3d low() const;
  Eigen::Vector3d high() const;

  void Draw(Svg& svg) const override;
  double bottom() const override { return box_.bottom() + 8; }

 private:
  struct Curve {
    Eigen::MatrixXd points;
    Stroke stroke;
  };
  struct Single {
    Eigen::Vector3d at;
    Symbol symbol;
    double size;
    std::string colour;
  };
  Rect box_;
  std::string title_, unit_;
  std::vector<Curve> curves_;
  std::vector<Single> marks_;
};

/// A picture of panels with a title above and the legend below.
class Page {
 public:
  explicit Page(std::string title, double width = 1000) : title_(std::move(title)), width_(width) {}

  /// Room for panels begins here.
  static constexpr double kTop = 74;

  template <class Part, class... Args>
  Part& Add(Args&&... args) {
    auto part = std::make_unique<Part>(std::forward<Args>(args)...);
    Part& added = *part;
    parts_.push_back(std::move(part));
    return added;
  }
  /// Boxes of panels beside each other over the page's width, with room for their labels.
  std::vector<Rect> Row(int count, double top, double height) const;

  std::string ToSvg() const;

 private:
  std::string title_;
  double width_;
  std::vector<std::unique_ptr<PagePart>> parts_;
};

}  // namespace exemplar::figures
