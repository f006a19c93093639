#include "avatar/digitization/fusion.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <unordered_map>

namespace avatar {
namespace {

void demand(bool holds, const char* what) {
  if (!holds)
    throw std::invalid_argument(std::string("FusionOptions: ") + what);
}

/// What a pixel tells about a point near it.
struct Observation {
  float distance = 0.0F;  // signed, to the pixel's tangent plane [m]
  float weight = 0.0F;    // 0: nothing
  std::size_t pixel = 0;
};

class FrameView {
 public:
  FrameView(const PosedDepthFrame& frame, const FusionOptions& options)
      : frame_(frame),
        truncation_(static_cast<float>(options.truncation)),
        minCosine_(static_cast<float>(options.minCosine)),
        fx_(static_cast<float>(frame.camera.fx)),
        fy_(static_cast<float>(frame.camera.fy)),
        cx_(static_cast<float>(frame.camera.cx)),
        cy_(static_cast<float>(frame.camera.cy)) {}

  Observation observe(const Eigen::Vector3f& inCamera) const {
    if (inCamera.z() < 0.05F)
      return {};
    const float u = fx_ * inCamera.x() / inCamera.z() + cx_;
    const float v = fy_ * inCamera.y() / inCamera.z() + cy_;
    const auto x = static_cast<int>(std::floor(u + 0.5F));
    const auto y = static_cast<int>(std::floor(v + 0.5F));
    if (x < 0 || y < 0 || x >= frame_.camera.width || y >= frame_.camera.height)
      return {};
    const std::size_t pixel = frame_.index(x, y);
    const float depth = frame_.depth[pixel];
    // Well behind what the pixel shows: hidden.
    if (depth <= 0.0F || inCamera.z() - depth > 3.0F * truncation_)
      return {};
    const Eigen::Vector3f normal = frame_.normals.col(static_cast<Eigen::Index>(pixel));
    const Eigen::Vector3f ray(
        (static_cast<float>(x) - cx_) / fx_, (static_cast<float>(y) - cy_) / fy_, 1.0F);
    const float cosine = -normal.dot(ray) / ray.norm();
    if (!(cosine > minCosine_))
      return {};
    const float distance = normal.dot(inCamera - depth * ray);
    if (distance < -truncation_)
      return {};
    return {std::min(distance, truncation_), cosine / (depth * depth), pixel};
  }

