#pragma once

#include "avatar/geometry/mesh.h"
#include "avatar/geometry/plane_section.h"

#include <Eigen/Core>

#include <functional>
#include <vector>

namespace avatar {

/// Some faces of a mesh.
struct MeshPart {
  MeshView mesh;
  std::vector<int> faces;
};

/// Places along an axis: [first, last] in steps of `step` [m].
struct AxisRange {
  double first = 0.0;
  double last = 0.0;
  double step = 0.01;

  int count() const;

  double at(int slice) const { return first + step * slice; }
};

/// A signed distance, negative inside, with its direction of steepest growth.
struct FieldSample {
  double distance = 0.0;                              ///< [m], exact on the surface
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  ///< unit
};

/// A generalised cylinder: sections at right angles to a straight axis, each one convex, as cloth
/// wrapped around a limb is. A section is given by its support function h(θ) = max u·(cos θ, sin θ)
/// in evenly spaced directions; between the sections it is linear, beyond the ends constant.
class ConvexTube {
 public:
  /// `frame`: origin and normal give the axis. `support`: directions × slices [m].
  /// Throws std::invalid_argument unless the sizes fit and all values are finite.
  ConvexTube(const PlaneFrame& frame, const AxisRange& range, Eigen::MatrixXd support);

  FieldSample operator()(const Eigen::Vector3d& point) const;

  /// Where along the axis a point is [m].
  double along(const Eigen::Vector3d& point) const { return axis_.dot(point - frame_.origin); }

  /// Mean radius of the section at a place: its perimeter / 2π, which is the mean of the support
  /// function (Cauchy) [m].
  double meanRadius(double place) const;

  /// Steiner point of the section at a place [m].
  Eigen::Vector3d centre(double place) const;

  /// Every section grown by an ease [m], a function of the place along the axis.
  void loosen(const std::function<double(double)>& ease);

  /// Fabric hangs straight between the places that carry it: moves the sections between two places
  /// towards the concave envelope of each direction's profile, by a share from 0 (stays) to 1.
  void drape(double from, double to, double share);

  /// From a place on in the axis's direction, the sections are at least that place's section grown
  /// by `slope` metres per metre.
  void flare(double from, double slope);

 private:
  Eigen::VectorXd section(double place) const;

  PlaneFrame frame_;
  Eigen::Vector3d axis_;
  AxisRange range_;
  Eigen::MatrixXd support_;
  Eigen::Matrix2Xd directions_;
};

/// The convex hulls of the sections of some surfaces, open or closed. Slices that meet none of them
/// take the section of the nearest one that does. Throws std::invalid_argument when none does.
ConvexTube tubeAround(
    const std::vector<MeshPart>& parts, const PlaneFrame& frame, const AxisRange& range);

}  // namespace avatar
