#pragma once

#include "avatar/body_model.h"
#include "src/capture/capture_figures.h"
#include "src/evaluation/stage_timing.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace simulcap {

/// A capture whose files are written.
struct FinishedCapture {
  std::string folder;  ///< of its output
  std::string input;   ///< the recording
  std::string method;
  std::shared_ptr<const avatar::BodyModel> model;  ///< of the body
  std::int64_t numFrames = 0;
  const CaptureFigures& figures;
  const StageTiming& timing;
  int threads = 1;
  nlohmann::json details = nlohmann::json::object();  ///< of metrics.json, for others to say
};

struct CaptureMetrics {
  nlohmann::json figures;          ///< as in metrics.json
  std::vector<std::string> notes;  ///< what could not be measured and why, one line each
};

/// Writes metrics.json anew: what the capture says of itself, and strain, penetration and jitter as
/// `evaluate` measures them; against the truth of the recording as well when its folder, SEQ/gt, is
/// given. Throws avatar::FileError.
CaptureMetrics writeCaptureMetrics(
    const FinishedCapture& capture, const std::string& truthFolder = "");

}  // namespace simulcap
