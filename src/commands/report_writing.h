#pragma once

#include "src/report/report_input.h"

#include <string>

namespace simulcap {

struct CommandContext;

/// report.html of an output folder, with progress and notes on the console. Throws what Report
/// throws.
void writeReport(
    const std::string& folder,
    const std::string& path,
    const ReportOptions& options,
    const CommandContext& context);

/// The same at the end of the verb that has written the folder, from the recording that it captured
/// (empty: none). Only says so where the program was built without the page.
void writeReportOf(
    const std::string& folder, const std::string& recording, const CommandContext& context);

/// performance.mp4 in an output folder, or a warning where no video can be written. Throws what
/// CaptureVideo throws. `recording`: of a capture; empty: the one that metrics.json names.
void writeVideoOf(
    const std::string& folder, const std::string& recording, const CommandContext& context);

}  // namespace simulcap
