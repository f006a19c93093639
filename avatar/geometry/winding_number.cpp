#include "avatar/geometry/winding_number.h"

#include "avatar/geometry/measures.h"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <numbers>

namespace avatar {

double windingNumber(const MeshView& mesh, const Eigen::Vector3d& point) {
  double halfAngles = 0.0;
  for (Eigen::Index face = 0; face < mesh.faces.cols(); ++face) {
    const Eigen::Vector3d a = mesh.vertices.col(mesh.faces(0, face)) - point;
    const Eigen::Vector3d b = mesh.vertices.col(mesh.faces(1, face)) - point;
    const Eigen::Vector3d c = mesh.vertices.col(mesh.faces(2, face)) - point;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    halfAngles +=
        std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return halfAngles / (2.0 * std::numbers::pi);
}

int rayWindingNumber(
    const MeshView& mesh,
    const TriangleBvh& bvh,
    const Eigen::Vector3d& point,
    const Eigen::Vector3d& direction) {
  int number = 0;
  Ray ray{.origin = point, .direction = direction};
  for (RayHit hit = bvh.firstHit(ray); hit.face >= 0; hit = bvh.firstHit(ray)) {
    number += doubleAreaVector(mesh, hit.face).dot(direction) > 0.0 ? 1 : -1;
    ray.tMin = std::nextafter(hit.t, std::numeric_limits<double>::infinity());
  }
  return number;
}

}  // namespace avatar
