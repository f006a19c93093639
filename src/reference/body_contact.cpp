#include "src/reference/body_contact.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace reference {
namespace {

using Eigen::Vector3d;

struct Triangle {
  std::array<Vector3d, 3> corners;

  Vector3d normal() const {
    return (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  }

  double angle(std::size_t corner) const {
    const Vector3d a = corners[(corner + 1) % 3] - corners[corner];
    const Vector3d b = corners[(corner + 2) % 3] - corners[corner];
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }
};

/// Barycentric coordinates of the point of a segment that is nearest to x, as (1 − t, t).
Eigen::Vector2d nearestOnSegment(const Vector3d& a, const Vector3d& b, const Vector3d& x) {
  const double t = std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return {1.0 - t, t};
}

/// Barycentric coordinates of the foot of the perpendicular from x on the triangle's plane.
Vector3d footInPlane(const Triangle& triangle, const Vector3d& x) {
  const auto& [a, b, c] = triangle.corners;
  const Vector3d twiceArea = (b - a).cross(c - a);
  const auto share = [&](const Vector3d& from, const Vector3d& to) {
    return (to - from).cross(x - from).dot(twiceArea) / twiceArea.squaredNorm();
  };
  return {share(b, c), share(c, a), share(a, b)};
}

Vector3d pointAt(const Triangle& triangle, const Vector3d& barycentric) {
  return barycentric[0] * triangle.corners[0] + barycentric[1] * triangle.corners[1] +
         barycentric[2] * triangle.corners[2];
}

/// Inside the triangle the foot itself, otherwise the nearest point of its three sides.
Vector3d nearestBarycentric(const Triangle& triangle, const Vector3d& x) {
  Vector3d best = footInPlane(triangle, x);
  if (best.minCoeff() >= 0.0) {
    return best;
  }
  double least = std::numeric_limits<double>::infinity();
  for (int side = 0; side < 3; ++side) {
    const int next = (side + 1) % 3;
    const Eigen::Vector2d t = nearestOnSegment(
        triangle.corners[static_cast<std::size_t>(side)],
        triangle.corners[static_cast<std::size_t>(next)],
        x);
    Vector3d candidate = Vector3d::Zero();
    candidate[side] = t[0];
    candidate[next] = t[1];
    const double distance = (pointAt(triangle, candidate) - x).squaredNorm();
    if (distance < least) {
      least = distance;
      best = candidate;
    }
  }
  return best;
}

/// How much of the full turn around a surface point belongs to this triangle: all of it in its
/// inside, half at a side, its angle at a corner. The normals of all triangles at the point,
/// weighted by it, have the sign of inside and outside (Bærentzen and Aanæs 2005).
double angleAround(const Triangle& triangle, const Vector3d& barycentric) {
  constexpr double kOnSide = 1e-9;
  for (int corner = 0; corner < 3; ++corner) {
    if (barycentric[corner] >= 1.0 - kOnSide) {
      return triangle.angle(static_cast<std::size_t>(corner));
    }
  }
  return barycentric.minCoeff() <= kOnSide ? std::numbers::pi : 2.0 * std::numbers::pi;
}

Triangle triangleAt(const MovingBody& body, double phase, Eigen::Index face) {
  Triangle triangle;
  for (std::size_t k = 0; k < 3; ++k) {
    const int v = body.faces(static_cast<Eigen::Index>(k), face);
    triangle.corners[k] = (1.0 - phase) * body.start.col(v) + phase * body.end.col(v);
  }
  return triangle;
}

Vector3d velocityAt(const MovingBody& body, Eigen::Index face, const Vector3d& barycentric) {
  Vector3d way = Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int v = body.faces(k, face);
    way += barycentric[k] * (body.end.col(v) - body.start.col(v));
  }
  return way / body.duration;
}

}  // namespace

SurfacePoint nearestSurfacePoint(const MovingBody& body, double phase, const Vector3d& x) {
  constexpr double kSame = 1e-12;  // [m], rounding at an edge or vertex of several triangles
  SurfacePoint result;
  Vector3d pseudoNormal = Vector3d::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < body.faces.cols(); ++f) {
    const Triangle triangle = triangleAt(body, phase, f);
    const Vector3d barycentric = nearestBarycentric(triangle, x);
    const Vector3d point = pointAt(triangle, barycentric);
    const double distance = (x - point).norm();
    if (distance > least + kSame) {
      continue;
    }
    if (distance < least - kSame) {
      pseudoNormal.setZero();
      result.position = point;
      result.velocity = velocityAt(body, f, barycentric);
    }
    least = std::min(least, distance);
    pseudoNormal += angleAround(triangle, barycentric) * triangle.normal();
  }
  const double sign = pseudoNormal.dot(x - result.position) < 0.0 ? -1.0 : 1.0;
  result.signedDistance = sign * least;
  // On the surface itself the direction from the nearest point has no meaning.
  constexpr double kOnSurface = 1e-9;
  result.normal = least > kOnSurface ? Vector3d(sign / least * (x - result.position))
                                     : pseudoNormal.normalized();
  return result;
}

void collide(Cloth& cloth, const MovingBody& body, double phase, const ContactOptions& options) {
  for (Vertex& vertex : cloth.vertices) {
    const SurfacePoint surface = nearestSurfacePoint(body, phase, vertex.position);
    if (vertex.pinned || surface.signedDistance >= options.thickness) {
      continue;
    }
    const Vector3d relative = vertex.velocity - surface.velocity;
    const double approach = std::max(0.0, -relative.dot(surface.normal));
    const double leaving = std::max(0.0, relative.dot(surface.normal));
    const Vector3d sliding = relative - relative.dot(surface.normal) * surface.normal;
    // Coulomb: the tangential impulse is at most friction times the normal one.
    const double speed = sliding.norm();
    const double lost = speed > 0.0 ? std::min(1.0, options.friction * approach / speed) : 0.0;
    vertex.velocity = surface.velocity + leaving * surface.normal + (1.0 - lost) * sliding;
    vertex.position =
        surface.position + options.thickness * surface.normal - options.duration * lost * sliding;
  }
}

}  // namespace reference
