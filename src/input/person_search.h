#pragma once

#include "src/input/coarse_depth.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace simulcap {

/// What stays the same before a fixed camera: where is up and the floor, in the camera's frame, and
/// what is wall.
struct SceneLayout {
  Eigen::Vector3f up = {0.0F, -1.0F, 0.0F};
  std::optional<Plane> floor;
  std::vector<Plane> walls;      ///< that have at least one piece larger than any person
  std::vector<float> wallDepth;  ///< per cell: depth of such a piece there [m]; 0 = none
};

/// `given`: where up is if that is known, a unit vector in the camera's frame.
SceneLayout findLayout(const CoarseDepth& coarse, const std::optional<Eigen::Vector3f>& given = {});

/// The measured cells that are neither on the floor nor on a wall.
std::vector<std::uint8_t> offThePlanes(const CoarseDepth& coarse, const SceneLayout& layout);

/// The cells of the person: of all pieces with a person's size the most likely one (large, near, in
/// the middle, in front of what is beside it), with the limbs that lie before it. All 0: nobody
/// there.
std::vector<std::uint8_t> findPerson(const CoarseDepth& coarse, const SceneLayout& layout);

/// Cells that a limb may be away from the body in the image: a camera's shadow lies in between.
inline constexpr int kPersonReach = 4;

/// With the pieces that belong to the person though a jump in depth parts them: arms held before
/// the body or half behind it, the far leg, hair.
std::vector<std::uint8_t> withLimbs(
    const CoarseDepth& coarse,
    const SceneLayout& layout,
    const Components& components,
    std::vector<std::uint8_t> person);

}  // namespace simulcap
