#pragma once

#include "src/input/picture_file.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace simulcap {

/// What the pixels of a frame were taken for.
struct ParsedPicture {
  int number = 0;                                ///< of the frame within the recording
  int left = 0, top = 0, width = 0, height = 0;  ///< the person's box within the picture [px]
  std::vector<std::uint8_t> labels;              ///< width · height SurfaceLabel
};

/// Shares of the pixels of skin, upper and lower garment that were taken for each of them, summed
/// over the pictures with a truth in FOLDER/labels/%06d.png: {"skin": {"skin": …, "upper": …,
/// "lower": …}, …}. Pixels that either side doesn't count as the person's are left out; null
/// without truth.
nlohmann::json labelConfusion(
    const std::vector<ParsedPicture>& pictures,
    const std::string& truthFolder,
    const PictureSize& size);

}  // namespace simulcap
