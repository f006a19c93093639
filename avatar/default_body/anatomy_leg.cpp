#include "avatar/default_body/anatomy.h"

namespace avatar {
namespace {

// A loft from joint to joint: u lateral (+x), v to the front.
Loft alongLeg(
    const Eigen::Vector3d& from, const Eigen::Vector3d& to, std::vector<LoftSection> sections) {
  Loft loft;
  loft.origin = from;
  loft.axes.col(2) = (to - from).normalized();
  loft.axes.col(1) =
      (Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ().dot(loft.axes.col(2)) * loft.axes.col(2))
          .normalized();
  loft.axes.col(0) = loft.axes.col(2).cross(loft.axes.col(1)) * -1.0;
  loft.sections = std::move(sections);
  return loft;
}

// The foot lies along +z, turned out a little: u lateral, v up from the sole.
Loft footLoft() {
  // position along the foot, lateral and medial half-width, height of the instep [m]
  constexpr double kSections[][4] = {
      {0.012, 0.026, 0.026, 0.056},
      {0.038, 0.030, 0.030, 0.078},
      {0.070, 0.032, 0.033, 0.088},
      {0.110, 0.036, 0.034, 0.074},
      {0.150, 0.043, 0.040, 0.055},
      {0.182, 0.046, 0.046, 0.041},
      {0.205, 0.043, 0.046, 0.032}};
  const Eigen::AngleAxisd toeOut(0.10, Eigen::Vector3d::UnitY());
  Loft loft;
  loft.origin = {0.098, kSoleHeight, -0.060};
  loft.axes.col(0) = toeOut * Eigen::Vector3d::UnitX();
  loft.axes.col(1) = Eigen::Vector3d::UnitY();
  loft.axes.col(2) = toeOut * Eigen::Vector3d::UnitZ();
  for (const auto& s : kSections) {
    loft.sections.push_back({s[0], s[1], s[2], 0.60 * s[3], 0.48 * s[3], 0.0, 0.40 * s[3]});
  }
  loft.startCap = 0.018;
  loft.endCap = 0.012;
  loft.exponent = 2.3;
  return loft;
}

}  // namespace

FieldGroup makeLeg() {
  const Eigen::Vector3d hip(0.086, -0.020, 0.0);
  const Eigen::Vector3d knee(0.094, -0.440, 0.0);
  const Eigen::Vector3d ankle(0.099, -0.830, -0.014);
  FieldGroup group;
  group.isPaired = true;
  group.blendRadius = 0.060;
  const auto add = [&](const Primitive& primitive, int bone, double blend) {
    group.elements.push_back({primitive, bone, blend, FieldOperation::kUnion});
  };
  Loft thigh = alongLeg(
      hip,
      knee,
      {{0.000, 0.076, 0.060, 0.084, 0.086},
       {0.070, 0.084, 0.0765, 0.092, 0.092},
       {0.140, 0.081, 0.0785, 0.091, 0.087},
       {0.220, 0.075, 0.0745, 0.083, 0.078},
       {0.300, 0.065, 0.0635, 0.072, 0.067},
       {0.370, 0.0555, 0.0550, 0.060, 0.0575},
       {0.405, 0.0515, 0.0515, 0.055, 0.053},
       {0.422, 0.0455, 0.0455, 0.048, 0.047}});
  thigh.startCap = 0.09;
  add(thigh, kLeftHip, 0.0);
  const Loft shank = alongLeg(
      knee,
      ankle,
      {{-0.005, 0.0455, 0.0455, 0.047, 0.046},
       {0.020, 0.0500, 0.0500, 0.052, 0.054},
       {0.050, 0.0520, 0.0525, 0.049, 0.062},
       {0.100, 0.0550, 0.0565, 0.046, 0.071},
       {0.170, 0.0520, 0.0525, 0.043, 0.067},
       {0.240, 0.0435, 0.0430, 0.039, 0.053},
       {0.310, 0.0355, 0.0345, 0.036, 0.042},
       {0.365, 0.0315, 0.0305, 0.0355, 0.0375},
       {0.385, 0.0290, 0.0280, 0.033, 0.035}});
  add(shank, kLeftKnee, 0.026);
  add(Ellipsoid{{0.094, -0.436, 0.034}, {0.026, 0.034, 0.017}}, kLeftKnee, 0.030);  // patella
  group.boundCenter = {0.09, -0.44, 0.0};
  group.boundRadius = 0.50;
  return group;
}

FieldGroup makeFoot() {
  FieldGroup group;
  group.isPaired = true;
  group.blendRadius = 0.028;
  const auto add = [&](const Primitive& primitive,
                       int bone,
                       double blend,
                       FieldOperation operation = FieldOperation::kUnion) {
    group.elements.push_back({primitive, bone, blend, operation});
  };
  add(footLoft(), kLeftAnkle, 0.0);
  add(Ellipsoid{{0.127, -0.832, -0.020}, {0.010, 0.016, 0.014}}, kLeftAnkle, 0.015);  // malleoli
  add(Ellipsoid{{0.072, -0.824, -0.010}, {0.010, 0.016, 0.014}}, kLeftAnkle, 0.015);

  // Toes: root and tip [m], radii; the big toe is the medial one.
  struct Toe {
    double rootX, rootZ, tipX, tipZ, radius;
  };

  constexpr Toe kToes[] = {
      {0.085, 0.135, 0.088, 0.186, 0.0140},
      {0.108, 0.140, 0.112, 0.187, 0.0098},
      {0.125, 0.135, 0.131, 0.178, 0.0092},
      {0.140, 0.128, 0.147, 0.167, 0.0088},
      {0.153, 0.120, 0.161, 0.153, 0.0085}};
  for (const Toe& toe : kToes) {
    const Eigen::Vector3d root(toe.rootX, kSoleHeight + 1.3 * toe.radius, toe.rootZ);
    const Eigen::Vector3d tip(toe.tipX, kSoleHeight + 0.9 * toe.radius, toe.tipZ);
    add(RoundCone{root, tip, 1.05 * toe.radius, 0.92 * toe.radius}, kLeftFoot, 0.006);
  }
  add(HalfSpace{-Eigen::Vector3d::UnitY(), -kSoleHeight},
      kLeftAnkle,
      0.008,
      FieldOperation::kIntersect);
  group.boundCenter = {0.11, -0.86, 0.06};
  group.boundRadius = 0.17;
  return group;
}

}  // namespace avatar
