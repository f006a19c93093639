#include "avatar/digitization/canonical_volume.h"

#include <cmath>

namespace avatar {
namespace {

int floorDivide(int value, int divisor) {
  return (value >= 0 ? value : value - divisor + 1) / divisor;
}

bool isSeen(const Voxel* voxel, double minWeight) {
  return voxel != nullptr && static_cast<double>(voxel->weight) >= minWeight;
}

/// Outward, not normalised; central differences where both neighbours were seen, else one-sided.
Eigen::Vector3d gradient(const CanonicalVolume& volume, const VoxelIndex& at, const Voxel& centre) {
  Eigen::Vector3d result = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const VoxelIndex step = VoxelIndex::Unit(axis);
    const Voxel* after = volume.find(at + step);
    const Voxel* before = volume.find(at - step);
    const bool afterSeen = isSeen(after, 1e-12);
    const bool beforeSeen = isSeen(before, 1e-12);
    if (!afterSeen && !beforeSeen)
      continue;
    const auto upper = static_cast<double>(afterSeen ? after->distance : centre.distance);
    const auto lower = static_cast<double>(beforeSeen ? before->distance : centre.distance);
    result[axis] = (upper - lower) / (afterSeen && beforeSeen ? 2.0 : 1.0);
  }
  return result;
}

class PointCollector {
 public:
  PointCollector(const CanonicalVolume& volume, double minWeight)
      : volume_(volume), minWeight_(minWeight) {}

  void visit(const VoxelIndex& at, const Voxel& voxel) {
    if (static_cast<double>(voxel.weight) < minWeight_)
      return;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int crossings = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Voxel* next = volume_.find(at + VoxelIndex::Unit(axis));
      if (!isSeen(next, minWeight_) || (voxel.distance < 0.0F) == (next->distance < 0.0F))
        continue;
      const auto here = static_cast<double>(voxel.distance);
      const auto there = static_cast<double>(next->distance);
      sum += Eigen::Vector3d::Unit(axis) * (here / (here - there));
      ++crossings;
    }
    if (crossings == 0)
      return;
    const Eigen::Vector3d normal = gradient(volume_, at, voxel);
    if (normal.norm() < 1e-9)
      return;
    add(at.cast<double>() + sum / crossings, normal.normalized(), voxel);
  }

  FusedPoints take() {
    FusedPoints result;
    const auto count = static_cast<Eigen::Index>(voxels_.size());
    result.points = Eigen::Map<Eigen::Matrix3Xd>(points_.data(), 3, count);
    result.normals = Eigen::Map<Eigen::Matrix3Xd>(normals_.data(), 3, count);
    result.colors.resize(3, count);
    result.labels.reserve(voxels_.size());
    for (Eigen::Index i = 0; i < count; ++i) {
      const Voxel& voxel = *voxels_[static_cast<std::size_t>(i)];
      result.colors.col(i) = voxel.color;
      if (voxel.colorWeight <= 0.0F)
        result.colors.col(i).setConstant(-1.0F);
      result.labels.push_back(voxel.labels);
    }
    return result;
  }

 private:
  void add(const Eigen::Vector3d& inVoxels, const Eigen::Vector3d& normal, const Voxel& voxel) {
    const Eigen::Vector3d point = volume_.voxelSize() * inVoxels;
    points_.insert(points_.end(), point.data(), point.data() + 3);
    normals_.insert(normals_.end(), normal.data(), normal.data() + 3);
    voxels_.push_back(&voxel);
  }

  const CanonicalVolume& volume_;
  double minWeight_;
  std::vector<double> points_, normals_;
  std::vector<const Voxel*> voxels_;
};

}  // namespace

std::int64_t CanonicalVolume::key(const VoxelIndex& blockIndex) {
  // 21 bits per axis: 67 km of 4 mm voxels.
  constexpr std::int64_t kOffset = std::int64_t{1} << 20;
  return ((blockIndex.x() + kOffset) << 42) | ((blockIndex.y() + kOffset) << 21) |
         (blockIndex.z() + kOffset);
}

void CanonicalVolume::allocateAround(const Eigen::Vector3d& point, double distance) {
  const double blockLength = voxelSize_ * kBlockSize;
  const VoxelIndex low = ((point.array() - distance) / blockLength).floor().cast<int>().matrix();
  const VoxelIndex high = ((point.array() + distance) / blockLength).floor().cast<int>().matrix();
  const VoxelIndex size = (high - low).array() + 1;
  for (int i = 0; i < size.prod(); ++i) {
    const VoxelIndex at =
        low + VoxelIndex(i % size.x(), i / size.x() % size.y(), i / (size.x() * size.y()));
    if (!blockOfKey_.emplace(key(at), numBlocks()).second)
      continue;
    origins_.emplace_back(kBlockSize * at);
    blocks_.emplace_back();
  }
}

const Voxel* CanonicalVolume::find(const VoxelIndex& voxel) const {
  const VoxelIndex blockIndex = {
      floorDivide(voxel.x(), kBlockSize),
      floorDivide(voxel.y(), kBlockSize),
      floorDivide(voxel.z(), kBlockSize)};
  const auto found = blockOfKey_.find(key(blockIndex));
  if (found == blockOfKey_.end())
    return nullptr;
  const VoxelIndex inside = voxel - kBlockSize * blockIndex;
  return &block(found->second)[inBlock(inside)];
}

FusedPoints surfacePoints(const CanonicalVolume& volume, double minWeight) {
  PointCollector collector(volume, minWeight);
  for (int b = 0; b < volume.numBlocks(); ++b) {
    const CanonicalVolume::Block& block = volume.block(b);
    for (std::size_t i = 0; i < block.size(); ++i)
      collector.visit(volume.origin(b) + CanonicalVolume::offset(static_cast<int>(i)), block[i]);
  }
  return collector.take();
}

}  // namespace avatar
