#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <vector>

namespace avatar {

/// Throws std::invalid_argument, saying which, when two parts of a model don't fit together.
void requireValid(const BodyModel& model);

/// T̄ + S β, 3 × V [m]. Fewer betas than the model has: the others are 0. Throws
/// std::invalid_argument for more of them or values that are not finite.
Eigen::Matrix3Xd shapedVertices(const BodyModel& model, const Eigen::VectorXd& betas);

/// The rotation matrix of an axis-angle vector [rad] (Rodrigues), exact for every length.
Eigen::Matrix3d rotationMatrix(const Eigen::Vector3d& axisAngle);

/// A body of one shape at rest: everything about posing that depends on betas alone.
struct ShapedBody {
  Eigen::Matrix3Xd vertices;  ///< T̄ + S β, 3 × V [m]
  Eigen::Matrix3Xd joints;    ///< 𝒥(T̄ + S β), 3 × J [m]
};

struct SkinnedBody {
  Eigen::Matrix3Xd vertices;      ///< posed, 3 × V [m]
  Eigen::Matrix3Xd restVertices;  ///< T: shaped, with pose blend shapes, not yet skinned, 3 × V [m]
  Eigen::Matrix3Xd joints;        ///< posed, 3 × J [m]
  /// J rotations and positions: G_k of formulation and the translation; maps the joint's own frame
  /// (origin at the joint, axes of the rest pose) to the world.
  std::vector<Eigen::Isometry3d> worldFromJoint;
};

/// Linear blend skinning with pose blend shapes (Loper 2015, eq. 2–9; as in smplx `lbs`):
///
///   T = T̄ + S β + P vec(R₁−I, …),  J = 𝒥(T̄ + S β),  G_k = G_parent [R_k | J_k − J_parent],
///   v = Σ_k w_k G_k (T − J_k) + t.
///
/// Prepares a model for posing it often. Keeps a reference to the model, which must outlive it and
/// stay as it is. All functions are const and may run in parallel.
class Skinning {
 public:
  /// Throws std::invalid_argument when the model's parts don't fit together.
  explicit Skinning(const BodyModel& model);

  const BodyModel& model() const { return model_; }

  /// As shapedVertices(), with the joints.
  ShapedBody shape(const Eigen::VectorXd& betas) const;

  /// Joints beyond the pose's values stay at rest. Throws std::invalid_argument when the pose moves
  /// joints that the model doesn't have, has no whole number of joints or isn't finite.
  SkinnedBody pose(const ShapedBody& shaped, const BodyPose& pose) const;

  /// One joint's pose blend shape, without the vertices that it leaves alone.
  struct PoseBlendShape {
    int joint = 0;
    std::vector<int> vertices;   ///< n, ascending
    Eigen::MatrixXf directions;  ///< 3n × 9, a column per entry of R − I (rows first)
  };

  const std::vector<PoseBlendShape>& poseBlendShapes() const { return poseBlendShapes_; }

 private:
  const BodyModel& model_;
  std::vector<PoseBlendShape> poseBlendShapes_;
};

/// Shapes and poses once; for many poses keep a Skinning.
SkinnedBody posedBody(const BodyModel& model, const Eigen::VectorXd& betas, const BodyPose& pose);

/// The vertices of posedBody(), 3 × V [m].
Eigen::Matrix3Xd posedVertices(
    const BodyModel& model, const Eigen::VectorXd& betas, const BodyPose& pose);

}  // namespace avatar
