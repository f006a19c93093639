#pragma once

#include "src/output/drawing.h"

#include <string>
#include <vector>

namespace simulcap {

struct HeatCell {
  double value = 0.0;              ///< > 0, decides the colour; not finite: the cell stays white
  std::vector<std::string> lines;  ///< written in it, two at most
  bool marked = false;             ///< framed in red
};

/// One table of cells: what belongs to the row and column labels of the map.
struct HeatPanel {
  std::string title;
  std::vector<HeatCell> cells;  ///< row by row, from the top
};

/// Tables of the same rows and columns beside each other, their cells coloured by the logarithm of
/// a value on one common scale.
struct HeatMap {
  std::string title;
  std::string valueTitle;  ///< quantity and unit of the scale
  std::string rowTitle, columnTitle;
  std::vector<std::string> rowLabels, columnLabels;
  std::vector<HeatPanel> panels;
  int panelsPerRow = 2;            ///< 1 … 10
  double contour = 0.0;            ///< cells on either side of this value are parted by a line
  std::vector<std::string> notes;  ///< lines under the picture

  /// Throws std::invalid_argument unless every panel has rows × columns cells of at most two lines.
  void validate() const;
};

Drawing drawn(const HeatMap& map);

}  // namespace simulcap
