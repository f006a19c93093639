#pragma once

#include <Eigen/Geometry>

#include <variant>
#include <vector>

namespace avatar {

/// Sphere swept from a to b with linearly changing radius; exact distance.
struct RoundCone {
  Eigen::Vector3d a, b;  ///< [m]
  double radiusA = 0.0;  ///< [m]
  double radiusB = 0.0;  ///< [m]
};

/// Ellipsoid; first-order distance.
struct Ellipsoid {
  Eigen::Vector3d center;  ///< [m]
  Eigen::Vector3d radii;   ///< [m] along the columns of `axes`
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

/// One cross-section of a Loft: a superellipse whose four half-axes may differ.
struct LoftSection {
  double position = 0.0;             ///< along the axis, from the loft's origin [m]
  double uPlus = 0.0, uMinus = 0.0;  ///< half-axes along +u and −u [m]
  double vPlus = 0.0, vMinus = 0.0;  ///< half-axes along +v and −v [m]
  double uCenter = 0.0;              ///< offset of the section's centre along u [m]
  double vCenter = 0.0;              ///< and along v [m]
};

/// A generalised cylinder: sections along a straight axis, interpolated by monotone cubics, closed
/// by ellipsoidal caps. First-order distance.
struct Loft {
  Eigen::Vector3d origin;
  Eigen::Matrix3d axes;               ///< columns u, v, axis
  std::vector<LoftSection> sections;  ///< at least two, positions ascending
  double startCap = 0.02;             ///< length of the cap before the first section [m]
  double endCap = 0.02;               ///< length of the cap after the last section [m]
  double exponent = 2.0;              ///< of the superellipse: 2 is an ellipse, larger is boxier
};

/// Half-space below `offset` along `normal`: the flat sole of a foot.
struct HalfSpace {
  Eigen::Vector3d normal;
  double offset = 0.0;
};

using Primitive = std::variant<RoundCone, Ellipsoid, Loft, HalfSpace>;

/// Signed distance (negative inside) to a primitive: exact or first order, see each type [m].
double signedDistance(const Primitive& primitive, const Eigen::Vector3d& point);

/// C¹ minimum of two distances that rounds the crease over a width `radius` [m] (Quilez's quadratic
/// polynomial); radius 0 is the plain minimum.
double smoothMin(double a, double b, double radius);

}  // namespace avatar
