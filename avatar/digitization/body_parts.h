#pragma once

#include "avatar/digitization/posed_frame.h"
#include "avatar/skinning.h"

#include <array>
#include <cstdint>
#include <vector>

namespace avatar {

/// Parts of a body that differ in what they wear.
enum class BodyPart : std::uint8_t {
  kNone,
  kFace,
  kHead,  ///< without the face
  kNeck,
  kChest,
  kWaist,
  kHip,
  kUpperArm,
  kLowerUpperArm,  ///< its lower half, beyond short sleeves
  kForearm,
  kHand,
  kThigh,
  kLowerThigh,  ///< its lower half, beyond short trousers
  kShank,
  kFoot
};

inline constexpr int kNumBodyParts = 15;

/// How likely a part shows skin, upper and lower garment, before anybody looks; sums to 1.
std::array<double, kNumSurfaceLabels> labelPrior(BodyPart part);

/// What a part is nearly sure to show; kNoLabel: anything.
SurfaceLabel seedLabel(BodyPart part);

/// One part per vertex, from the joint that carries most of it and the place along the bone.
std::vector<BodyPart> bodyParts(const BodyModel& model, const ShapedBody& shaped);

/// What the pixels of a frame show of its body, row-major.
struct PartImage {
  std::vector<BodyPart> parts;     ///< W·H; beside the body: of its nearest pixel in the image
  std::vector<std::uint8_t> sure;  ///< W·H: 1 = well inside one part, and depth is near its skin
};

/// Throws std::invalid_argument as Skinning::pose().
PartImage partImage(
    const PosedDepthFrame& frame,
    const Skinning& skinning,
    const ShapedBody& shaped,
    const std::vector<BodyPart>& parts);

}  // namespace avatar
