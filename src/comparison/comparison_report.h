#pragma once

#include "src/comparison/comparison.h"
#include "src/output/plot.h"

#include <string>
#include <vector>

namespace simulcap {

/// What a comparison found, and where.
struct ComparisonReport {
  std::string program;  ///< name and version
  std::string scene;    ///< the file
  std::string cpu;
  int threads = 1;
  double calibrationGflops = 0.0;
  double framesPerSecond = 30.0;
  int frames = 0;  ///< simulated
  Truths truths;
  std::vector<RunResult> runs;
  std::vector<LeftOutSolver> leftOut;
};

/// compare.json.
std::string comparisonJson(const ComparisonReport& report);

/// compare.csv: a line of names, then a line per run; empty where nothing was measured.
std::string comparisonCsv(const ComparisonReport& report);

/// The same runs as columns of text.
std::string comparisonTable(const ComparisonReport& report);

/// compare.svg: error against run time, both logarithmic.
Plot comparisonPlot(const ComparisonReport& report);

}  // namespace simulcap
