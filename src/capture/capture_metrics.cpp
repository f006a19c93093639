#include "src/capture/capture_metrics.h"

#include "src/evaluation/capture_evaluation.h"
#include "src/evaluation/metrics_file.h"
#include "src/program/interruption.h"
#include "src/program/machine.h"
#include "src/program/version.h"

#include <filesystem>

namespace simulcap {

CaptureMetrics writeCaptureMetrics(const FinishedCapture& capture, const std::string& truthFolder) {
  CaptureEvaluation evaluation(
      capture.folder,
      {.truthFolder = truthFolder, .threads = capture.threads, .captureModel = capture.model});
  while (evaluation.advance())
    stopIfInterrupted();
  CaptureMetrics metrics{capture.figures.json(), evaluation.notes()};
  metrics.figures.update(evaluation.figures());
  metrics.figures.update(capture.details);
  metrics.figures["program"] = std::string("simulcap ") + kVersion;
  metrics.figures["input"] = capture.input;
  metrics.figures["method"] = capture.method;
  metrics.figures["frames"] = capture.numFrames;
  metrics.figures["machine"] = {{"cpu", cpuName()}, {"threads", capture.threads}};
  metrics.figures["calibration_gflops"] = calibrationGflops();
  metrics.figures["timing_ms"] = capture.timing.json();
  const std::string path = (std::filesystem::path(capture.folder) / "metrics.json").string();
  std::error_code none;
  std::filesystem::remove(path, none);  // figures of another capture
  mergeMetrics(path, metrics.figures);
  return metrics;
}

}  // namespace simulcap
