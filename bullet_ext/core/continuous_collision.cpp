#include "bullet_ext/core/continuous_collision.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace bullet_ext {
namespace {

template <typename Scalar>
using Vector3 = Eigen::Matrix<Scalar, 3, 1>;

template <typename Scalar>
using Vector4 = Eigen::Matrix<Scalar, 4, 1>;

/// The nearest of some choices of points. Every choice names a point of each element, so a choice
/// spoilt by rounding is at worst not the nearest one.
template <typename Scalar>
class Nearest {
 public:
  /// Around x0, so that rounding is relative to the pair's extent and not to its place.
  explicit Nearest(const PairPoints<Scalar>& x) : x_(x.colwise() - x.col(0).eval()) {}

  const PairPoints<Scalar>& corners() const { return x_; }

  /// Corner p against the segment from a to b; the sign is that of the corner's element.
  void offerPointSegment(int p, int a, int b, Scalar sign) {
    const Vector3<Scalar> edge = x_.col(b) - x_.col(a);
    const Vector3<Scalar> arm = x_.col(p) - x_.col(a);
    const Scalar length2 = edge.squaredNorm();
    const Scalar along = edge.dot(arm);
    const Scalar s = along > 0 ? (along < length2 ? along / length2 : Scalar(1)) : Scalar(0);
    const Vector3<Scalar> difference = arm - s * edge;
    const Scalar squared = difference.squaredNorm();
    if (squared < squared_) {
      squared_ = squared;
      difference_ = sign * difference;
      segment_ = {p, a, b, sign, s};
    }
  }

  /// A choice inside of both elements wins against those on their borders that are nearer by no
  /// more than rounding: the normal would depend on which of the two it is.
  void offerInside(const Vector4<Scalar>& weights) {
    const Vector3<Scalar> difference = x_ * weights;
    const Scalar squared = difference.squaredNorm();
    if (squared < (1 + 64 * std::numeric_limits<Scalar>::epsilon()) * squared_) {
      squared_ = squared;
      difference_ = difference;
      segment_.corner = -1;
      insideWeights_ = weights;
    }
  }

  /// `across` is the direction to name when the elements touch.
  ClosestPoints<Scalar> result(const Vector3<Scalar>& across) const {
    ClosestPoints<Scalar> closest = {std::sqrt(squared_), difference_, weights()};
    if (closest.distance > 0) {
      closest.normal /= closest.distance;
    } else {
      const Scalar length = across.norm();
      closest.normal = length > 0 ? Vector3<Scalar>(across / length) : Vector3<Scalar>::UnitX();
    }
    return closest;
  }

 private:
  struct PointSegment {
    int corner = -1, a = 0, b = 0;
    Scalar sign = 1, s = 0;
  };

  Vector4<Scalar> weights() const {
    if (segment_.corner < 0) {
      return insideWeights_;
    }
    Vector4<Scalar> weights = Vector4<Scalar>::Zero();
    weights[segment_.corner] = segment_.sign;
    weights[segment_.a] = -segment_.sign * (1 - segment_.s);
    weights[segment_.b] = -segment_.sign * segment_.s;
    return weights;
  }

