#pragma once

#include "src/comparison/capture_comparison.h"
#include "src/comparison/tracking_comparison.h"
#include "src/output/plot.h"

#include <string>
#include <vector>

namespace simulcap {

/// What a comparison of captures found, and where.
struct CaptureComparisonReport {
  std::string program;   ///< name and version
  std::string sequence;  ///< the recording
  std::string avatar;    ///< the file
  std::string cpu;
  int threads = 1;
  double calibrationGflops = 0.0;
  std::int64_t frames = 0;
  std::vector<TrialResult> trials;
  std::vector<TrackingTrialResult> tracking;  ///< none with known poses
};

/// compare.json: settings and figures of every trial, as in its metrics.json.
std::string captureComparisonJson(const CaptureComparisonReport& report);

/// compare.csv: a line of names with units, then a line per trial; empty where nothing was
/// measured.
std::string captureComparisonCsv(const CaptureComparisonReport& report);

/// The most important of it as columns of text.
std::string captureComparisonTable(const CaptureComparisonReport& report);

/// compare.svg: error of what the camera sees against the time for simulation and fit.
Plot captureComparisonPlot(const CaptureComparisonReport& report);

}  // namespace simulcap
