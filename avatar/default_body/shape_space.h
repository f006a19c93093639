#pragma once

#include "avatar/default_body/skinning_weights.h"
#include "avatar/default_body/template_mesh.h"

#include <Eigen/Core>

#include <array>
#include <string_view>

namespace avatar {

inline constexpr int kNumShapes = 10;

/// What each beta of the default body changes; one unit is about one standard deviation of adults.
inline constexpr std::array<std::string_view, kNumShapes> kShapeNames = {
    "stature",
    "mass",
    "shoulder_breadth",
    "chest",
    "waist",
    "hip",
    "leg_length",
    "arm_length",
    "muscle",
    "belly"};

/// A body of the shape space: skin and joints.
struct ShapedAnatomy {
  Eigen::Matrix3Xd vertices;  ///< 3 × V [m]
  JointPositions joints;      ///< [m]
};

/// Template, weights and everything derived from them that shaping needs.
class ShapeSpace {
 public:
  ShapeSpace(
      const SymmetricMesh& body, const SparseRowMatrix& weights, const JointPositions& joints);

  /// The body with the given betas (kNumShapes): bones change length and girth about their joints,
  /// blended by the skinning weights; fat, muscle, bust and belly move the skin along its normal.
  ShapedAnatomy shape(const Eigen::VectorXd& betas) const;

  /// 3V × kNumShapes central differences of shape() at betas = 0 [m per unit].
  Eigen::MatrixXd directions() const;

  /// The joints' central differences: 3·24 × kNumShapes [m per unit].
  Eigen::MatrixXd jointDirections() const;

 private:
  const SymmetricMesh& body_;
  const SparseRowMatrix& weights_;
  JointPositions joints_;
  Eigen::Matrix3Xd normals_;  // smoothed: offsets along them must not cross
  Eigen::MatrixXd offsets_;   // V × kNumShapes [m per unit], along the normals
};

}  // namespace avatar
