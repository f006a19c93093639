#pragma once

#include "avatar/body_model.h"
#include "avatar/skinning.h"
#include "src/simulation/stage.h"

#include <cstdint>

namespace simulcap {

struct SoftTissueOptions {
  double largest = 0.01;     ///< no vertex is moved farther [m], ≥ 0
  double wavelength = 0.35;  ///< of bumps and hollows along the skin [m], > 0
  double poseShare = 0.3;    ///< of `largest` that comes with bent joints, 0 … 1
  std::uint32_t seed = 0;

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// What no shape parameter tells of a person: bumps and hollows along the skin's normals, made of
/// a few waves of random direction, and bulges about joints that grow as they bend. Hands, feet and
/// head, which clothes don't cover and everybody sees, stay as they are.
SoftTissue makeSoftTissue(
    const avatar::BodyModel& model,
    const avatar::ShapedBody& shaped,
    const SoftTissueOptions& options);

}  // namespace simulcap
