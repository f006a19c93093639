#pragma once

#include "avatar/digitization/canonical_volume.h"
#include "avatar/digitization/limbs.h"
#include "avatar/digitization/posed_frame.h"
#include "avatar/digitization/skinning_field.h"
#include "avatar/skinning.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace avatar {

struct FusionOptions {
  double voxelSize = 0.004;   ///< [m], 0.001 … 0.05
  double truncation = 0.016;  ///< [m], 2 voxels … 0.2
  /// Of what hangs from the hips: farther than it swings. What swings beyond its truncation would
  /// be carved away by the frames that see past it, and only its inmost place would stay [m].
  double hangingTruncation = 0.04;  ///< or `truncation`, if that is more; up to 0.2
  double maxBodyDistance = 0.35;    ///< depth further from the body is not the person's [m], > 0
  double maxWeight = 200.0;  ///< of a voxel: later frames never count less than 1 in this, ≥ 1
  double minCosine = 0.15;   ///< surface seen more obliquely is not used, (0, 1)
  /// Skin of trunk and arm is told apart by this difference of the distances [m], 0 … 0.05.
  double contactMargin = 0.02;
  double collisionDistance = 0.08;  ///< places of the canonical pose this far apart [m] that meet
                                    ///< in a frame collide, > 0
  /// A skirt or a dress covers the legs together: off their skin it hangs plumb from the hips.
  bool legsCovered = false;
  LoopRunner runLoop = runSerially;

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// Depth of many frames of a moving person, fused in one pose (paper section 3; formulation A2).
///
/// Every voxel near the surface follows the body by the skinning weights of the nearest skin; in
/// each frame it takes the distance to the tangent plane of the pixel it falls on, weighted by
/// cosine and inverse squared depth (the sensor's noise), and the pixel's colour and label.
/// Voxels that fall where another part of the body is as well are left out in that frame
/// (Fusion4D), and so is what lies as near to an arm as to the trunk beside it: cloth of a
/// hanging sleeve and of the side can't be told apart, and would go with the wrong one.
class CanonicalFusion {
 public:
  /// Keeps a reference to the skinning. `pose`: of the fused person, arms and legs apart.
  CanonicalFusion(
      const Skinning& skinning,
      const Eigen::VectorXd& betas,
      const BodyPose& pose,
      const FusionOptions& options = {});

  /// Room for what a frame sees: for all frames before the first integrate().
  void allocate(const PosedDepthFrame& frame);

  /// Throws std::invalid_argument for images that don't fit the camera.
  void integrate(const PosedDepthFrame& frame);

  const CanonicalVolume& volume() const { return volume_; }

  /// Voxels left out for collisions, summed over the frames (counted on the coarse lattice).
  long collisions() const { return collisions_; }

 private:
  // The warp is computed on a lattice of every fourth voxel and interpolated between: it is affine
  // per joint, so nothing is lost.
  static constexpr int kLatticeStep = 4;
  static constexpr int kLatticeSize = CanonicalVolume::kBlockSize / kLatticeStep + 1;
  static constexpr int kLatticePoints = kLatticeSize * kLatticeSize * kLatticeSize;

  struct LatticePoint {
    JointWeights weights;
    Eigen::Vector3d rest = Eigen::Vector3d::Zero();  // rest pose [m]
    float bodyDistance = 0.0F;                       // canonical [m]
    float truncation = 0.0F;                         // [m]
    bool followsBody = false;
  };

  /// Of a point that a frame sees, in the canonical pose.
  struct SurfacePlace {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  // [m]
    double truncation = 0.0;                          // [m]
  };

  struct LivePoint {
    Eigen::Vector3f inCamera = Eigen::Vector3f::Zero();  // [m]
    float truncation = 0.0F;                             // [m]
    bool usable = false;
  };

  /// The lattice along x through a row of a block's voxels.
  using LatticeRow = std::array<LivePoint, kLatticeSize>;

  JointWeights carriers(const SkinningField::Anchor& anchor) const;
  double truncationOf(const JointWeights& weights) const;
  std::optional<SurfacePlace> canonicalFromLive(const Eigen::Vector3d& point) const;
  void prepareLattice();
  LatticePoint latticePoint(int block, int corner) const;
  Eigen::Vector3d canonicalPoint(int block, int corner) const;
  std::vector<LivePoint> livePoints(const PosedDepthFrame& frame) const;
  void countCollisions(const std::vector<LivePoint>& live);
  void dropCollisions(std::vector<LivePoint>& live) const;
  static LatticeRow latticeRow(const LivePoint* corners, int y, int z);
  void integrateBlock(int block, const LivePoint* corners, const PosedDepthFrame& frame);

  const Skinning& skinning_;
  FusionOptions options_;
  ShapedBody shaped_;
  SkinningField canonical_;
  SkinningField live_;
  // Of the joints and of what hangs from the hips.
  std::vector<Eigen::Affine3d> canonicalFromRest_, liveFromRest_;
  std::vector<Limb> limbs_;
  CanonicalVolume volume_;
  std::vector<LatticePoint> lattice_;  // kLatticePoints per block
  long collisions_ = 0;
};

}  // namespace avatar