 private:
  const PosedDepthFrame& frame_;
  float truncation_, minCosine_, fx_, fy_, cx_, cy_;
};

void addObservation(Voxel& voxel, const Observation& seen, float maxWeight) {
  const float weight = voxel.weight + seen.weight;
  voxel.distance = (voxel.weight * voxel.distance + seen.weight * seen.distance) / weight;
  voxel.weight = std::min(weight, maxWeight);
}

void addAppearance(Voxel& voxel, const Observation& seen, const PosedDepthFrame& frame) {
  if (!frame.color.rgb.empty()) {
    const std::uint8_t* rgb = &frame.color.rgb[3 * seen.pixel];
    const Eigen::Vector3f color = Eigen::Vector3f(rgb[0], rgb[1], rgb[2]) / 255.0F;
    voxel.colorWeight += seen.weight;
    voxel.color += (seen.weight / voxel.colorWeight) * (color - voxel.color);
  }
  if (!frame.labels.empty() && frame.labels[seen.pixel] != kNoLabel) {
    std::uint16_t& count = voxel.labels[frame.labels[seen.pixel] - 1U];
    count = static_cast<std::uint16_t>(std::min<int>(count + 1, 65535));
  }
}

}  // namespace

void FusionOptions::validate() const {
  demand(voxelSize >= 0.001 && voxelSize <= 0.05, "voxelSize is expected in 0.001 … 0.05 m");
  demand(
      truncation >= 2.0 * voxelSize && truncation <= 0.2,
      "truncation is expected in 2 voxels … 0.2 m");
  demand(maxBodyDistance > 0.0, "maxBodyDistance is expected above 0");
  demand(maxWeight >= 1.0, "maxWeight is expected at 1 or above");
  demand(minCosine > 0.0 && minCosine < 1.0, "minCosine is expected in (0, 1)");
  demand(collisionDistance > 0.0, "collisionDistance is expected above 0");
  demand(runLoop != nullptr, "runLoop is missing");
}

CanonicalFusion::CanonicalFusion(
    const Skinning& skinning,
    const Eigen::VectorXd& betas,
    const BodyPose& pose,
    const FusionOptions& options)
    : skinning_(skinning),
      options_(options),
      shaped_(skinning.shape(betas)),
      canonical_(skinning, shaped_, pose),
      live_(skinning, shaped_, pose),
      volume_((options.validate(), options.voxelSize)) {}

void CanonicalFusion::allocate(const PosedDepthFrame& frame) {
  requireValid(frame);
  live_.setPose(shaped_, frame.pose);
  // Blocks are eight voxels wide, so every fourth pixel reaches all of them up to about 4 m.
  constexpr int kStride = 4;
  for (int y = 0; y < frame.camera.height; y += kStride) {
    for (int x = 0; x < frame.camera.width; x += kStride) {
      const auto depth = static_cast<double>(frame.depth[frame.index(x, y)]);
      if (depth <= 0.0)
        continue;
      const Eigen::Vector3d point = unproject(frame.camera, {double(x), double(y), depth});
      const auto anchor = live_.anchor(point, options_.maxBodyDistance);
      if (!anchor)
        continue;
      const Eigen::Vector3d rest =
          blendedTransform(anchor->weights, live_.posedFromRest()).inverse() * point;
      volume_.allocateAround(
          blendedTransform(anchor->weights, canonical_.posedFromRest()) * rest,
          options_.truncation);
    }
  }
}

Eigen::Vector3d CanonicalFusion::canonicalPoint(int block, int corner) const {
  const VoxelIndex offset = {
      corner % kLatticeSize,
      corner / kLatticeSize % kLatticeSize,
      corner / (kLatticeSize * kLatticeSize)};
  return volume_.point(volume_.origin(block) + kLatticeStep * offset);
}

CanonicalFusion::LatticePoint CanonicalFusion::latticePoint(int block, int corner) const {
  LatticePoint result;
  const Eigen::Vector3d point = canonicalPoint(block, corner);
  // Blocks reach a little further than the depth that they were made for.
  auto anchor = canonical_.anchor(point, options_.maxBodyDistance + 0.1);
  if (!anchor)
    return result;
  result.followsBody = true;
  result.bodyDistance = static_cast<float>(std::sqrt(anchor->skin.squaredDistance));
  result.rest = blendedTransform(anchor->weights, canonical_.posedFromRest()).inverse() * point;
  result.weights = std::move(anchor->weights);
  return result;
}

void CanonicalFusion::prepareLattice() {
  const auto first = static_cast<int>(lattice_.size() / kLatticePoints);
  lattice_.resize(static_cast<std::size_t>(volume_.numBlocks()) * kLatticePoints);
  options_.runLoop(volume_.numBlocks() - first, [&](long i) {
    const int block = first + static_cast<int>(i);
    const std::size_t begin = static_cast<std::size_t>(block) * kLatticePoints;
    for (int corner = 0; corner < kLatticePoints; ++corner)
      lattice_[begin + static_cast<std::size_t>(corner)] = latticePoint(block, corner);
  });
}

std::vector<CanonicalFusion::LivePoint> CanonicalFusion::livePoints(
    const PosedDepthFrame& frame) const {
  const std::vector<Eigen::Affine3d> toLive =
      posedFromRest(shaped_, skinning_.pose(shaped_, frame.pose));
  std::vector<LivePoint> live(lattice_.size());
  options_.runLoop(volume_.numBlocks(), [&](long block) {
    for (int corner = 0; corner < kLatticePoints; ++corner) {
      const auto i = static_cast<std::size_t>(block * kLatticePoints + corner);
      const LatticePoint& point = lattice_[i];
      if (!point.followsBody)
        continue;
      const Eigen::Vector3d inWorld = blendedTransform(point.weights, toLive) * point.rest;
      live[i] = {(frame.camera.cameraFromWorld * inWorld).cast<float>(), true};
    }
  });
  return live;
}

void CanonicalFusion::dropCollisions(std::vector<LivePoint>& live) {
  // Cells of the live space; each belongs to the lattice point nearest to its body.
  constexpr float kCell = 0.02F;
  const auto cellKey = [&](const LivePoint& point) {
    const Eigen::Matrix<std::int64_t, 3, 1> cell =
        (point.inCamera.array() / kCell).floor().cast<std::int64_t>() + (1 << 20);
    return (cell.x() << 42) | (cell.y() << 21) | cell.z();
  };
  std::unordered_map<std::int64_t, std::size_t> owners;  // looked up, never walked through
  owners.reserve(live.size() / 4);
  for (std::size_t i = 0; i < live.size(); ++i) {
    if (!live[i].usable)
      continue;
    const auto [owner, isNew] = owners.emplace(cellKey(live[i]), i);
    if (!isNew && lattice_[i].bodyDistance < lattice_[owner->second].bodyDistance)
      owner->second = i;
  }
  const auto place = [&](std::size_t i) {
    return canonicalPoint(
        static_cast<int>(i / kLatticePoints), static_cast<int>(i % kLatticePoints));
  };
  for (std::size_t i = 0; i < live.size(); ++i) {
    if (!live[i].usable)
      continue;
    const std::size_t owner = owners.at(cellKey(live[i]));
    if (owner == i || (place(i) - place(owner)).norm() < options_.collisionDistance)
      continue;
    live[i].usable = false;
    ++collisions_;
  }
}

CanonicalFusion::LivePoint CanonicalFusion::livePoint(
    const LivePoint* corners, const VoxelIndex& inBlock) {
  const VoxelIndex low = inBlock / kLatticeStep;
  const Eigen::Vector3f t =
      (inBlock - kLatticeStep * low).cast<float>() / static_cast<float>(kLatticeStep);
  LivePoint result{.usable = true};
  for (int corner = 0; corner < 8; ++corner) {
    const VoxelIndex step = {corner & 1, corner >> 1 & 1, corner >> 2};
    const VoxelIndex at = low + step;
    const LivePoint& point = corners[(at.z() * kLatticeSize + at.y()) * kLatticeSize + at.x()];
    const Eigen::Array3f towards = step.cast<float>().array();
    const float share = (towards * t.array() + (1.0F - towards) * (1.0F - t.array())).prod();
    result.usable = result.usable && point.usable;
    result.inCamera += share * point.inCamera;
  }
  return result;
}

void CanonicalFusion::integrateBlock(
    int block, const LivePoint* corners, const PosedDepthFrame& frame) {
  const FrameView view(frame, options_);
  CanonicalVolume::Block& voxels = volume_.block(block);
  const auto appearanceReach = static_cast<float>(2.0 * options_.voxelSize);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const LivePoint live = livePoint(corners, CanonicalVolume::offset(static_cast<int>(i)));
    const Observation seen = live.usable ? view.observe(live.inCamera) : Observation{};
    if (seen.weight <= 0.0F)
      continue;
    Voxel& voxel = voxels[i];
    addObservation(voxel, seen, static_cast<float>(options_.maxWeight));
    if (std::abs(seen.distance) < appearanceReach)
      addAppearance(voxel, seen, frame);
  }
}

void CanonicalFusion::integrate(const PosedDepthFrame& frame) {
  requireValid(frame);
  prepareLattice();
  std::vector<LivePoint> live = livePoints(frame);
  dropCollisions(live);
  options_.runLoop(volume_.numBlocks(), [&](long block) {
    const LivePoint* corners = &live[static_cast<std::size_t>(block) * kLatticePoints];
    if (std::any_of(corners, corners + kLatticePoints, [](const LivePoint& p) { return p.usable; }))
      integrateBlock(static_cast<int>(block), corners, frame);
  });
}

}  // namespace avatar
