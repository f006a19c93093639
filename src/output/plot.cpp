#include "src/output/plot.h"

#include "src/output/image_file.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace simulcap {
namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTitleHeight = 13.0;  // of capitals [px], as all heights
constexpr double kTextHeight = 10.0;
constexpr double kLabelHeight = 8.0;
constexpr double kLineHeight = 19.0;
constexpr double kMarkerRadius = 5.0;
const Vector3d kGridColor = {0.87, 0.87, 0.87};
const Vector3d kMinorGridColor = {0.95, 0.95, 0.95};
const Vector3d kFrameColor = {0.35, 0.35, 0.35};

double widthOf(const std::string& text, double height) {
  return textWidth(text, static_cast<int>(std::ceil(height)));
}

bool isShown(AxisScale scale, double value) {
  return std::isfinite(value) && (scale == AxisScale::kLinear || value > 0.0);
}

AxisTicks linearTicks(double low, double high) {
  constexpr double kSteps = 6.0;
  const double extent = high > low ? high - low : std::max(1.0, std::abs(low));
  const double rough = extent / kSteps;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= rough)
      step = factor * power;
  }
  AxisTicks ticks;
  const long first = std::lround(std::floor(low / step));
  const long last = std::max(first + 1, std::lround(std::ceil(high / step)));
  for (long i = first; i <= last; ++i)
    ticks.labelled.push_back(static_cast<double>(i) * step);
  ticks.low = ticks.labelled.front();
  ticks.high = ticks.labelled.back();
  return ticks;
}

AxisTicks logarithmicTicks(double low, double high) {
  constexpr double kRoom = 1.25;  // on either side, as a factor
  AxisTicks ticks;
  ticks.low = low / kRoom;
  ticks.high = high * kRoom;
  const int first = static_cast<int>(std::floor(std::log10(ticks.low)));
  const int last = static_cast<int>(std::ceil(std::log10(ticks.high)));
  std::array<std::vector<double>, 10> byFactor;  // ticks factor · 10^n
  for (int exponent = first; exponent <= last; ++exponent) {
    for (std::size_t factor = 1; factor < byFactor.size(); ++factor) {
      const double value = static_cast<double>(factor) * std::pow(10.0, exponent);
      if (value >= ticks.low && value <= ticks.high)
        byFactor[factor].push_back(value);
    }
  }
  const bool labelMore = byFactor[1].size() < 3;
  for (std::size_t factor = 1; factor < byFactor.size(); ++factor) {
    const bool labelled = factor == 1 || (labelMore && (factor == 2 || factor == 5));
    std::vector<double>& to = labelled ? ticks.labelled : ticks.minor;
    to.insert(to.end(), byFactor[factor].begin(), byFactor[factor].end());
  }
  std::sort(ticks.labelled.begin(), ticks.labelled.end());
  std::sort(ticks.minor.begin(), ticks.minor.end());
  return ticks;
}

AxisTicks ticksFor(const Plot& plot, const PlotAxis& axis, double PlotPoint::*coordinate) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const PlotSeries& series : plot.series) {
    for (const PlotPoint& point : series.points) {
      if (!isShown(plot.x.scale, point.x) || !isShown(plot.y.scale, point.y))
        continue;
      low = std::min(low, point.*coordinate);
      high = std::max(high, point.*coordinate);
    }
  }
  if (low > high)
    return axisTicks(axis.scale, 1.0, 10.0);
  return axisTicks(axis.scale, low, high);
}

std::vector<Vector2d> polygon(const Vector2d& center, double radius, int corners, double start) {
  std::vector<Vector2d> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = start + 2.0 * std::numbers::pi * i / corners;
    points.emplace_back(center + radius * Vector2d(std::cos(angle), std::sin(angle)));
  }
  return points;
}

/// Draws a plot item by item and remembers which places are taken.
class PlotPainter {
 public:
  explicit PlotPainter(const Plot& plot)
      : plot_(plot),
        xTicks_(ticksFor(plot, plot.x, &PlotPoint::x)),
        yTicks_(ticksFor(plot, plot.y, &PlotPoint::y)) {
    drawing_.width = plot.width;
    drawing_.height = plot.height;
    double legendWidth = 0.0;
    for (const PlotSeries& series : plot.series)
      legendWidth = std::max(legendWidth, widthOf(series.name, kTextHeight));
    double tickWidth = 0.0;
    for (const double tick : yTicks_.labelled)
      tickWidth = std::max(tickWidth, widthOf(tickLabel(tick), kTextHeight));
    for (const std::string& note : plot.notes)
      wrap(note);
    const double notes = kLineHeight * static_cast<double>(noteLines_.size());
    frame_ = AlignedBox2d(
        Vector2d(tickWidth + 30.0, 76.0),
        Vector2d(plot.width - legendWidth - 62.0, plot.height - 62.0 - notes));
  }

