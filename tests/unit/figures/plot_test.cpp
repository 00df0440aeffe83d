#include "exemplar/figures/plot.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "exemplar/base/rng.hpp"
#include "well_formed.hpp"

namespace exemplar::figures {
namespace {

TEST(Ticks, AreRoundAndInside) {
  EXPECT_THAT(Ticks(0, 1, 5),
              testing::Pointwise(testing::DoubleNear(1e-12), {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}));
  Rng rng(5);
  for (int i = 0; i < 500; ++i) {
    const double low = rng.Uniform(-1, 1) * std::pow(10, rng.Uniform(-6, 6));
    const double high = low + std::pow(10, rng.Uniform(-3, 6));
    const std::vector<double> ticks = Ticks(low, high, 6);
    ASSERT_FALSE(ticks.empty()) << low << " " << high;
    EXPECT_LE(ticks.size(), 7U);
    EXPECT_GE(ticks.front(), low - 1e-6 * (high - low));
    EXPECT_LE(ticks.back(), high + 1e-6 * (high - low));
  }
}

TEST(Ticks, AreWrittenAsExactlyAsTheirStep) {
  EXPECT_EQ(TickText(0.2, 0.1), "0.2");
  EXPECT_EQ(TickText(-0.05, 0.05), "-0.05");
  EXPECT_EQ(TickText(1e-17, 0.1), "0");
  EXPECT_EQ(TickText(20, 10), "20");
  EXPECT_EQ(TickText(2e-7, 1e-7), "2e-07");
}

TEST(HeatColour, GoesFromDarkToLightAndIsHeldOutside) {
  EXPECT_EQ(HeatColour(0), "#440154");
  EXPECT_EQ(HeatColour(1), "#fde725");
  EXPECT_EQ(HeatColour(-3), HeatColour(0));
  EXPECT_EQ(HeatColour(std::numeric_limits<double>::quiet_NaN()), HeatColour(0));
}

TEST(Panel, AxesHoldTheDatasExtremes) {
  Rng rng(9);
  for (const bool equal : {false, true}) {
    Panel panel({100, 50, 400, 200}, {.title = "t", .x = "x", .y = "y"});
    if (equal) panel.EqualScale();
    std::vector<double> x;
    Eigen::VectorXd y(50);
    for (int i = 0; i < 50; ++i) {
      x.push_back(rng.Uniform(-3, 8));
      y[i] = rng.Uniform(0, 1e-3);
    }
    panel.Line(x, y, {});
    for (int i = 0; i < 50; ++i) {
      const Point at = panel.At(x[static_cast<std::size_t>(i)], y[i]);
      EXPECT_GE(at.x, 100);
      EXPECT_LE(at.x, 500);
      EXPECT_GE(at.y, 50);
      EXPECT_LE(at.y, 250);
    }
    EXPECT_GT(panel.At(0, 0).y, panel.At(0, 1e-3).y);
    if (equal) {
      EXPECT_NEAR(panel.x_range().length() / 400, panel.y_range().length() / 200, 1e-12);
    }
  }
}

TEST(Panel, ConstantAndMissingValuesAreDrawn) {
  Page page("nothing moves");
  Panel& panel = page.Add<Panel>(Rect{80, 80, 300, 200}, PanelText{.title = "", .x = "", .y = ""});
  panel.Line({0, 1, 2, 3}, Eigen::Vector4d(2, 2, std::nan(""), 2), {.colour = kBlue}, "two");
  EXPECT_LT(panel.y_range().low, 2);
  EXPECT_GT(panel.y_range().high, 2);
  page.Add<Panel>(Rect{480, 80, 300, 200}, PanelText{.title = "empty", .x = "", .y = ""});
  EXPECT_EQ(WrongIn(page.ToSvg()), "");
}

TEST(Panel3, BoxHoldsPathsAndMarks) {
  Panel3 panel({0, 0, 400, 400}, "", "m");
  Eigen::MatrixXd path(3, 3);
  path << 0, 0, 0, 1, 2, 0, 3, 1, 0;
  panel.Path(path, {});
  panel.Mark({-1, 0, 0.5}, Symbol::kCross, 9, kRed);
  EXPECT_TRUE((panel.low().array() <= Eigen::Array3d(-1, 0, 0)).all());
  EXPECT_TRUE((panel.high().array() >= Eigen::Array3d(3, 2, 0.5)).all());
}

TEST(Page, LegendNamesEachThingOnceAndStaysOnThePage) {
  Page page("A & B < C");
  Panel& panel = page.Add<Panel>(Rect{80, 80, 300, 200}, PanelText{.title = "", .x = "", .y = ""});
  for (int i = 0; i < 20; ++i) {
    panel.Line({0, 1}, Eigen::Vector2d(0, i), {},
               "a line with quite a long name \"" + std::to_string(i % 10) + "\"");
  }
  const std::string svg = page.ToSvg();
  EXPECT_EQ(WrongIn(svg), "");
  EXPECT_THAT(svg, testing::HasSubstr("A &amp; B &lt; C"));
  std::size_t count = 0;
  for (std::size_t at = svg.find("name &quot;3"); at != std::string::npos;
       at = svg.find("name &quot;3", at + 1)) {
    ++count;
  }
  EXPECT_EQ(count, 1U);
}

TEST(WrongIn, FindsWhatIsWrong) {
  EXPECT_EQ(WrongIn("<a><b c=\"1\"/>x &amp; y</a>"), "");
  EXPECT_NE(WrongIn("<a><b></a></b>"), "");
  EXPECT_NE(WrongIn("<a b=\"nan\"/>"), "");
  EXPECT_NE(WrongIn("<a>x & y</a>"), "");
}

}  // namespace
}  // namespace exemplar::figures
