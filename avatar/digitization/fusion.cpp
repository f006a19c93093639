#include "avatar/digitization/fusion.h"

#include "avatar/hanging_cloth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

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
  float cosine = 0.0F;    // of the angle it is seen under
  std::size_t pixel = 0;
};

class FrameView {
 public:
  FrameView(const PosedDepthFrame& frame, const FusionOptions& options)
      : frame_(frame),
        minCosine_(static_cast<float>(options.minCosine)),
        width_(static_cast<float>(frame.camera.width)),
        height_(static_cast<float>(frame.camera.height)),
        fx_(static_cast<float>(frame.camera.fx)),
        fy_(static_cast<float>(frame.camera.fy)),
        cx_(static_cast<float>(frame.camera.cx)),
        cy_(static_cast<float>(frame.camera.cy)) {}

  Observation observe(const Eigen::Vector3f& inCamera, float truncation) const {
    if (inCamera.z() < 0.05F)
      return {};
    // To the nearest pixel: after the test for negative ones, cutting off is rounding down.
    const float u = fx_ * inCamera.x() / inCamera.z() + cx_ + 0.5F;
    const float v = fy_ * inCamera.y() / inCamera.z() + cy_ + 0.5F;
    if (!(u >= 0.0F && v >= 0.0F && u < width_ && v < height_))
      return {};
    const auto x = static_cast<int>(u);
    const auto y = static_cast<int>(v);
    const std::size_t pixel = frame_.index(x, y);
    const float depth = frame_.depth[pixel];
    // Well behind what the pixel shows: hidden.
    if (depth <= 0.0F || inCamera.z() - depth > 3.0F * truncation)
      return {};
    const Eigen::Vector3f normal = frame_.normals.col(static_cast<Eigen::Index>(pixel));
    const Eigen::Vector3f ray(
        (static_cast<float>(x) - cx_) / fx_, (static_cast<float>(y) - cy_) / fy_, 1.0F);
    const float cosine = -normal.dot(ray) / ray.norm();
    if (!(cosine > minCosine_))
      return {};
    const float distance = normal.dot(inCamera - depth * ray);
    if (distance < -truncation)
      return {};
    return {std::min(distance, truncation), cosine / (depth * depth), cosine, pixel};
  }

 private:
  const PosedDepthFrame& frame_;
  float minCosine_, width_, height_, fx_, fy_, cx_, cy_;
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
    // Colours of oblique views are smeared, and the wrong ones where color and depth don't fit
    // together: those that see a place straight decide.
    const float weight = seen.weight * seen.cosine * seen.cosine * seen.cosine;
    voxel.colorWeight += weight;
    voxel.color += (weight / voxel.colorWeight) * (color - voxel.color);
  }
  if (!frame.labels.empty() && frame.labels[seen.pixel] != kNoLabel) {
    std::uint16_t& count = voxel.labels[frame.labels[seen.pixel] - 1U];
    count = static_cast<std::uint16_t>(std::min<int>(count + 1, 65535));
  }
}

/// The maps of the joints, and behind them that of what hangs from the hips.
std::vector<Eigen::Affine3d> withPlumb(
    std::vector<Eigen::Affine3d> fromRest, const ShapedBody& shaped, const BodyPose& pose) {
  const Eigen::Vector3d hips = shaped.joints.col(kPelvis);
  fromRest.emplace_back(plumbFromRest(hips, fromRest[kPelvis] * hips, pose));
  return fromRest;
}

/// A share of what the legs carry goes over to what hangs from the hips.
JointWeights hungFromHips(JointWeights weights, double share, int plumb) {
  double moved = 0.0;
  for (std::size_t i = 0; i < weights.joints.size(); ++i) {
    if (!isOfLeg(weights.joints[i]))
      continue;
    moved += share * weights.weights[i];
    weights.weights[i] *= 1.0 - share;
  }
  weights.joints.push_back(plumb);
  weights.weights.push_back(moved);
  return weights;
}

}  // namespace

