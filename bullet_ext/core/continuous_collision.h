#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstdint>
#include <optional>

/// Distances between the elements of triangle meshes, at rest and while their corners move on
/// straight lines. When two triangles meet for the first time, a vertex of one meets the other or
/// two edges meet: these two kinds of pairs are all there is.
namespace bullet_ext {

enum class PairKind : std::uint8_t {
  kVertexTriangle,  ///< x0 and the triangle x1 x2 x3
  kEdgeEdge         ///< x0 x1 and x2 x3
};

/// The four corners x0 … x3 of a pair [m].
template <typename Scalar>
using PairPoints = Eigen::Matrix<Scalar, 3, 4>;

/// Where two elements are nearest to each other:
///   Σ weights_i x_i = point of the first − point of the second = distance · normal.
/// Weights of the first element are within [0, 1] and sum to 1, those of the second within [−1, 0]
/// and sum to −1. The elements are convex, so the normal separates them: see separation().
template <typename Scalar>
struct ClosestPoints {
  Scalar distance = 0;
  Eigen::Matrix<Scalar, 3, 1> normal;  ///< unit; where the elements touch, one across both
  Eigen::Matrix<Scalar, 4, 1> weights;
};

/// Exact to rounding for any finite corners; elements may be points, segments, parallel, coplanar.
template <typename Scalar>
ClosestPoints<Scalar> closestPoints(PairKind kind, const PairPoints<Scalar>& x);

/// Smallest extent of x_first − x_second along an axis over all points of the two elements, which
/// is reached at corners. For a unit axis it is a lower bound of the distance, and for the normal
/// of closestPoints the distance itself. It is linear in the corners between the ties: elements
/// whose corners move on straight lines and that an axis separates by s in the beginning and in the
/// end are at least s apart all the time.
template <typename Scalar>
Scalar separation(
    PairKind kind, const PairPoints<Scalar>& x, const Eigen::Matrix<Scalar, 3, 1>& axis) {
  const Eigen::Matrix<Scalar, 4, 1> h = x.transpose() * axis;
  return kind == PairKind::kVertexTriangle ? h[0] - std::max({h[1], h[2], h[3]})
                                           : std::min(h[0], h[1]) - std::max(h[2], h[3]);
}

template <typename Scalar>
struct Approach {
  Scalar time = 0;  ///< within [0, 1]
  ClosestPoints<Scalar> closest;
};

/// First time t in [0, 1] at which two elements are nearer than `gap` > 0 while their corners move
/// from `start` to `end` at constant velocity. Never misses. An approach to 1.001 gap, or to more
/// than that by 1e-5 (float) or 1e-14 (double) of the extent, may be reported as well; the time is
/// never later than the true one.
///
/// Conservative advancement: at time t the elements are d apart along n. Each n·(x_i − x_j) of
/// corners of the two elements is ≥ d and linear in time, so nothing can happen before the first
/// of them falls to the gap, nor before (d − gap)/speed. No cubic has to be solved, so coplanar and
/// parallel motion is nothing special.
template <typename Scalar>
std::optional<Approach<Scalar>> firstApproach(
    PairKind kind, const PairPoints<Scalar>& start, const PairPoints<Scalar>& end, Scalar gap);

}  // namespace bullet_ext
