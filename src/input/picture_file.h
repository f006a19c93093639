#pragma once

#include "avatar/geometry/shading.h"

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace simulcap {

/// Why a single picture can't be used: a kind of failure, without the file's name.
struct PictureProblem : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct PictureSize {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
};

/// Raw depth of a 16-bit single-channel PNG, row-major. Throws PictureProblem.
std::vector<std::uint16_t> readDepthPicture(const std::string& path, const PictureSize& size);

/// 8-bit RGB of a PNG or JPEG. Throws PictureProblem.
avatar::ColorImage readColorPicture(const std::string& path, const PictureSize& size);

/// PixelLabels of an 8-bit single-channel PNG with values 0 to 3. Throws PictureProblem.
std::vector<std::uint8_t> readLabelPicture(const std::string& path, const PictureSize& size);

}  // namespace simulcap
