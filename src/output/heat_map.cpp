#include "src/output/heat_map.h"

#include "src/output/image_file.h"
#include "src/output/plot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace simulcap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCellWidth = 66.0;  // [px], as all lengths
constexpr double kCellHeight = 36.0;
constexpr double kLeft = 70.0;
constexpr double kTop = 64.0;
constexpr double kPanelHead = 34.0;
constexpr double kPanelFoot = 44.0;
constexpr double kScaleHeight = 52.0;
constexpr double kHeatLineHeight = 19.0;
constexpr double kHeatTitleHeight = 13.0;
constexpr double kScaleWidth = 300.0;
constexpr double kHeatTextHeight = 9.0;
constexpr double kInkHeight = 8.0;  // of capitals in a cell
constexpr double kInkLine = 15.0;

/// Dark blue to yellow through green, lightness rising evenly: readable in grey and by people who
/// don't tell red from green.
Vector3d heatColor(double part) {
  static const Vector3d kStops[] = {
      {0.27, 0.00, 0.33},
      {0.23, 0.32, 0.55},
      {0.13, 0.57, 0.55},
      {0.37, 0.79, 0.38},
      {0.99, 0.91, 0.15}};
  const double place = 4.0 * std::clamp(part, 0.0, 1.0);
  const int below = std::min(3, static_cast<int>(place));
  return kStops[below] + (place - below) * (kStops[below + 1] - kStops[below]);
}

bool isShown(double value) {
  return std::isfinite(value) && value > 0.0;
}

class HeatPainter {
 public:
  explicit HeatPainter(const HeatMap& map) : map_(map) {
    for (const HeatPanel& panel : map.panels) {
      for (const HeatCell& cell : panel.cells) {
        if (!isShown(cell.value))
          continue;
        low_ = std::min(low_, cell.value);
        high_ = std::max(high_, cell.value);
      }
    }
    const int count = static_cast<int>(map.panels.size());
    const int columns = std::min(map.panelsPerRow, std::max(1, count));
    const int rows = (count + columns - 1) / columns;
    drawing_.width = static_cast<int>(std::max(columns * panelWidth(), wordsWidth()) + 30.0);
    drawing_.height = static_cast<int>(
        kTop + rows * panelHeight() + kScaleHeight +
        kHeatLineHeight * static_cast<double>(map.notes.size()) + 10.0);
  }

  Drawing paint() {
    text({16.0, 28.0}, map_.title, kHeatTitleHeight, TextAnchor::kStart);
    for (std::size_t i = 0; i < map_.panels.size(); ++i) {
      const std::size_t column = i % static_cast<std::size_t>(map_.panelsPerRow);
      const std::size_t row = i / static_cast<std::size_t>(map_.panelsPerRow);
      paintPanel(
          map_.panels[i],
          {static_cast<double>(column) * panelWidth(),
           kTop + static_cast<double>(row) * panelHeight()});
    }
    double y = drawing_.height - 10.0 - kHeatLineHeight * static_cast<double>(map_.notes.size());
    paintScale(y - kScaleHeight);
    for (const std::string& note : map_.notes) {
      y += kHeatLineHeight;
      text({16.0, y - 4.0}, note, kHeatTextHeight, TextAnchor::kStart);
    }
    return std::move(drawing_);
  }

 private:
  double panelWidth() const {
    return kLeft + 20.0 + kCellWidth * static_cast<double>(map_.columnLabels.size());
  }

  /// Of the title, the notes and the scale.
  double wordsWidth() const {
    const int height = static_cast<int>(std::ceil(kHeatTextHeight));
    double width = std::max<double>(
        textWidth(map_.title, static_cast<int>(kHeatTitleHeight)),
        kLeft + kScaleWidth + textWidth(map_.valueTitle, height));
    for (const std::string& note : map_.notes)
      width = std::max<double>(width, textWidth(note, height));
    return width;
  }

  double panelHeight() const {
    return kPanelHead + kPanelFoot + kCellHeight * static_cast<double>(map_.rowLabels.size());
  }

  double partOf(double value) const {
    return high_ > low_ ? std::log(value / low_) / std::log(high_ / low_) : 0.5;
  }

  void text(
      const Vector2d& at,
      const std::string& words,
      double height,
      TextAnchor anchor,
      const Vector3d& color = Vector3d::Constant(0.15)) {
    drawing_.items.emplace_back(DrawnText{
        .position = at, .text = words, .height = height, .anchor = anchor, .color = color});
  }

  void box(const Vector2d& low, const Vector2d& size, const Vector3d& fill, bool marked) {
    const double inset = marked ? 2.0 : 0.0;
    const Vector2d a = low + Vector2d::Constant(inset);
    const Vector2d b = low + size - Vector2d::Constant(inset);
    drawing_.items.emplace_back(DrawnLine{
        .points = {a, {b.x(), a.y()}, b, {a.x(), b.y()}},
        .color = marked ? Vector3d(0.85, 0.1, 0.1) : Vector3d(1, 1, 1),
        .width = marked ? 3.0 : 1.0,
        .closed = true,
        .filled = true,
        .fillColor = fill});
  }

