#pragma once

#include "avatar/geometry/closest_point.h"
#include "avatar/wardrobe/dressing_body.h"

#include <Eigen/Core>

#include <array>

namespace avatar {

/// The room between the legs of a standing body, where thighs are apart.
class BetweenLegs {
 public:
  explicit BetweenLegs(const DressingBody& body);

  /// Is the nearest skin of one leg on the other side than that of the other?
  bool contains(const Eigen::Vector3d& point) const;

 private:
  std::array<TriangleBvh, 2> legs_;
};

}  // namespace avatar
