#pragma once

#include "avatar/skinning.h"

#include <Eigen/Core>

#include <utility>
#include <vector>

namespace avatar {

/// Where the parameters of a body stand in a vector: 3J joint rotations (axis-angle, in the order
/// of the joints), 3 of the translation, B betas.
struct BodyParameterLayout {
  int numJoints = 0;
  int numBetas = 0;

  static int joint(int index) { return 3 * index; }

  int translation() const { return 3 * numJoints; }

  int betas() const { return 3 * numJoints + 3; }

  int size() const { return 3 * numJoints + 3 + numBetas; }
};

/// Gauss–Newton's equations JᵀJ x = −Jᵀr, gathered row by row.
struct NormalEquations {
  explicit NormalEquations(Eigen::Index size)
      : matrix(Eigen::MatrixXd::Zero(size, size)), gradient(Eigen::VectorXd::Zero(size)) {}

  /// Adds weight · (residual + row · x)². `active` (ascending) names the entries of `row` that may
  /// be other than 0.
  void add(
      const std::vector<int>& active, const Eigen::VectorXd& row, double residual, double weight);

  Eigen::MatrixXd matrix;  ///< only the lower triangle is filled
  Eigen::VectorXd gradient;
  double weightedSquares = 0;  ///< Σ weight · residual²
};

/// A body at one shape and pose with what its derivative needs there.
struct BodyLinearization {
  SkinnedBody body;
  Eigen::Matrix3Xd restJoints;  ///< 3 × J [m]
  /// J entries: column c is the world's angular velocity of the joint's subtree per unit of θ_c.
  std::vector<Eigen::Matrix3d> angularVelocities;
  /// J entries: ∂vec(R)/∂θ, rows in the order of the pose blend shapes.
  std::vector<Eigen::Matrix<double, 9, 3>> rotationDerivatives;
  std::vector<Eigen::Matrix3Xd> jointShapeDerivatives;  ///< J entries: ∂g_k/∂β, 3 × B
  std::vector<Eigen::Matrix3Xd> shapeOffsets;  ///< J entries: ∂g_k/∂β − R_k ∂J_k/∂β, 3 × B
};

/// The exact derivative of Skinning::pose() with respect to rotations, translation and betas,
/// including pose blend shapes and the joints' dependence on shape. Exact for every rotation
/// vector, also at 0 and about 2π. Keeps a reference to the skinning. Const functions may run in
/// parallel.
class SkinningJacobian {
 public:
  explicit SkinningJacobian(const Skinning& skinning);

  BodyParameterLayout layout() const { return layout_; }

  /// Throws as Skinning::pose().
  BodyLinearization linearize(const ShapedBody& shaped, const BodyPose& pose) const;

  /// Adds nᵀ ∂v/∂(parameters) of one vertex to `row` (layout().size()); entries that are not among
  /// the vertex's active parameters stay as they are.
  void addVertexRow(
      const BodyLinearization& at,
      int vertex,
      const Eigen::Vector3d& direction,
      Eigen::VectorXd& row) const;

  /// Parameters, ascending, that can move any of these vertices: joints that carry it, their
  /// ancestors, joints whose pose blend shapes reach it, translation, betas.
  std::vector<int> activeParameters(const std::vector<int>& vertices) const;

  /// ∂v/∂(parameters) of the chosen vertices, 3n × layout().size(), three rows per vertex.
  Eigen::MatrixXd vertices(const BodyLinearization& at, const std::vector<int>& chosen) const;

  /// The same for all vertices, 3V × layout().size().
  Eigen::MatrixXd allVertices(const BodyLinearization& at) const;

  /// ∂(joint position)/∂(parameters), 3J × layout().size().
  Eigen::MatrixXd joints(const BodyLinearization& at) const;

 private:
  struct BlendRow {
    int shape = 0;  // index into Skinning::poseBlendShapes()
    int row = 0;    // the vertex's first row of its directions
  };

  void addPoseBlendShapes(
      const BodyLinearization& at,
      int vertex,
      const Eigen::Vector3d& restDirection,
      Eigen::VectorXd& row) const;

  const Skinning& skinning_;
  BodyParameterLayout layout_;
  std::vector<Eigen::Matrix3Xd> restJointShapeDerivatives_;  // J entries: ∂J_k/∂β, 3 × B
  std::vector<std::vector<int>> activeJoints_;               // V rows, ascending
  std::vector<std::vector<BlendRow>> blendRows_;             // V rows
};

/// A point of the surface (barycentric weights on three vertices) and the plane it should lie in.
struct PlaneConstraint {
  Eigen::Vector3i vertices;
  Eigen::Vector3d weights;  ///< sum 1
  Eigen::Vector3d normal;   ///< unit length
  double offset = 0.0;      ///< the plane is normal · x = offset [m]
  double weight = 1.0;      ///< of the squared distance
};

/// Adds weight · (nᵀ(Σ bᵢ vᵢ) − offset)², linearized; returns the residual [m].
double addPlaneConstraint(
    const SkinningJacobian& jacobian,
    const BodyLinearization& at,
    const PlaneConstraint& constraint,
    NormalEquations& equations);

}  // namespace avatar