  Drawing paint() {
    paintGrid();
    paintTitles();
    for (const PlotSeries& series : plot_.series)
      paintConnection(series);
    for (const PlotSeries& series : plot_.series)
      paintMarkers(series);
    for (const PlotSeries& series : plot_.series)
      paintLabels(series);
    paintLegend();
    return std::move(drawing_);
  }

 private:
  /// Into lines as wide as the picture.
  void wrap(const std::string& note) {
    std::istringstream words(note);
    std::string line;
    for (std::string word; words >> word;) {
      std::string longer = line;
      longer.append(line.empty() ? "" : " ").append(word);
      if (!line.empty() && widthOf(longer, kLabelHeight) > 0.92 * plot_.width) {
        noteLines_.push_back(line);
        line = word;
      } else {
        line = longer;
      }
    }
    noteLines_.push_back(line);
  }

  double xOf(double value) const {
    return frame_.min().x() + axisPosition(plot_.x.scale, xTicks_, value) * frame_.sizes().x();
  }

  double yOf(double value) const {
    return frame_.max().y() - axisPosition(plot_.y.scale, yTicks_, value) * frame_.sizes().y();
  }

  std::optional<Vector2d> placeOf(const PlotPoint& point) const {
    if (!isShown(plot_.x.scale, point.x) || !isShown(plot_.y.scale, point.y))
      return std::nullopt;
    return Vector2d(xOf(point.x), yOf(point.y));
  }

  void line(const Vector2d& from, const Vector2d& to, const Vector3d& color, double width = 1.0) {
    drawing_.items.emplace_back(DrawnLine{.points = {from, to}, .color = color, .width = width});
  }

  void text(const Vector2d& at, const std::string& words, double height, TextAnchor anchor) {
    drawing_.items.emplace_back(
        DrawnText{.position = at, .text = words, .height = height, .anchor = anchor});
  }

  void verticalLine(double value, const Vector3d& color) {
    line({xOf(value), frame_.min().y()}, {xOf(value), frame_.max().y()}, color);
  }

  void horizontalLine(double value, const Vector3d& color) {
    line({frame_.min().x(), yOf(value)}, {frame_.max().x(), yOf(value)}, color);
  }

  void paintGrid() {
    for (const double tick : xTicks_.minor)
      verticalLine(tick, kMinorGridColor);
    for (const double tick : yTicks_.minor)
      horizontalLine(tick, kMinorGridColor);
    for (const double tick : xTicks_.labelled) {
      verticalLine(tick, kGridColor);
      text(
          {xOf(tick), frame_.max().y() + kTextHeight + 8.0},
          tickLabel(tick),
          kTextHeight,
          TextAnchor::kMiddle);
    }
    for (const double tick : yTicks_.labelled) {
      horizontalLine(tick, kGridColor);
      text(
          {frame_.min().x() - 8.0, yOf(tick) + 0.5 * kTextHeight},
          tickLabel(tick),
          kTextHeight,
          TextAnchor::kEnd);
    }
    drawing_.items.emplace_back(DrawnLine{
        .points =
            {frame_.min(),
             {frame_.max().x(), frame_.min().y()},
             frame_.max(),
             {frame_.min().x(), frame_.max().y()}},
        .color = kFrameColor,
        .closed = true});
  }

  /// The title of the y axis lies flat above it, where it is read without turning the head.
  void paintTitles() {
    text({14.0, 30.0}, plot_.title, kTitleHeight, TextAnchor::kStart);
    text({14.0, 60.0}, plot_.y.title, kTextHeight, TextAnchor::kStart);
    text({frame_.max().x(), frame_.max().y() + 44.0}, plot_.x.title, kTextHeight, TextAnchor::kEnd);
    double y = frame_.max().y() + 44.0;
    for (const std::string& note : noteLines_) {
      y += kLineHeight;
      text({14.0, y}, note, kLabelHeight, TextAnchor::kStart);
    }
  }

  void paintConnection(const PlotSeries& series) {
    DrawnLine connection{.points = {}, .color = series.color, .width = 1.6};
    for (const PlotPoint& point : series.points) {
      if (const auto place = placeOf(point))
        connection.points.push_back(*place);
    }
    if (series.connected && connection.points.size() > 1)
      drawing_.items.emplace_back(std::move(connection));
  }

  void paintMarkers(const PlotSeries& series) {
    for (const PlotPoint& point : series.points) {
      const auto place = placeOf(point);
      if (!place)
        continue;
      marker(series, *place);
      const Vector2d reach = Vector2d::Constant(kMarkerRadius);
      taken_.emplace_back(*place - reach, *place + reach);
    }
  }

