#pragma once

#include "avatar/geometry/closest_point.h"
#include "avatar/skinning.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <optional>
#include <vector>

namespace avatar {

/// The joints that carry a point, and how much; weights sum to 1.
struct JointWeights {
  std::vector<int> joints;
  std::vector<double> weights;
};

/// The blended transform Σ_k w_k M_k.
Eigen::Affine3d blendedTransform(
    const JointWeights& weights, const std::vector<Eigen::Affine3d>& transforms);

/// A body in one pose, and how the space around it follows the body: every point takes the skinning
/// weights of the nearest point of the skin. Points go from one pose to another through the rest
/// pose, (Σ w_k M'_k)(Σ w_k M_k)⁻¹ with M_k the map from rest to posed, which is exact on the skin
/// up to pose blend shapes. Keeps a reference to the skinning; const functions may run in parallel.
class SkinningField {
 public:
  SkinningField(const Skinning& skinning, const ShapedBody& shaped, const BodyPose& pose);

  /// Another pose of the same shape.
  void setPose(const ShapedBody& shaped, const BodyPose& pose);

  struct Anchor {
    ClosestPoint skin;     ///< nearest point of the skin
    JointWeights weights;  ///< there
  };

  /// Nothing when the skin is further away than maxDistance [m].
  std::optional<Anchor> anchor(const Eigen::Vector3d& point, double maxDistance) const;

  /// J maps from the rest pose to this one, M_k.
  const std::vector<Eigen::Affine3d>& posedFromRest() const { return posedFromRest_; }

  const SkinnedBody& body() const { return body_; }

 private:
  const Skinning& skinning_;
  SkinnedBody body_;
  TriangleBvh bvh_;
  std::vector<Eigen::Affine3d> posedFromRest_;
};

/// J maps from the rest pose to a pose.
std::vector<Eigen::Affine3d> posedFromRest(const ShapedBody& shaped, const SkinnedBody& posed);

}  // namespace avatar
