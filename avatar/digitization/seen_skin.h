#pragma once

#include "avatar/digitization/outer_surface.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace avatar {

/// The part of an outer surface that is skin or hair and was seen.
class SeenSkin {
 public:
  /// Keeps a reference to the surface; one label per vertex of it.
  SeenSkin(const OuterSurface& surface, const std::vector<std::uint8_t>& labels);

  struct Match {
    bool found = false;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< [m]
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, of the face
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    bool isPure = false;    ///< no colour of cloth got into it
    double evidence = 0.0;  ///< 0 … 1: how well the place is known
  };

  /// The nearest place, unless it is farther than `reach` [m] or its normal has a smaller cosine
  /// with the given one (unit).
  Match nearest(
      const Eigen::Vector3d& point,
      const Eigen::Vector3d& normal,
      double reach,
      double minCosine) const;

 private:
  const OuterSurface& surface_;
  TriangleMesh part_;
  TriangleBvh bvh_;
  Eigen::VectorXd fromCloth_;  // of every vertex of the surface, along it [m]
  Eigen::VectorXd evidence_;   // of every vertex of the surface
};

}  // namespace avatar
