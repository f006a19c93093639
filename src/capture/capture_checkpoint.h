#pragma once

#include "src/capture/capture_figures.h"
#include "src/capture/tracked_recording.h"
#include "src/capture_session.h"

#include <cstdint>
#include <string>

namespace simulcap {

/// Where a capture stands after some frames: all that one more run needs to come to the same bytes.
struct CaptureCheckpoint {
  std::string settings;        ///< of the capture; another one can't go on from here
  std::int64_t numFrames = 0;  ///< captured so far
  TrackingState tracking;
  CaptureState cloth;
  CaptureFigures figures;
};

/// Written whole or not at all. Throws avatar::FileError.
void writeCheckpoint(const std::string& path, const CaptureCheckpoint& checkpoint);

/// Throws avatar::FileError when the file is missing, damaged or no checkpoint.
CaptureCheckpoint readCheckpoint(const std::string& path);

}  // namespace simulcap
