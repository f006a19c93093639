#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <vector>

namespace avatar {

/// A boundary loop of a garment and the part of the body that goes through it.
struct GarmentOpening {
  std::vector<int> loop;    ///< vertices, the surface on the left seen from outside
  std::vector<int> joints;  ///< ascending: bones that go through, by the joint at their far end
  double meanHeight = 0.0;  ///< y [m]
  double length = 0.0;      ///< [m]

  /// No bone goes through: the surface has a hole.
  bool isHole() const { return joints.empty(); }
};

/// The loops of a garment on a body whose joints (3 × J [m]) are in the same pose: a bone goes
/// through a loop when it crosses the fan over the loop from its centre. Throws
/// std::invalid_argument as boundaryLoops().
std::vector<GarmentOpening> garmentOpenings(
    const MeshView& garment, const Eigen::Matrix3Xd& joints, const std::vector<int>& parents);

/// The surface with every hole up to this length [m] closed by a fan around its centre.
struct ClosedHoles {
  TriangleMesh mesh;
  int count = 0;
};

ClosedHoles closeHoles(
    const TriangleMesh& garment, const std::vector<GarmentOpening>& openings, double maxLength);

}  // namespace avatar
