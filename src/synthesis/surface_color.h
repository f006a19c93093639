#pragma once

#include "avatar/body_model.h"
#include "avatar/skinning.h"

#include <Eigen/Core>

#include <cstdint>

namespace simulcap {

/// A pattern in space that a surface cuts through, so that it needs no texture coordinates: cloth
/// and furniture keep it by their rest shape.
struct SolidPattern {
  enum class Kind { kPlain, kStripes, kChecks, kDots, kSpeckles };

  Kind kind = Kind::kPlain;
  Eigen::Vector3d first = {0.7, 0.7, 0.7};   ///< display values in [0, 1]
  Eigen::Vector3d second = {0.4, 0.4, 0.4};  ///< display values in [0, 1]
  double period = 0.08;                      ///< [m], > 0
  std::uint32_t seed = 0;

  /// Display values at a point [m].
  Eigen::Vector3d at(const Eigen::Vector3d& point) const;
};

/// A pattern for the `index`-th of the things that have one seed.
SolidPattern clothPattern(std::uint32_t seed, std::uint32_t index);

/// 3 × V display values of a person: a skin tone, hair, shoes.
Eigen::Matrix3Xd bodyColors(
    const avatar::BodyModel& model, const avatar::ShapedBody& shaped, std::uint32_t seed);

}  // namespace simulcap
