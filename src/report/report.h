#pragma once

#include "src/report/report_camera.h"
#include "src/report/report_parts.h"
#include "src/report/report_truth.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// report.html of a capture's or simulation's output folder: one file that any browser shows from
/// disk. Frame by frame, in memory that doesn't grow with their number.
class Report {
 public:
  /// Throws avatar::FileError for what can't be read or written, std::runtime_error when the
  /// program was built without the page.
  Report(const std::string& folder, const std::string& path, const ReportOptions& options);

  /// Of the performance; every n-th is shown.
  long numFrames() const { return static_cast<long>(input_->performance.numFrames()); }

  /// The next frame; false after the last one. Throws avatar::FileError.
  bool advance();

  /// Throws avatar::FileError.
  void finish();

  /// What is missing from the report and why, one line each.
  const std::vector<std::string>& notes() const { return input_->notes; }

  std::size_t numBytes() const { return page_.numBytes(); }

  int numShown() const { return numShown_; }

 private:
  nlohmann::json savings() const;

  std::unique_ptr<ReportInput> input_;
  ReportPage page_;
  int stride_;
  int row_ = 0;
  int numShown_ = 0;
  FrameSeries series_;
  ReportParts parts_;
  std::optional<ReportCamera> camera_;
  std::optional<ReportTruth> truth_;
};

}  // namespace simulcap
