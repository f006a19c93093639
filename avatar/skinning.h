#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"

#include <Eigen/Geometry>

#include <vector>

namespace avatar {

/// A body of one shape in its rest pose.
struct ShapedBody {
  Eigen::Matrix3Xd vertices;  ///< T̄ + Sβ, 3 × V [m]
  Eigen::Matrix3Xd joints;    ///< 𝒥(T̄ + Sβ), 3 × J [m]: joints depend on shape only
};

/// A posed body and the bone motions that made it.
struct PosedBody {
  Eigen::Matrix3Xd vertices;               ///< 3 × V [m], world
  Eigen::Matrix3Xd joints;                 ///< 3 × J [m], world
  std::vector<Eigen::Matrix3d> rotations;  ///< J: world from joint, without translation
};

/// The derivative of one vertex by the pose: only joints between the root and the bones that move
/// it count. For a change δ of joints[i]'s axis-angle vector and ε of the translation the vertex
/// moves by Σ byRotation.middleCols<3>(3i) δ + ε.
struct VertexDerivative {
  std::vector<int> joints;      ///< ascending
  Eigen::Matrix3Xd byRotation;  ///< 3 × 3·joints.size() [m/rad]
};

/// Linear blend skinning with pose blend shapes, SMPL's function (Loper 2015, eqs. 2–9), for one
/// body model: T = T̄ + Sβ + P vec(R − I), v = Σ_k w_k G_k (T − J_k) + t.
/// Holds the model's weights and pose directions packed for speed; the model must outlive it.
class Skinning {
 public:
  explicit Skinning(const BodyModel& model);

  const BodyModel& model() const { return model_; }

  /// The rest shape for betas (up to B; the missing ones are 0). Throws std::invalid_argument when
  /// there are more than B or one isn't finite.
  ShapedBody shape(const Eigen::VectorXd& betas) const;

  /// Throws std::invalid_argument unless the pose has 3·J or 72 entries (further joints then rest).
  PosedBody pose(const ShapedBody& shaped, const BodyPose& bodyPose) const;

  class Derivatives;
  /// Everything needed for derivatives at a pose; all arguments but the pose must outlive it.
  Derivatives derivatives(
      const ShapedBody& shaped, const BodyPose& bodyPose, const PosedBody& posed) const;

 private:
  struct PackedPoseBlock {
    std::vector<int> vertices;   // with a non-zero direction
    Eigen::MatrixXf directions;  // 3n × 9
  };

  /// First row of a vertex's directions in the block of a joint; −1 when it has none.
  int poseRow(int joint, int vertex) const;
  Eigen::Matrix3Xf poseOffsets(const std::vector<Eigen::Matrix3d>& localRotations) const;

  const BodyModel& model_;
  int maxInfluences_ = 0;
  std::vector<int> influenceJoints_;         // V × maxInfluences, padded with weight 0
  std::vector<double> influenceWeights_;     // V × maxInfluences
  std::vector<PackedPoseBlock> poseBlocks_;  // J − 1
};

/// Analytic derivatives of a posed body, exact at every rotation (also zero and 2π).
class Skinning::Derivatives {
 public:
  /// By pose and translation, one vertex.
  VertexDerivative ofVertex(int vertex) const;

  /// By shape, one vertex: 3 × B [m per unit].
  Eigen::Matrix3Xd ofVertexByShape(int vertex) const;

  /// Of several vertices by all parameters, columns ordered rotations (3J), translation (3), betas
  /// (B): 3n × (3J + 3 + B).
  Eigen::MatrixXd ofVertices(const std::vector<int>& vertices) const;

  /// Of all joints by all parameters: 3J × (3J + 3 + B).
  Eigen::MatrixXd ofJoints() const;

 private:
  friend class Skinning;
  struct Influence;
  Derivatives(const Skinning& skinning, const ShapedBody& shaped, const PosedBody& posed);

  std::vector<Influence> influences(int vertex) const;
  std::vector<int> activeJoints(int vertex, const std::vector<Influence>& bones) const;
  Eigen::Matrix3d blendedRotation(const std::vector<Influence>& bones) const;

  const Skinning& skinning_;
  const ShapedBody& shaped_;
  const PosedBody& posed_;
  Eigen::Matrix3Xf offsets_;                      // 3 × V: pose blend shapes, rest frame [m]
  std::vector<Eigen::Matrix3d> angularVelocity_;  // J: world, per axis-angle rate
  std::vector<Eigen::Matrix<double, 9, 3>> localRates_;  // J: ∂vec(R)/∂(axis-angle), vec row-major
  Eigen::MatrixXd restJointsByShape_;                    // 3J × B [m per unit]
  Eigen::MatrixXd jointsByShape_;                        // 3J × B, posed [m per unit]
};

/// The rotation matrix of an axis-angle vector [rad] (Rodrigues).
Eigen::Matrix3d rotationMatrix(const Eigen::Vector3d& axisAngle);

/// J_l with ∂R = [J_l ∂r]ₓ R: the left Jacobian of the rotation group, 3 × 3.
Eigen::Matrix3d leftJacobian(const Eigen::Vector3d& axisAngle);

}  // namespace avatar
