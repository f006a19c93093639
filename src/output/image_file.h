#pragma once

#include "avatar/geometry/shading.h"
#include "src/output/drawing.h"

#include <cstdint>
#include <string>
#include <vector>

namespace simulcap {

/// Writes an 8-bit RGB PNG, whole or not at all. Throws avatar::FileError.
void writePng(const std::string& path, const avatar::ColorImage& image);

/// Bytes of an 8-bit RGB picture as JPEG of a quality from 0 to 100.
std::string jpegBytes(const avatar::ColorImage& image, int quality = 95);

/// The picture with other numbers of pixels, each the mean of those that it covers. Throws
/// std::invalid_argument for a picture or a size without pixels.
avatar::ColorImage resized(const avatar::ColorImage& image, int width, int height);

/// Bytes of a one-channel PNG of 8 or 16 bits per pixel, row-major. Throws std::invalid_argument
/// when there aren't width × height values.
std::string pngBytes(int width, int height, const std::vector<std::uint8_t>& values);
std::string pngBytes(int width, int height, const std::vector<std::uint16_t>& values);

/// Reads any 8-bit picture as RGB. Throws avatar::FileError when it is missing or damaged.
avatar::ColorImage readColorImage(const std::string& path);

struct TextOptions {
  int x = 0, y = 0;  ///< left end of the baseline [px]
  int height = 14;   ///< of a capital letter [px], ≥ 6
  unsigned char gray = 40;
};

/// Writes one line of ASCII text into the image; what doesn't fit is cut off.
void drawText(avatar::ColorImage& image, const std::string& text, const TextOptions& options);

/// Width of the text when drawn [px].
int textWidth(const std::string& text, int height);

/// The drawing as pixels, `scale` of them per unit (0.25 … 8), with smooth edges.
avatar::ColorImage rasterized(const Drawing& drawing, double scale);

}  // namespace simulcap
