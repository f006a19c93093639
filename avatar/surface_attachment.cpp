#include "avatar/surface_attachment.h"

#include "avatar/geometry/closest_point.h"

#include <Eigen/Geometry>

#include <stdexcept>

namespace avatar {
namespace {

Eigen::Matrix3d corners(const MeshView& surface, int face) {
  return surface.vertices(Eigen::all, surface.faces.col(face));
}

/// Orthonormal axes that turn with the face: along its first edge, and its normal.
Eigen::Matrix3d faceFrame(const Eigen::Matrix3d& corners) {
  const Eigen::Vector3d edge = corners.col(1) - corners.col(0);
  const Eigen::Vector3d normal = edge.cross(corners.col(2) - corners.col(0));
  Eigen::Matrix3d frame;
  frame.col(0) = edge.normalized();
  frame.col(2) = normal.normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

}  // namespace

SurfaceAttachment::SurfaceAttachment(const Eigen::Matrix3Xd& points, const MeshView& surface) {
  if (surface.numFaces() == 0)
    throw std::invalid_argument("surface attachment: the surface has no faces");
  const TriangleBvh bvh(surface);
  anchors_.reserve(static_cast<std::size_t>(points.cols()));
  for (const auto& point : points.colwise()) {
    const ClosestPoint nearest = bvh.closestPoint(point);
    const Eigen::Matrix3d frame = faceFrame(corners(surface, nearest.face));
    anchors_.push_back(
        {nearest.face, nearest.weights, frame.transpose() * (point - nearest.point)});
  }
}

Eigen::Matrix3Xd SurfaceAttachment::points(const MeshView& surface) const {
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(anchors_.size()));
  for (std::size_t i = 0; i < anchors_.size(); ++i) {
    const Anchor& anchor = anchors_[i];
    const Eigen::Matrix3d at = corners(surface, anchor.face);
    result.col(static_cast<Eigen::Index>(i)) = at * anchor.weights + faceFrame(at) * anchor.offset;
  }
  return result;
}

}  // namespace avatar
