#include "src/output/plot.h"

#include "src/output/image_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace simulcap {
namespace {

using Values = std::vector<double>;

TEST(AxisTicks, LinearOnesAreRoundAndCoverTheValues) {
  const AxisTicks ticks = axisTicks(AxisScale::kLinear, 0.3, 9.2);
  EXPECT_EQ(ticks.labelled, (Values{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(ticks.low, 0.0);
  EXPECT_EQ(ticks.high, 10.0);
}

TEST(AxisTicks, LogarithmicOnesArePowersOfTen) {
  const AxisTicks ticks = axisTicks(AxisScale::kLogarithmic, 0.02, 300.0);
  ASSERT_EQ(ticks.labelled.size(), 4U);
  for (std::size_t i = 0; i < ticks.labelled.size(); ++i)
    EXPECT_DOUBLE_EQ(ticks.labelled[i], std::pow(10.0, static_cast<double>(i) - 1.0));
  for (const double tick : ticks.minor)
    EXPECT_TRUE(tick >= ticks.low && tick <= ticks.high) << tick;
}

TEST(AxisTicks, ShortLogarithmicAxesHaveTwosAndFives) {
  const AxisTicks ticks = axisTicks(AxisScale::kLogarithmic, 12.0, 90.0);
  EXPECT_EQ(ticks.labelled, (Values{10, 20, 50, 100}));
}

TEST(AxisTicks, OneValueIsEnough) {
  for (const AxisScale scale : {AxisScale::kLinear, AxisScale::kLogarithmic}) {
    const AxisTicks ticks = axisTicks(scale, 5.0, 5.0);
    EXPECT_LE(ticks.low, 5.0);
    EXPECT_GT(ticks.high, ticks.low);
    EXPECT_GE(ticks.high, 5.0);
  }
}

TEST(AxisTicks, RefuseWhatTheyCannotShow) {
  EXPECT_THROW(axisTicks(AxisScale::kLogarithmic, 0.0, 1.0), std::invalid_argument);
  EXPECT_THROW(axisTicks(AxisScale::kLinear, 2.0, 1.0), std::invalid_argument);
  EXPECT_THROW(axisTicks(AxisScale::kLinear, std::nan(""), 1.0), std::invalid_argument);
}

TEST(AxisPosition, EqualFactorsAreEqualWaysOnALogarithmicAxis) {
  AxisTicks ticks;
  ticks.low = 0.1;
  ticks.high = 1000.0;
  EXPECT_DOUBLE_EQ(axisPosition(AxisScale::kLogarithmic, ticks, 0.1), 0.0);
  EXPECT_DOUBLE_EQ(axisPosition(AxisScale::kLogarithmic, ticks, 10.0), 0.5);
  EXPECT_DOUBLE_EQ(axisPosition(AxisScale::kLogarithmic, ticks, 1000.0), 1.0);
}

TEST(TickLabel, IsShort) {
  EXPECT_EQ(tickLabel(0.001), "0.001");
  EXPECT_EQ(tickLabel(20.0), "20");
  EXPECT_EQ(tickLabel(1e7), "1e+07");
}

Plot samplePlot() {
  Plot plot;
  plot.title = "a < b & \"c\"";
  plot.x = {"x [ms]", AxisScale::kLogarithmic};
  plot.y = {"y [mm]", AxisScale::kLogarithmic};
  plot.series = {
      {.name = "one", .color = {1, 0, 0}, .points = {{1, 1, "first"}, {10, 0.1, "last"}}}};
  return plot;
}

TEST(DrawnPlot, ShowsTitlesNamesAndLabels) {
  const std::string text = svg(drawn(samplePlot()));
  for (const char* words :
       {"x [ms]", "y [mm]", ">one<", ">first<", ">last<", "a &lt; b &amp; &quot;c&quot;"})
    EXPECT_NE(text.find(words), std::string::npos) << words;
}

TEST(DrawnPlot, LeavesOutPointsThatHaveNoPlace) {
  Plot plot = samplePlot();
  const std::size_t before = drawn(plot).items.size();
  plot.series[0].points.push_back({0.0, 1.0, "zero"});
  plot.series[0].points.push_back({std::numeric_limits<double>::quiet_NaN(), 1.0, "nan"});
  EXPECT_EQ(drawn(plot).items.size(), before);
}

TEST(DrawnPlot, IsEmptyWithoutSeries) {
  Plot plot = samplePlot();
  plot.series.clear();
  EXPECT_NE(svg(drawn(plot)).find("x [ms]"), std::string::npos);
}

TEST(DrawnPlot, RefusesSizesOutsideItsRange) {
  Plot plot = samplePlot();
  plot.width = 10;
  EXPECT_THROW(drawn(plot), std::invalid_argument);
}

TEST(Svg, RefusesCoordinatesThatAreNotFinite) {
  Drawing drawing{.width = 10, .height = 10, .items = {}};
  drawing.items.emplace_back(DrawnLine{.points = {{0, 0}, {std::nan(""), 1}}});
  EXPECT_THROW(svg(drawing), std::invalid_argument);
}

TEST(Svg, ColorsAreHexadecimal) {
  EXPECT_EQ(htmlColor({1.0, 0.5, 0.0}), "#ff8000");
  EXPECT_EQ(htmlColor({-1.0, 2.0, 0.0}), "#00ff00");
}

TEST(Rasterized, DrawsWhereAndInWhichColorTheDrawingSays) {
  Drawing drawing{.width = 20, .height = 10, .items = {}};
  drawing.items.emplace_back(DrawnLine{
      .points = {{0, 0}, {10, 0}, {10, 10}, {0, 10}},
      .width = 0.0,
      .closed = true,
      .filled = true,
      .fillColor = {1, 0, 0}});
  const avatar::ColorImage image = rasterized(drawing, 2.0);
  ASSERT_EQ(image.width, 40);
  ASSERT_EQ(image.height, 20);
  const auto pixel = [&](int x, int y) {
    const auto at = 3 * static_cast<std::size_t>(y * image.width + x);
    return std::vector<int>{image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]};
  };
  EXPECT_EQ(pixel(10, 10), (std::vector{255, 0, 0}));
  EXPECT_EQ(pixel(30, 10), (std::vector{255, 255, 255}));
}

}  // namespace
}  // namespace simulcap