  PairPoints<Scalar> x_;
  Scalar squared_ = std::numeric_limits<Scalar>::infinity();
  Vector3<Scalar> difference_ = Vector3<Scalar>::Zero();
  PointSegment segment_;
  Vector4<Scalar> insideWeights_ = Vector4<Scalar>::Zero();
};

template <typename Scalar>
ClosestPoints<Scalar> closestVertexTriangle(const PairPoints<Scalar>& corners) {
  Nearest<Scalar> nearest(corners);
  const PairPoints<Scalar>& x = nearest.corners();
  nearest.offerPointSegment(0, 1, 2, 1);
  nearest.offerPointSegment(0, 2, 3, 1);
  nearest.offerPointSegment(0, 3, 1, 1);
  const Vector3<Scalar> a = x.col(1);
  const Vector3<Scalar> b = x.col(2);
  const Vector3<Scalar> c = x.col(3);
  const Vector3<Scalar> normal = (b - a).cross(c - a);
  const Vector3<Scalar> areas(
      normal.dot(b.cross(c)), normal.dot(c.cross(a)), normal.dot(a.cross(b)));
  const Scalar sum = areas.sum();
  if (areas.minCoeff() > 0 && sum > 0) {
    nearest.offerInside({1, -areas[0] / sum, -areas[1] / sum, -areas[2] / sum});
  }
  return nearest.result(normal);
}

template <typename Scalar>
ClosestPoints<Scalar> closestEdges(const PairPoints<Scalar>& corners) {
  Nearest<Scalar> nearest(corners);
  const PairPoints<Scalar>& x = nearest.corners();
  nearest.offerPointSegment(0, 2, 3, 1);
  nearest.offerPointSegment(1, 2, 3, 1);
  nearest.offerPointSegment(2, 0, 1, -1);
  nearest.offerPointSegment(3, 0, 1, -1);
  const Vector3<Scalar> e = x.col(1);
  const Vector3<Scalar> f = x.col(3) - x.col(2);
  const Vector3<Scalar> across = e.cross(f);
  // x0 + s e and x2 + t f differ by a multiple of e × f.
  const Vector3<Scalar> g = x.col(2);
  const Scalar norm2 = across.squaredNorm();
  const Scalar s = g.cross(f).dot(across);
  const Scalar t = g.cross(e).dot(across);
  if (s > 0 && s < norm2 && t > 0 && t < norm2) {
    nearest.offerInside({1 - s / norm2, s / norm2, -(1 - t / norm2), -t / norm2});
  }
  return nearest.result(across);
}

/// x_first − x_second for all corners of the two elements; the last one is a copy for a vertex.
template <typename Scalar>
Eigen::Matrix<Scalar, 3, 4> cornerDifferences(PairKind kind, const PairPoints<Scalar>& x) {
  Eigen::Matrix<Scalar, 3, 4> differences;
  if (kind == PairKind::kVertexTriangle) {
    differences << x.col(0) - x.col(1), x.col(0) - x.col(2), x.col(0) - x.col(3),
        x.col(0) - x.col(3);
  } else {
    differences << x.col(0) - x.col(2), x.col(0) - x.col(3), x.col(1) - x.col(2),
        x.col(1) - x.col(3);
  }
  return differences;
}

/// How much time may pass before any of the extents falls to the gap; infinite if none ever does.
template <typename Scalar>
Scalar safeDuration(const Vector4<Scalar>& extents, const Vector4<Scalar>& rates, Scalar gap) {
  Scalar duration = std::numeric_limits<Scalar>::infinity();
  for (int k = 0; k < 4; ++k) {
    if (rates[k] < 0) {
      duration = std::min(duration, (extents[k] - gap) / -rates[k]);
    }
  }
  return duration;
}

}  // namespace

template <typename Scalar>
ClosestPoints<Scalar> closestPoints(PairKind kind, const PairPoints<Scalar>& x) {
  return kind == PairKind::kVertexTriangle ? closestVertexTriangle(x) : closestEdges(x);
}

template <typename Scalar>
std::optional<Approach<Scalar>> firstApproach(
    PairKind kind, const PairPoints<Scalar>& start, const PairPoints<Scalar>& end, Scalar gap) {
  // Around x0, so that rounding is relative to the pair's extent and not to its place.
  const PairPoints<Scalar> local = start.colwise() - start.col(0).eval();
  const PairPoints<Scalar> path = end - start;
  const PairPoints<Scalar> motion = path.colwise() - path.col(0).eval();
  const Eigen::Matrix<Scalar, 3, 4> rates = cornerDifferences(kind, motion);
  const Scalar speed = rates.colwise().norm().maxCoeff();
  const Scalar extent = local.cwiseAbs().maxCoeff() + motion.cwiseAbs().maxCoeff();
  const Scalar reached = gap * Scalar(1.001) + 32 * std::numeric_limits<Scalar>::epsilon() * extent;
  constexpr int kMostSteps = 500;  // then the pair counts as approached: early, but safe
  Scalar time = 0;
  for (int step = 0;; ++step) {
    const PairPoints<Scalar> x = local + time * motion;
    const ClosestPoints<Scalar> closest = closestPoints(kind, x);
    if (!(closest.distance > reached) || step == kMostSteps) {
      return Approach<Scalar>{time, closest};
    }
    const Vector4<Scalar> extents = cornerDifferences(kind, x).transpose() * closest.normal;
    const Vector4<Scalar> changes = rates.transpose() * closest.normal;
    const Scalar bySpeed = speed > 0 ? (closest.distance - gap) / speed : Scalar(2);
    time += std::max(bySpeed, safeDuration(extents, changes, gap));
    if (!(time <= 1)) {
      return std::nullopt;
    }
  }
}

template ClosestPoints<float> closestPoints(PairKind, const PairPoints<float>&);
template ClosestPoints<double> closestPoints(PairKind, const PairPoints<double>&);
template std::optional<Approach<float>> firstApproach(
    PairKind, const PairPoints<float>&, const PairPoints<float>&, float);
template std::optional<Approach<double>> firstApproach(
    PairKind, const PairPoints<double>&, const PairPoints<double>&, double);

}  // namespace bullet_ext
