#pragma once

#include "src/output/drawing.h"

#include <string>
#include <vector>

namespace simulcap {

enum class AxisScale { kLinear, kLogarithmic };

struct PlotAxis {
  std::string title;  ///< quantity and unit: "RMS error [mm]"
  AxisScale scale = AxisScale::kLinear;
};

enum class PlotMarker { kCircle, kSquare, kTriangle, kDiamond, kCross };

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
  std::string label;  ///< written beside it; or empty
};

struct PlotSeries {
  std::string name;  ///< in the legend
  Eigen::Vector3d color = {0.0, 0.0, 0.0};
  PlotMarker marker = PlotMarker::kCircle;
  bool hollow = false;    ///< markers as outlines
  bool connected = true;  ///< by a line in the order of the points
  std::vector<PlotPoint> points;
};

/// A picture of y against x, made to be read on screen and in print. Points that a logarithmic axis
/// can't show (0 and less) or that aren't finite are left out.
struct Plot {
  std::string title;
  std::vector<std::string> notes;  ///< lines under the picture
  PlotAxis x, y;
  std::vector<PlotSeries> series;
  int width = 1120;  ///< [px], 400 … 4000
  int height = 680;  ///< [px], 300 … 4000

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Part of an axis that is shown, and where it is marked.
struct AxisTicks {
  double low = 0.0;
  double high = 1.0;
  std::vector<double> labelled;  ///< ascending, within the part
  std::vector<double> minor;     ///< between them, for a logarithmic axis
};

/// Covers [low, high] with a little room. Linear: about six round steps of 1, 2 or 5 times a power
/// of ten. Logarithmic (low > 0): powers of ten, and 2 and 5 times them where there are fewer than
/// three. Throws std::invalid_argument for values that aren't finite, high < low, or low ≤ 0 on a
/// logarithmic axis.
AxisTicks axisTicks(AxisScale scale, double low, double high);

/// 0 at the axis' low end, 1 at its high end.
double axisPosition(AxisScale scale, const AxisTicks& ticks, double value);

/// As short as it is exact: "0.001", "20", "1e+06".
std::string tickLabel(double value);

/// The plot as lines and text; legend on the right, labels beside their points where there is room.
Drawing drawn(const Plot& plot);

}  // namespace simulcap
