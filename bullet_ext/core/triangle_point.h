#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstdint>

namespace bullet_ext {

/// Which part of a triangle: its inside, an edge from corner k to k + 1, or a corner.
enum class TriangleFeature : std::uint8_t {
  kFace,
  kEdge0,
  kEdge1,
  kEdge2,
  kCorner0,
  kCorner1,
  kCorner2
};

template <typename Scalar>
struct TrianglePoint {
  Eigen::Matrix<Scalar, 3, 1> barycentric;  ///< of the corners, sum 1
  TriangleFeature feature = TriangleFeature::kFace;
};

/// The point of a triangle (corners in columns) nearest to `point`: Ericson, Real-Time Collision
/// Detection, 5.1.5. Triangles without area are points or segments.
template <typename Scalar>
TrianglePoint<Scalar> closestTrianglePoint(
    const Eigen::Matrix<Scalar, 3, 1>& point, const Eigen::Matrix<Scalar, 3, 3>& corners) {
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  const Vector ab = corners.col(1) - corners.col(0);
  const Vector ac = corners.col(2) - corners.col(0);
  const auto along = [&](int corner) {
    const Vector offset = point - corners.col(corner);
    return Eigen::Matrix<Scalar, 2, 1>(ab.dot(offset), ac.dot(offset));
  };
  const auto a = along(0);
  if (a[0] <= 0 && a[1] <= 0) {
    return {Vector::UnitX(), TriangleFeature::kCorner0};
  }
  const auto b = along(1);
  if (b[0] >= 0 && b[1] <= b[0]) {
    return {Vector::UnitY(), TriangleFeature::kCorner1};
  }
  const Scalar vc = a[0] * b[1] - b[0] * a[1];
  if (vc <= 0 && a[0] >= 0 && b[0] <= 0) {
    const Scalar t = a[0] / (a[0] - b[0]);
    return {{1 - t, t, 0}, TriangleFeature::kEdge0};
  }
  const auto c = along(2);
  if (c[1] >= 0 && c[0] <= c[1]) {
    return {Vector::UnitZ(), TriangleFeature::kCorner2};
  }
  const Scalar vb = c[0] * a[1] - a[0] * c[1];
  if (vb <= 0 && a[1] >= 0 && c[1] <= 0) {
    const Scalar t = a[1] / (a[1] - c[1]);
    return {{1 - t, 0, t}, TriangleFeature::kEdge2};
  }
  const Scalar va = b[0] * c[1] - c[0] * b[1];
  const Scalar toC = b[1] - b[0];
  const Scalar toB = c[0] - c[1];
  if (va <= 0 && toC >= 0 && toB >= 0) {
    const Scalar t = toC / (toC + toB);
    return {{0, 1 - t, t}, TriangleFeature::kEdge1};
  }
  const Vector weights(va, vb, vc);
  return {weights / weights.sum(), TriangleFeature::kFace};
}

}  // namespace bullet_ext