  void paintPanel(const HeatPanel& panel, const Vector2d& corner) {
    const Vector2d origin = corner + Vector2d(kLeft, kPanelHead);
    text(origin - Vector2d(0.0, 14.0), panel.title, 10.0, TextAnchor::kStart);
    text(origin - Vector2d(8.0, 8.0), map_.rowTitle, kHeatTextHeight, TextAnchor::kEnd);
    const std::size_t columns = map_.columnLabels.size();
    for (std::size_t r = 0; r < map_.rowLabels.size(); ++r) {
      const double y = origin.y() + kCellHeight * static_cast<double>(r);
      text(
          {origin.x() - 8.0, y + 0.5 * (kCellHeight + kHeatTextHeight)},
          map_.rowLabels[r],
          kHeatTextHeight,
          TextAnchor::kEnd);
      for (std::size_t c = 0; c < columns; ++c)
        paintCell(
            panel.cells[r * columns + c], {origin.x() + kCellWidth * static_cast<double>(c), y});
    }
    paintContour(panel, origin);
    const double bottom = origin.y() + kCellHeight * static_cast<double>(map_.rowLabels.size());
    for (std::size_t c = 0; c < columns; ++c)
      text(
          {origin.x() + kCellWidth * (static_cast<double>(c) + 0.5),
           bottom + kHeatTextHeight + 6.0},
          map_.columnLabels[c],
          kHeatTextHeight,
          TextAnchor::kMiddle);
    text(
        {origin.x() + kCellWidth * static_cast<double>(columns),
         bottom + 2.0 * kHeatTextHeight + 13.0},
        map_.columnTitle,
        kHeatTextHeight,
        TextAnchor::kEnd);
  }

  void paintCell(const HeatCell& cell, const Vector2d& at) {
    const bool shown = isShown(cell.value);
    const double part = shown ? partOf(cell.value) : 1.0;
    box(at, {kCellWidth, kCellHeight}, shown ? heatColor(part) : Vector3d(1, 1, 1), cell.marked);
    const Vector3d ink = part < 0.55 ? Vector3d(1, 1, 1) : Vector3d(0.1, 0.1, 0.1);
    const double height = kInkHeight + kInkLine * (static_cast<double>(cell.lines.size()) - 1.0);
    double y = at.y() + 0.5 * (kCellHeight - height) + kInkHeight;
    for (const std::string& line : cell.lines) {
      text({at.x() + 0.5 * kCellWidth, y}, line, kInkHeight, TextAnchor::kMiddle, ink);
      y += kInkLine;
    }
  }

  bool isBeyond(const HeatPanel& panel, std::size_t row, std::size_t column) const {
    return panel.cells[row * map_.columnLabels.size() + column].value < map_.contour;
  }

  void edge(const Vector2d& from, const Vector2d& to) {
    drawing_.items.emplace_back(
        DrawnLine{.points = {from, to}, .color = {0.85, 0.1, 0.1}, .width = 2.5});
  }

  /// Between neighbours of which one is below the map's contour value.
  void paintContour(const HeatPanel& panel, const Vector2d& origin) {
    const std::size_t columns = map_.columnLabels.size();
    for (std::size_t i = 0; i < panel.cells.size(); ++i) {
      const std::size_t r = i / columns;
      const std::size_t c = i % columns;
      const Vector2d low =
          origin +
          Vector2d(kCellWidth * static_cast<double>(c), kCellHeight * static_cast<double>(r));
      if (c > 0 && isBeyond(panel, r, c) != isBeyond(panel, r, c - 1))
        edge(low, low + Vector2d(0.0, kCellHeight));
      if (r > 0 && isBeyond(panel, r, c) != isBeyond(panel, r - 1, c))
        edge(low, low + Vector2d(kCellWidth, 0.0));
    }
  }

  void paintScale(double top) {
    if (!(high_ > low_))
      return;
    constexpr int kSteps = 100;
    constexpr double kStep = kScaleWidth / kSteps;
    for (int i = 0; i < kSteps; ++i)
      drawing_.items.emplace_back(DrawnLine{
          .points =
              {{kLeft + kStep * i, top},
               {kLeft + kStep * (i + 1), top},
               {kLeft + kStep * (i + 1), top + 14.0},
               {kLeft + kStep * i, top + 14.0}},
          .width = 0.0,
          .closed = true,
          .filled = true,
          .fillColor = heatColor((i + 0.5) / kSteps)});
    const int first = static_cast<int>(std::ceil(std::log10(low_)));
    for (int power = first; std::pow(10.0, power) <= high_; ++power)
      text(
          {kLeft + kScaleWidth * partOf(std::pow(10.0, power)), top + 30.0},
          tickLabel(std::pow(10.0, power)),
          kHeatTextHeight,
          TextAnchor::kMiddle);
    text(
        {kLeft + kScaleWidth + 16.0, top + 12.0},
        map_.valueTitle,
        kHeatTextHeight,
        TextAnchor::kStart);
  }

  const HeatMap& map_;
  double low_ = std::numeric_limits<double>::infinity();
  double high_ = 0.0;
  Drawing drawing_;
};

}  // namespace

void HeatMap::validate() const {
  if (panelsPerRow < 1 || panelsPerRow > 10)
    throw std::invalid_argument("HeatMap: panelsPerRow must be within [1, 10]");
  const std::size_t cells = rowLabels.size() * columnLabels.size();
  for (const HeatPanel& panel : panels) {
    if (cells == 0 || panel.cells.size() != cells)
      throw std::invalid_argument("HeatMap: a panel needs rows x columns cells");
    for (const HeatCell& cell : panel.cells)
      if (cell.lines.size() > 2)
        throw std::invalid_argument("HeatMap: a cell has room for two lines");
  }
}

Drawing drawn(const HeatMap& map) {
  map.validate();
  return HeatPainter(map).paint();
}

}  // namespace simulcap
