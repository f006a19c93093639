#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <vector>

namespace avatar {

/// Points that ride on a deforming surface, as a waistband does on the skin: each keeps its place
/// in the frame of the face that was nearest when it was attached.
class SurfaceAttachment {
 public:
  SurfaceAttachment() = default;

  /// 3 × N points [m], anywhere near the surface. Throws std::invalid_argument on an invalid mesh
  /// or one without faces.
  SurfaceAttachment(const Eigen::Matrix3Xd& points, const MeshView& surface);

  /// Where the points are when the surface has moved; same faces. 3 × N [m].
  Eigen::Matrix3Xd points(const MeshView& surface) const;

 private:
  struct Anchor {
    int face = 0;
    Eigen::Vector3d weights;  // barycentric, of the nearest point of the surface
    Eigen::Vector3d offset;   // from there, in the face's frame [m]
  };

  std::vector<Anchor> anchors_;
};

}  // namespace avatar
