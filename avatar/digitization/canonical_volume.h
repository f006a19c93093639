#pragma once

#include "avatar/digitization/posed_frame.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

namespace avatar {

/// What is known of a place near the surface.
struct Voxel {
  float distance = 0.0F;                            ///< signed [m], positive outside
  float weight = 0.0F;                              ///< 0: never seen
  Eigen::Vector3f color = Eigen::Vector3f::Zero();  ///< mean, display values in [0, 1]
  float colorWeight = 0.0F;
  LabelCounts labels = {};
};

using VoxelIndex = Eigen::Vector3i;

/// A truncated signed distance field (Curless & Levoy 1996) in sparse blocks of 8³ voxels. Voxel
/// (i, j, k) is the point voxelSize · (i, j, k).
class CanonicalVolume {
 public:
  static constexpr int kBlockSize = 8;
  using Block = std::array<Voxel, kBlockSize * kBlockSize * kBlockSize>;

  /// voxelSize [m] > 0.
  explicit CanonicalVolume(double voxelSize) : voxelSize_(voxelSize) {}

  double voxelSize() const { return voxelSize_; }

  Eigen::Vector3d point(const VoxelIndex& voxel) const { return voxelSize_ * voxel.cast<double>(); }

  VoxelIndex nearestVoxel(const Eigen::Vector3d& point) const {
    return (point / voxelSize_).array().round().cast<int>().matrix();
  }

  /// Makes room for the blocks that come within a distance [m] of a point.
  void allocateAround(const Eigen::Vector3d& point, double distance);

  int numBlocks() const { return static_cast<int>(origins_.size()); }

  /// The voxel of a block with the smallest indices.
  const VoxelIndex& origin(int block) const { return origins_[static_cast<std::size_t>(block)]; }

  Block& block(int block) { return blocks_[static_cast<std::size_t>(block)]; }

  const Block& block(int block) const { return blocks_[static_cast<std::size_t>(block)]; }

  /// Place within a block of the voxel that is this far from its origin.
  static std::size_t inBlock(const VoxelIndex& offset) {
    const int place = (offset.z() * kBlockSize + offset.y()) * kBlockSize + offset.x();
    return static_cast<std::size_t>(place);
  }

  /// The inverse of inBlock().
  static VoxelIndex offset(int place) {
    return {place % kBlockSize, place / kBlockSize % kBlockSize, place / (kBlockSize * kBlockSize)};
  }

  /// Null outside the blocks.
  const Voxel* find(const VoxelIndex& voxel) const;

 private:
  static std::int64_t key(const VoxelIndex& blockIndex);

  double voxelSize_;
  std::vector<VoxelIndex> origins_;
  std::vector<Block> blocks_;
  std::unordered_map<std::int64_t, int> blockOfKey_;  // looked up, never walked through
};

/// A sample of the fused surface.
struct FusedPoints {
  Eigen::Matrix3Xd points;          ///< 3 × N [m]
  Eigen::Matrix3Xd normals;         ///< 3 × N, unit, outward
  Eigen::Matrix3Xf colors;          ///< 3 × N display values; negative: none seen
  std::vector<LabelCounts> labels;  ///< N

  Eigen::Index size() const { return points.cols(); }
};

/// One point per voxel at which the distance changes its sign towards a neighbour, both of at least
/// this weight: the mean of its crossings.
FusedPoints surfacePoints(const CanonicalVolume& volume, double minWeight);

}  // namespace avatar
