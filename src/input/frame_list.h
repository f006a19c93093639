#pragma once

#include "src/input/input_warnings.h"

#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Where a frame's pictures are.
struct FrameFiles {
  int index = 0;                    ///< number within the recording
  std::optional<double> timestamp;  ///< [s] as recorded; absent: index / fps
  std::string depth;                ///< path
  std::string color;                ///< path; empty: none
  std::string labels;               ///< path; empty: none
};

/// Lists depth/, color/, labels/ and timestamps.txt of a sequence folder by the numbers that are
/// the files' names. Throws avatar::FileError when there is no depth at all.
std::vector<FrameFiles> listSequence(const std::string& folder, InputWarnings& warnings);

/// Lists a recording in the TUM RGB-D layout: associations.txt, else depth.txt with the nearest
/// colour of rgb.txt within 20 ms. Throws avatar::FileError when no line can be used.
std::vector<FrameFiles> listTum(const std::string& folder, InputWarnings& warnings);

}  // namespace simulcap
