#pragma once

#include "avatar/body_model.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <array>
#include <vector>

namespace avatar {

/// The parts of a body that garments have tubes for.
enum class BodyRegion { kTrunk, kHead, kLeftArm, kRightArm, kLeftLeg, kRightLeg };

inline constexpr int kNumBodyRegions = 6;

/// The region of each joint of an SMPL-family tree: the first 22 joints are SMPL's; others (hands,
/// fingers, jaw, eyes) belong with their parents. Collars and the neck count as trunk.
std::vector<BodyRegion> jointRegions(const std::vector<int>& parents);

/// The faces of each region: where the corners' skinning weights are mostly of its joints.
using RegionFaces = std::array<std::vector<int>, kNumBodyRegions>;

RegionFaces facesByRegion(
    const Eigen::Matrix3Xi& faces,
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& skinningWeights,
    const std::vector<BodyRegion>& regions);

}  // namespace avatar
