#pragma once

#include "avatar/geometry/mesh.h"
#include "avatar/layered_avatar.h"

#include <Eigen/Core>

#include <vector>

namespace avatar {

/// Settings of registerSurfaces().
struct RegistrationOptions {
  int rounds = 12;               ///< of nearest points and smoothing, 1 … 100
  double firstStiffness = 30.0;  ///< of the first round; falls to lastStiffness geometrically, > 0
  double lastStiffness = 0.3;    ///< weight of |u_i − u_j|² against |u_i − d_i|², > 0
  double maxDistance = 0.15;     ///< farther points don't match [m], > 0
  double maxAngle = 60.0;        ///< between normals of a match [deg], 1 … 90

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// A body and where its joints are, both in one pose.
struct PosedBody {
  Eigen::Matrix3Xd vertices;  ///< 3 × V [m]
  Eigen::Matrix3Xd joints;    ///< 3 × J [m]
};

/// The vertices of `body` moved by linear blend skinning so that its joints come to lie on
/// `targetJoints` (3 × J [m]) in the same pose: every joint's region is moved with its joint and
/// scaled by the ratio of the joint's bones. Where a correspondence of surfaces starts from.
Eigen::Matrix3Xd movedWithJoints(
    const AvatarBody& body, const PosedBody& posed, const Eigen::Matrix3Xd& targetJoints);

/// Where each vertex of `source` (start: 3 × V [m], near the target) corresponds to on the surface
/// `target`, 3 × V [m]: nearest points with agreeing normals pull at a displacement that is smooth
/// over the source, ever less stiffly (non-rigid ICP; Allen, Curless & Popović 2003; Amberg 2007).
/// Throws std::invalid_argument on invalid options or meshes.
Eigen::Matrix3Xd registerSurfaces(
    const MeshView& start, const MeshView& target, const RegistrationOptions& options = {});

}  // namespace avatar
