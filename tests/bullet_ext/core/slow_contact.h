#pragma once

#include "bullet_ext/core/body_contact.h"
#include "bullet_ext/core/triangle_point.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

/// The contact of body_contact.h in its plainest form: double, every vertex against every triangle
/// in every substep, pseudo-normals always.
namespace bullet_ext::test {

struct SlowPoint {
  int face = -1;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();  ///< unit, along which the distance grows
  double signedDistance = std::numeric_limits<double>::infinity();
};

/// A moving mesh at one instant.
class SlowSurface {
 public:
  SlowSurface(const Eigen::Matrix3Xi& faces, const Eigen::Matrix3Xd& vertices)
      : faces_(faces), vertices_(vertices), normals_(3, faces.cols()) {
    for (Eigen::Index f = 0; f < faces.cols(); ++f) {
      const Eigen::Matrix3d p = corners(f);
      normals_.col(f) = (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0)).normalized();
    }
  }

  /// Nearest point, of all faces or of those that face along `push` (0: all).
  SlowPoint closest(const Eigen::Vector3d& x, const Eigen::Vector3d& push) const {
    SlowPoint best;
    TrianglePoint<double> at = {Eigen::Vector3d::Zero()};
    double least = std::numeric_limits<double>::infinity();
    for (int f = 0; f < faces_.cols(); ++f) {
      const Eigen::Matrix3d p = corners(f);
      const double bound = std::max(0.0, ((p.rowwise().minCoeff() - x).maxCoeff()));
      if (bound >= least || (!push.isZero() && !(normals_.col(f).dot(push) > 0.0))) {
        continue;
      }
      const TrianglePoint<double> here = closestTrianglePoint<double>(x, p);
      const double distance = (x - p * here.barycentric).norm();
      if (distance < least) {
        least = distance;
        best.face = f;
        at = here;
      }
    }
    if (best.face >= 0) {
      const Eigen::Vector3d offset = x - corners(best.face) * at.barycentric;
      const bool inside = offset.dot(pseudoNormal(best.face, at.feature)) < 0.0;
      best.barycentric = at.barycentric;
      best.signedDistance = inside ? -least : least;
      best.outward = least > 1e-5 ? Eigen::Vector3d((inside ? -1.0 : 1.0) * offset / least)
                                  : Eigen::Vector3d(normals_.col(best.face));
    }
    return best;
  }

  /// Distance to the nearest face on the other side of x than the vector `offset` comes from.
  double distanceOpposite(const Eigen::Vector3d& x, const Eigen::Vector3d& offset) const {
    double least = std::numeric_limits<double>::infinity();
    for (int f = 0; f < faces_.cols(); ++f) {
      const Eigen::Matrix3d p = corners(f);
      const Eigen::Vector3d here = x - p * closestTrianglePoint<double>(x, p).barycentric;
      least = here.dot(offset) < 0.0 ? std::min(least, here.norm()) : least;
    }
    return least;
  }

  Eigen::Vector3d normal(int face) const { return normals_.col(face); }

 private:
  Eigen::Matrix3d corners(Eigen::Index face) const {
    Eigen::Matrix3d p;
    for (int k = 0; k < 3; ++k) {
      p.col(k) = vertices_.col(faces_(k, face));
    }
    return p;
  }

