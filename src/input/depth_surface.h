#pragma once

#include "avatar/geometry/camera.h"
#include "src/input/depth_cloud.h"

#include <cstdint>
#include <vector>

namespace simulcap {

struct NormalOptions {
  float baseline = 0.025F;  ///< a normal's depths are about that far apart [m], > 0

  /// Throws std::invalid_argument when the baseline is not positive.
  void validate() const;
};

/// The cloud with `points` and `normals` of its person pixels, from `depth`, `person` and the
/// camera's intrinsics. In a pinhole image the inverse depth of a plane is linear in the pixel:
/// n·X = c gives 1/z = (n_x x + n_y y + n_z)/c with x = (u − cx)/fx, so the gradient of 1/z is the
/// normal. The gradient is the mean of differences in a window; differences across a jump or a hole
/// are left out. Pixels without any difference in u or v get no normal. Points and normals of the
/// cloud's size may be there already, of a frame whose person was `formerPerson` (W·H, or empty:
/// they are all 0): they are replaced.
DepthCloud withSurface(
    DepthCloud cloud,
    const avatar::Camera& camera,
    const NormalOptions& options = {},
    const std::vector<std::uint8_t>& formerPerson = {});

}  // namespace simulcap
