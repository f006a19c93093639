#pragma once

#include "avatar/body_pose.h"
#include "avatar/default_body/primitives.h"

#include <array>
#include <cmath>
#include <vector>

namespace avatar {

enum class FieldOperation { kUnion, kSubtract, kIntersect };

/// One anatomical primitive and how it joins what stands before it in its group.
struct FieldElement {
  Primitive primitive;
  int bone = kPelvis;         ///< moves rigidly with this SMPL joint
  double blendRadius = 0.02;  ///< width of the rounded crease [m]
  FieldOperation operation = FieldOperation::kUnion;
};

/// Elements blended in order, then blended as a whole with the groups before it.
struct FieldGroup {
  std::vector<FieldElement> elements;
  double blendRadius = 0.03;  ///< towards the groups before [m]
  /// Whether the group stands on both sides (arms, legs: given for the left, mirrored in x = 0) or
  /// once on the midline (its off-centre elements are then mirrored one by one).
  bool isPaired = false;
  Eigen::Vector3d boundCenter = Eigen::Vector3d::Zero();  ///< sphere around the group at rest [m]
  double boundRadius = 0.0;
};

using JointPositions = std::array<Eigen::Vector3d, kNumSmplJoints>;
using BoneTransforms = std::array<Eigen::Isometry3d, kNumSmplJoints>;

/// The anatomy as a smooth signed distance in the default body's template frame (T-pose, Y up,
/// facing +Z, pelvis joint at the origin, metres), symmetric in x at rest.
class BodyField {
 public:
  BodyField(std::vector<FieldGroup> groups, const JointPositions& joints);

  const JointPositions& joints() const { return joints_; }

  /// Signed distance at rest, negative inside, to first order near the surface [m].
  double distance(const Eigen::Vector3d& point) const;
  /// The same with the bones of the left side and the midline moved; the right side stays at rest.
  double distance(const Eigen::Vector3d& point, const BoneTransforms& restFromPosed) const;
  /// The bone of the primitive that shapes the surface here (left side and midline, x ≥ 0).
  int dominantBone(const Eigen::Vector3d& point) const;

 private:
  double sideDistance(
      const FieldGroup& group,
      const Eigen::Vector3d& point,
      const BoneTransforms* restFromPosed) const;
  double evaluate(const Eigen::Vector3d& point, const BoneTransforms* restFromPosed) const;

  std::vector<FieldGroup> groups_;
  JointPositions joints_;
};

/// Central-difference gradient of a scalar field.
template <typename Field>
Eigen::Vector3d numericGradient(const Field& field, const Eigen::Vector3d& point) {
  constexpr double kStep = 1e-5;  // [m], far below the smallest feature and far above rounding
  Eigen::Vector3d result;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d offset = kStep * Eigen::Vector3d::Unit(axis);
    result[axis] = (field(point + offset) - field(point - offset)) / (2.0 * kStep);
  }
  return result;
}

/// Moves a point onto the zero set by Newton steps along the gradient, each at most 1 cm.
template <typename Field>
Eigen::Vector3d projectOntoZeroSet(const Field& field, Eigen::Vector3d point) {
  constexpr int kMaxSteps = 8;
  constexpr double kTolerance = 1e-7;  // [m]
  constexpr double kLongestStep = 0.01;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double value = field(point);
    if (std::abs(value) < kTolerance)
      break;
    const Eigen::Vector3d slope = numericGradient(field, point);
    const double squared = slope.squaredNorm();
    if (squared < 1e-6)
      break;
    Eigen::Vector3d move = -value / squared * slope;
    if (move.norm() > kLongestStep)
      move *= kLongestStep / move.norm();
    point += move;
  }
  return point;
}

}  // namespace avatar