  void marker(const PlotSeries& series, const Vector2d& at) {
    constexpr double kQuarter = 0.5 * std::numbers::pi;
    const double r = kMarkerRadius;
    if (series.marker == PlotMarker::kCross) {
      line(at - Vector2d(r, r), at + Vector2d(r, r), series.color, 2.0);
      line(at + Vector2d(-r, r), at + Vector2d(r, -r), series.color, 2.0);
      return;
    }
    DrawnLine shape{
        .points = polygon(at, r, 24, 0.0), .color = series.color, .width = 1.8, .closed = true};
    if (series.marker == PlotMarker::kSquare)
      shape.points = polygon(at, 1.2 * r, 4, 0.5 * kQuarter);
    else if (series.marker == PlotMarker::kTriangle)
      shape.points = polygon(at, 1.25 * r, 3, -kQuarter);
    else if (series.marker == PlotMarker::kDiamond)
      shape.points = polygon(at, 1.25 * r, 4, 0.0);
    shape.filled = true;
    shape.fillColor = series.hollow ? Vector3d(1, 1, 1) : series.color;
    drawing_.items.emplace_back(std::move(shape));
  }

  /// At the first of eight places around the point that nothing lies in yet; none: unlabelled.
  void paintLabels(const PlotSeries& series) {
    constexpr double kGap = kMarkerRadius + 3.0;
    for (const PlotPoint& point : series.points) {
      const auto place = placeOf(point);
      if (!place || point.label.empty())
        continue;
      const Vector2d size(widthOf(point.label, kLabelHeight), kLabelHeight);
      for (const Vector2d& side :
           {Vector2d(1, -1),
            Vector2d(0, -1),
            Vector2d(1, 0),
            Vector2d(1, 1),
            Vector2d(0, 1),
            Vector2d(-1, 0),
            Vector2d(-1, -1),
            Vector2d(-1, 1)}) {
        const Vector2d offset(kGap + 0.5 * size.x(), kGap + 0.5 * size.y());
        const Vector2d center = *place + side.cwiseProduct(offset);
        const AlignedBox2d box(center - 0.5 * size, center + 0.5 * size);
        if (!isFree(box))
          continue;
        taken_.push_back(box);
        drawing_.items.emplace_back(DrawnText{
            .position = {center.x(), box.max().y()},
            .text = point.label,
            .height = kLabelHeight,
            .anchor = TextAnchor::kMiddle,
            .color = 0.75 * series.color});
        break;
      }
    }
  }

  bool isFree(const AlignedBox2d& box) const {
    return frame_.contains(box) &&
           std::none_of(taken_.begin(), taken_.end(), [&](const AlignedBox2d& other) {
             return box.intersects(other);
           });
  }

  void paintLegend() {
    Vector2d at(frame_.max().x() + 24.0, frame_.min().y() + 8.0);
    for (const PlotSeries& series : plot_.series) {
      if (series.connected)
        line(at - Vector2d(10.0, 0.0), at + Vector2d(10.0, 0.0), series.color, 1.6);
      marker(series, at);
      text(at + Vector2d(18.0, 0.5 * kTextHeight), series.name, kTextHeight, TextAnchor::kStart);
      at.y() += 1.3 * kLineHeight;
    }
  }

  const Plot& plot_;
  AxisTicks xTicks_, yTicks_;
  std::vector<std::string> noteLines_;
  AlignedBox2d frame_;
  std::vector<AlignedBox2d> taken_;
  Drawing drawing_;
};

}  // namespace

void Plot::validate() const {
  if (width < 400 || width > 4000)
    throw std::invalid_argument("Plot: width must be 400 to 4000 px");
  if (height < 300 || height > 4000)
    throw std::invalid_argument("Plot: height must be 300 to 4000 px");
}

AxisTicks axisTicks(AxisScale scale, double low, double high) {
  if (!std::isfinite(low) || !std::isfinite(high) || high < low)
    throw std::invalid_argument("axisTicks: expected finite values, low first");
  if (scale == AxisScale::kLinear)
    return linearTicks(low, high);
  if (low <= 0.0)
    throw std::invalid_argument("axisTicks: a logarithmic axis needs values above 0");
  return logarithmicTicks(low, high);
}

double axisPosition(AxisScale scale, const AxisTicks& ticks, double value) {
  if (scale == AxisScale::kLinear)
    return (value - ticks.low) / (ticks.high - ticks.low);
  return std::log(value / ticks.low) / std::log(ticks.high / ticks.low);
}

std::string tickLabel(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

Drawing drawn(const Plot& plot) {
  plot.validate();
  return PlotPainter(plot).paint();
}

}  // namespace simulcap