void FusionOptions::validate() const {
  demand(voxelSize >= 0.001 && voxelSize <= 0.05, "voxelSize is expected in 0.001 … 0.05 m");
  demand(
      truncation >= 2.0 * voxelSize && truncation <= 0.2,
      "truncation is expected in 2 voxels … 0.2 m");
  demand(
      hangingTruncation > 0.0 && hangingTruncation <= 0.2,
      "hangingTruncation is expected in 0 … 0.2 m");
  demand(maxBodyDistance > 0.0, "maxBodyDistance is expected above 0");
  demand(maxWeight >= 1.0, "maxWeight is expected at 1 or above");
  demand(minCosine > 0.0 && minCosine < 1.0, "minCosine is expected in (0, 1)");
  demand(contactMargin >= 0.0 && contactMargin <= 0.05, "contactMargin is expected in 0 … 0.05 m");
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
      canonicalFromRest_(withPlumb(canonical_.posedFromRest(), shaped_, pose)),
      liveFromRest_(canonicalFromRest_),
      limbs_(limbsOfBody(skinning.model())),
      volume_((options.validate(), options.voxelSize)) {}

void CanonicalFusion::allocate(const PosedDepthFrame& frame) {
  requireValid(frame);
  live_.setPose(shaped_, frame.pose);
  liveFromRest_ = withPlumb(live_.posedFromRest(), shaped_, frame.pose);
  const float farthest = *std::max_element(frame.depth.begin(), frame.depth.end());
  if (farthest <= 0.0F)
    return;
  // Pixels at most a block's width apart reach all blocks.
  const double blockLength = options_.voxelSize * CanonicalVolume::kBlockSize;
  const int stride = std::clamp(
      static_cast<int>(blockLength * frame.camera.fx / static_cast<double>(farthest)), 1, 16);
  const auto numRows = static_cast<std::size_t>((frame.camera.height + stride - 1) / stride);
  std::vector<std::vector<SurfacePlace>> rows(numRows);
  options_.runLoop(static_cast<long>(numRows), [&](long row) {
    const int y = static_cast<int>(row) * stride;
    for (int x = 0; x < frame.camera.width; x += stride) {
      const auto depth = static_cast<double>(frame.depth[frame.index(x, y)]);
      if (depth <= 0.0)
        continue;
      const auto place = canonicalFromLive(unproject(frame.camera, {double(x), double(y), depth}));
      if (place)
        rows[static_cast<std::size_t>(row)].push_back(*place);
    }
  });
  for (const auto& row : rows) {
    for (const SurfacePlace& place : row)
      volume_.allocateAround(place.point, place.truncation);
  }
}

/// What carries a point: the joints of its nearest skin, but for a skirt.
JointWeights CanonicalFusion::carriers(const SkinningField::Anchor& anchor) const {
  if (!options_.legsCovered)
    return anchor.weights;
  const double share = hangingShare(std::sqrt(anchor.skin.squaredDistance));
  return hungFromHips(anchor.weights, share, static_cast<int>(shaped_.joints.cols()));
}

double CanonicalFusion::truncationOf(const JointWeights& weights) const {
  const double hanging = options_.legsCovered ? weights.weights.back() : 0.0;
  const double further = std::max(0.0, options_.hangingTruncation - options_.truncation);
  return options_.truncation + hanging * further;
}

std::optional<CanonicalFusion::SurfacePlace> CanonicalFusion::canonicalFromLive(
    const Eigen::Vector3d& point) const {
  const auto anchor = live_.anchor(point, options_.maxBodyDistance);
  if (!anchor)
    return std::nullopt;
  const JointWeights weights = carriers(*anchor);
  const Eigen::Vector3d rest = blendedTransform(weights, liveFromRest_).inverse() * point;
  return SurfacePlace{blendedTransform(weights, canonicalFromRest_) * rest, truncationOf(weights)};
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
  const auto anchor = canonical_.anchor(point, options_.maxBodyDistance + 0.1);
  if (!anchor)
    return result;
  result.followsBody = true;
  result.bodyDistance = static_cast<float>(std::sqrt(anchor->skin.squaredDistance));
  result.weights = carriers(*anchor);
  result.truncation = static_cast<float>(truncationOf(result.weights));
  result.rest = blendedTransform(result.weights, canonicalFromRest_).inverse() * point;
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
  const SkinnedBody body = skinning_.pose(shaped_, frame.pose);
  const std::vector<Eigen::Affine3d> toLive =
      withPlumb(posedFromRest(shaped_, body), shaped_, frame.pose);
  const Eigen::Matrix3Xd inCamera = frame.camera.cameraFromWorld * body.vertices;
  const ArmContact contact(inCamera.cast<float>(), canonical_.body().vertices, limbs_);
  const auto margin = static_cast<float>(options_.contactMargin);
  const auto apart = static_cast<float>(options_.collisionDistance);
  std::vector<LivePoint> live(lattice_.size());
  options_.runLoop(volume_.numBlocks(), [&](long block) {
    for (int corner = 0; corner < kLatticePoints; ++corner) {
      const auto i = static_cast<std::size_t>(block * kLatticePoints + corner);
      const LatticePoint& point = lattice_[i];
      if (!point.followsBody)
        continue;
      const Eigen::Vector3d inWorld = blendedTransform(point.weights, toLive) * point.rest;
      const Eigen::Vector3f place = (frame.camera.cameraFromWorld * inWorld).cast<float>();
      const Eigen::Vector3f canonical =
          canonicalPoint(static_cast<int>(block), corner).cast<float>();
      live[i] = {
          place,
          point.truncation,
          !contact.isAt(place, canonical, point.bodyDistance + margin, apart)};
    }
  });
  return live;
}

void CanonicalFusion::dropCollisions(std::vector<LivePoint>& live) const {
  Eigen::AlignedBox3f box;
  for (const LivePoint& point : live) {
    if (point.usable)
      box.extend(point.inCamera);
  }
  if (box.isEmpty())
    return;
  // Cells of the live space; each belongs to the lattice point nearest to its body.
  constexpr float kCell = 0.02F;
  const Eigen::Vector3i size = (box.sizes() / kCell).cast<int>().array() + 1;
  const auto cellOf = [&](const LivePoint& point) {
    const Eigen::Vector3i cell = ((point.inCamera - box.min()) / kCell).cast<int>();
    const Eigen::Index row = Eigen::Index{cell.z()} * size.y() + cell.y();
    return static_cast<std::size_t>(row * size.x() + cell.x());
  };
  constexpr int kNobody = -1;
  std::vector<int> owners(static_cast<std::size_t>(size.prod()), kNobody);
  for (std::size_t i = 0; i < live.size(); ++i) {
    if (!live[i].usable)
      continue;
    int& owner = owners[cellOf(live[i])];
    if (owner == kNobody ||
        lattice_[i].bodyDistance < lattice_[static_cast<std::size_t>(owner)].bodyDistance)
      owner = static_cast<int>(i);
  }
  const auto place = [&](std::size_t i) {
    return canonicalPoint(
        static_cast<int>(i / kLatticePoints), static_cast<int>(i % kLatticePoints));
  };
  for (std::size_t i = 0; i < live.size(); ++i) {
    if (!live[i].usable)
      continue;
    const auto owner = static_cast<std::size_t>(owners[cellOf(live[i])]);
    if (owner == i || (place(i) - place(owner)).norm() < options_.collisionDistance)
      continue;
    live[i].usable = false;
  }
}

void CanonicalFusion::countCollisions(const std::vector<LivePoint>& live) {
  for (std::size_t i = 0; i < live.size(); ++i)
    collisions_ += lattice_[i].followsBody && !live[i].usable ? 1 : 0;
}

CanonicalFusion::LatticeRow CanonicalFusion::latticeRow(const LivePoint* corners, int y, int z) {
  const int lowY = y / kLatticeStep;
  const int lowZ = z / kLatticeStep;
  constexpr auto kStep = static_cast<float>(kLatticeStep);
  const float ty = static_cast<float>(y % kLatticeStep) / kStep;
  const float tz = static_cast<float>(z % kLatticeStep) / kStep;
  LatticeRow row;
  for (int x = 0; x < kLatticeSize; ++x) {
    const auto at = [&](int dy, int dz) -> const LivePoint& {
      return corners[((lowZ + dz) * kLatticeSize + lowY + dy) * kLatticeSize + x];
    };
    LivePoint& point = row[static_cast<std::size_t>(x)];
    point.usable = at(0, 0).usable && at(1, 0).usable && at(0, 1).usable && at(1, 1).usable;
    point.inCamera = (1.0F - tz) * ((1.0F - ty) * at(0, 0).inCamera + ty * at(1, 0).inCamera) +
                     tz * ((1.0F - ty) * at(0, 1).inCamera + ty * at(1, 1).inCamera);
    point.truncation =
        (1.0F - tz) * ((1.0F - ty) * at(0, 0).truncation + ty * at(1, 0).truncation) +
        tz * ((1.0F - ty) * at(0, 1).truncation + ty * at(1, 1).truncation);
  }
  return row;
}

void CanonicalFusion::integrateBlock(
    int block, const LivePoint* corners, const PosedDepthFrame& frame) {
  const FrameView view(frame, options_);
  CanonicalVolume::Block& voxels = volume_.block(block);
  const auto appearanceReach = static_cast<float>(2.0 * options_.voxelSize);
  constexpr int kSize = CanonicalVolume::kBlockSize;
  for (int line = 0; line < kSize * kSize; ++line) {
    const LatticeRow row = latticeRow(corners, line % kSize, line / kSize);
    for (int x = 0; x < kSize; ++x) {
      const auto place = static_cast<std::size_t>(x / kLatticeStep);
      const LivePoint& low = row[place];
      const LivePoint& high = row[place + 1];
      if (!low.usable || !high.usable)
        continue;
      const float t = static_cast<float>(x % kLatticeStep) / static_cast<float>(kLatticeStep);
      const Observation seen = view.observe(
          low.inCamera + t * (high.inCamera - low.inCamera),
          low.truncation + t * (high.truncation - low.truncation));
      if (seen.weight <= 0.0F)
        continue;
      Voxel& voxel = voxels[static_cast<std::size_t>(line) * kSize + static_cast<std::size_t>(x)];
      addObservation(voxel, seen, static_cast<float>(options_.maxWeight));
      if (std::abs(seen.distance) < appearanceReach)
        addAppearance(voxel, seen, frame);
    }
  }
}

void CanonicalFusion::integrate(const PosedDepthFrame& frame) {
  requireValid(frame);
  prepareLattice();
  std::vector<LivePoint> live = livePoints(frame);
  dropCollisions(live);
  countCollisions(live);
  options_.runLoop(volume_.numBlocks(), [&](long block) {
    const LivePoint* corners = &live[static_cast<std::size_t>(block) * kLatticePoints];
    if (std::any_of(corners, corners + kLatticePoints, [](const LivePoint& p) { return p.usable; }))
      integrateBlock(static_cast<int>(block), corners, frame);
  });
}

}  // namespace avatar
