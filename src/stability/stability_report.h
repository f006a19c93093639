#pragma once

#include "src/output/heat_map.h"
#include "src/stability/extreme_cases.h"
#include "src/stability/stability_grid.h"

#include <string>
#include <vector>

namespace simulcap {

/// What was found of the stability of cloth, and where.
struct StabilityReport {
  std::string program;  ///< name and version
  std::string cpu;
  int threads = 1;
  double calibrationGflops = 0.0;
  double gridSeconds = 0.0;  ///< that the grid took
  StabilityGrid grid;
  std::vector<GridFinding> findings;  ///< in the grid's order
  std::vector<ExtremeResult> extremes;
};

/// What was not as it must be, a line each; empty: all is well.
std::vector<std::string> failures(const StabilityReport& report);

/// stability.json.
std::string stabilityJson(const StabilityReport& report);

/// The extreme cases as columns of text, and the grid in a few lines.
std::string stabilityTable(const StabilityReport& report);

/// stability.svg: the observed limit over stretch and torsion, a panel per mass and edge length.
HeatMap stabilityMap(const StabilityReport& report);

}  // namespace simulcap
