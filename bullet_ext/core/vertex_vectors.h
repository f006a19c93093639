#pragma once

#include <Eigen/Core>

namespace bullet_ext {

/// One vector per vertex, 3 × N, solver order: a plain matrix, or the upper rows of a 4 × N one as
/// in ClothState (`state.positions.topRows<3>()`).
template <typename Scalar>
using ConstVectors =
    const Eigen::Ref<const Eigen::Matrix<Scalar, 3, Eigen::Dynamic>, 0, Eigen::OuterStride<>>&;

/// The same, to be written to.
template <typename Scalar>
using Vectors = Eigen::Ref<Eigen::Matrix<Scalar, 3, Eigen::Dynamic>, 0, Eigen::OuterStride<>>;

}  // namespace bullet_ext