  Eigen::Vector3d pseudoNormal(int face, TriangleFeature feature) const {
    if (feature == TriangleFeature::kFace) {
      return normals_.col(face);
    }
    const bool onEdge = feature < TriangleFeature::kCorner0;
    const int first =
        static_cast<int>(onEdge ? TriangleFeature::kEdge0 : TriangleFeature::kCorner0);
    const int k = static_cast<int>(feature) - first;
    const int a = faces_(k, face);
    const int b = onEdge ? faces_((k + 1) % 3, face) : a;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int f = 0; f < faces_.cols(); ++f) {
      for (int own = 0; own < 3; ++own) {
        if (faces_(own, f) != a || !(faces_.col(f).array() == b).any()) {
          continue;
        }
        const Eigen::Matrix3d p = corners(f);
        const Eigen::Vector3d one = (p.col((own + 1) % 3) - p.col(own)).normalized();
        const Eigen::Vector3d other = (p.col((own + 2) % 3) - p.col(own)).normalized();
        const double angle = std::acos(std::clamp(one.dot(other), -1.0, 1.0));
        sum += (onEdge ? 1.0 : angle) * normals_.col(f);
      }
    }
    return sum;
  }

  const Eigen::Matrix3Xi& faces_;
  Eigen::Matrix3Xd vertices_;
  Eigen::Matrix3Xd normals_;
};

/// Positions 3 × V of a surface at a time of its frame.
inline Eigen::Matrix3Xd verticesAt(const BodySurface& surface, double time) {
  return surface.start().cast<double>() + time * surface.velocities().cast<double>();
}

class SlowContact {
 public:
  SlowContact(const ClothMesh& mesh, const BodySurface& surface, const BodyContactOptions& options)
      : mesh_(mesh), surface_(surface), options_(options) {
    pushes_.setZero(3, mesh.numVertices());
  }

  /// After the substep that ends at `time` and lasted `duration`. Returns the number of contacts.
  int resolve(ClothState& state, double time, double duration) {
    const SlowSurface now(surface_.faces(), verticesAt(surface_, time));
    int contacts = 0;
    for (Eigen::Index v = 0; v < mesh_.numVertices(); ++v) {
      if (!mesh_.isPinned(v)) {
        contacts += resolveVertex(state, v, now, duration) ? 1 : 0;
      }
    }
    return contacts;
  }

 private:
  bool resolveVertex(ClothState& state, Eigen::Index v, const SlowSurface& now, double duration) {
    const Eigen::Vector3d x = state.positions.col(v).head<3>().cast<double>();
    const Eigen::Vector3d velocity = state.velocities.col(v).head<3>().cast<double>();
    const Eigen::Vector3d push = pushes_.col(v);
    SlowPoint point = now.closest(x, Eigen::Vector3d::Zero());
    const bool inside = point.signedDistance < 0.0;
    if (inside && !push.isZero() && !(now.normal(point.face).dot(push) > 0.0)) {
      point = now.closest(x, push);
    }
    double target = options_.thickness;
    if (!inside && point.signedDistance < target) {
      const double other = now.distanceOpposite(x, point.outward);
      target = std::min(target, 0.5 * (point.signedDistance + other));
    }
    if (std::abs(point.signedDistance) > 1.1 * options_.thickness) {
      pushes_.col(v).setZero();
    }
    if (!(point.signedDistance < target)) {
      return false;
    }
    const Eigen::Vector3d n = point.outward;
    Eigen::Vector3d surfaceVelocity = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      surfaceVelocity += point.barycentric[k] *
                         surface_.velocities().col(surface_.faces()(k, point.face)).cast<double>();
    }
    const Eigen::Vector3d relative = velocity - surfaceVelocity;
    const double approach = std::max(0.0, -relative.dot(n));
    const Eigen::Vector3d sliding = relative - relative.dot(n) * n;
    const double speed = sliding.norm();
    const double stopped = speed > 0.0 ? std::min(1.0, options_.friction * approach / speed) : 0.0;
    const double lift = std::min(
        target - point.signedDistance, approach * duration + options_.recoverySpeed * duration);
    state.positions.col(v).head<3>() = (x + lift * n - duration * stopped * sliding).cast<float>();
    state.velocities.col(v).head<3>() = (velocity + approach * n - stopped * sliding).cast<float>();
    pushes_.col(v) = n;
    return true;
  }

  const ClothMesh& mesh_;
  const BodySurface& surface_;
  BodyContactOptions options_;
  Eigen::Matrix3Xd pushes_;
};

}  // namespace bullet_ext::test
