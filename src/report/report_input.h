#pragma once

#include "avatar/layered_avatar.h"
#include "src/evaluation/ground_truth.h"
#include "src/evaluation/posed_avatar.h"
#include "src/output/performance_reader.h"
#include "src/report/seen_recording.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

struct ReportOptions {
  std::string recording;   ///< of a capture; empty: the one that metrics.json names, if it is there
  std::string comparison;  ///< compare.json; empty: the one in the folder, if there is one
  std::string stability;   ///< stability.json; the same
  int maxFrames = 300;     ///< every n-th of more is shown, 1 … 10000
  int threads = 1;         ///< ≥ 1; never changes the page

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// What the output folder of a capture or simulation holds, opened.
struct ReportInput {
  std::string folder;
  PerformanceReader performance;
  std::optional<avatar::LayeredAvatar> avatar;  ///< none: cloth without a person
  std::optional<PosedAvatarBody> body;          ///< of the avatar
  nlohmann::json metrics;                       ///< an object
  std::optional<nlohmann::json> comparison, stability;
  std::optional<std::string> scene;          ///< text of the scene file
  std::optional<std::string> timing;         ///< text of timing.csv
  std::unique_ptr<SeenRecording> recording;  ///< null: none
  std::unique_ptr<GroundTruth> truth;        ///< of the recording; null: none
  std::vector<std::string> notes;            ///< what is missing and why, one line each
};

/// Performance, avatar and body alone. Throws as openReportInput().
std::unique_ptr<ReportInput> openPerformed(const std::string& folder);

/// Throws avatar::FileError naming file and remedy for a folder without a performance, and for
/// files that are damaged or don't fit together. What is only not there is left out with a note.
std::unique_ptr<ReportInput> openReportInput(
    const std::string& folder, const ReportOptions& options);

}  // namespace simulcap
