#include "avatar/default_body/anatomy.h"

#include <cmath>

namespace avatar {
namespace {

// A loft along +x in the T-pose: u points to the front (+z), v up.
Loft alongArm(const Eigen::Vector3d& origin, std::vector<LoftSection> sections) {
  Loft loft;
  loft.origin = origin;
  loft.axes.col(0) = Eigen::Vector3d::UnitZ();
  loft.axes.col(1) = Eigen::Vector3d::UnitY();
  loft.axes.col(2) = Eigen::Vector3d::UnitX();
  loft.sections = std::move(sections);
  return loft;
}

struct Finger {
  double baseX, baseZ;    // of the knuckle [m]
  double length, radius;  // knuckle to tip, at the knuckle [m]
  double spread;          // towards the thumb [rad]
};

// Three phalanges (lengths 5:3:2, Buryanov & Kotiuk 2010), each bent a little further down.
void addFinger(FieldGroup& group, const Finger& finger) {
  constexpr double kShare[] = {0.47, 0.30, 0.23};
  constexpr double kBend[] = {0.10, 0.22, 0.30};
  Eigen::Vector3d point(finger.baseX, 0.4585, finger.baseZ);
  double radius = finger.radius;
  for (int phalanx = 0; phalanx < 3; ++phalanx) {
    const double bend = kBend[phalanx];
    const Eigen::Vector3d direction(
        std::cos(bend) * std::cos(finger.spread),
        -std::sin(bend),
        std::cos(bend) * std::sin(finger.spread));
    const double tipRadius = finger.radius * (phalanx == 2 ? 0.78 : 1.0 - 0.06 * (phalanx + 1));
    const double length = kShare[phalanx] * finger.length - (phalanx == 2 ? tipRadius : 0.0);
    const Eigen::Vector3d next = point + length * direction;
    group.elements.push_back(
        {RoundCone{point, next, radius, tipRadius}, kLeftHand, 0.003, FieldOperation::kUnion});
    point = next;
    radius = tipRadius;
  }
}

void addThumb(FieldGroup& group) {
  const Eigen::Vector3d carpal(0.703, 0.450, 0.020);
  const Eigen::Vector3d knuckle(0.738, 0.442, 0.047);
  const Eigen::Vector3d joint(0.766, 0.438, 0.063);
  const Eigen::Vector3d tip(0.787, 0.436, 0.072);
  const auto add = [&](const Eigen::Vector3d& a,
                       const Eigen::Vector3d& b,
                       double ra,
                       double rb,
                       double blend) {
    group.elements.push_back({RoundCone{a, b, ra, rb}, kLeftWrist, blend, FieldOperation::kUnion});
  };
  add(carpal, knuckle, 0.0165, 0.0130, 0.012);
  add(knuckle, joint, 0.0115, 0.0105, 0.005);
  add(joint, tip, 0.0105, 0.0085, 0.004);
}

}  // namespace

FieldGroup makeArm() {
  FieldGroup group;
  group.isPaired = true;
  group.blendRadius = 0.045;
  const auto add = [&](const Primitive& primitive, int bone, double blend) {
    group.elements.push_back({primitive, bone, blend, FieldOperation::kUnion});
  };
  Loft upper = alongArm(
      {0.160, 0.462, -0.010},
      {{0.000, 0.050, 0.050, 0.048, 0.052},
       {0.050, 0.050, 0.050, 0.048, 0.053},
       {0.120, 0.0485, 0.0475, 0.0465, 0.0495},
       {0.180, 0.0440, 0.0450, 0.0430, 0.0460},
       {0.235, 0.038, 0.039, 0.036, 0.038},
       {0.262, 0.034, 0.036, 0.031, 0.032}});
  upper.startCap = 0.05;
  add(upper, kLeftShoulder, 0.0);
  add(Ellipsoid{{0.186, 0.468, -0.010}, {0.068, 0.056, 0.058}}, kLeftShoulder, 0.030);  // deltoid
  Loft forearm = alongArm(
      {0.435, 0.462, -0.012},
      {{-0.010, 0.034, 0.034, 0.030, 0.031},
       {0.020, 0.039, 0.038, 0.035, 0.035},
       {0.050, 0.042, 0.041, 0.038, 0.038},
       {0.100, 0.039, 0.037, 0.034, 0.034},
       {0.160, 0.034, 0.031, 0.027, 0.027},
       {0.215, 0.031, 0.024, 0.021, 0.022},
       {0.245, 0.030, 0.023, 0.018, 0.019}});
  forearm.endCap = 0.015;
  add(forearm, kLeftElbow, 0.016);
  add(Ellipsoid{{0.430, 0.460, -0.036}, {0.022, 0.016, 0.014}}, kLeftElbow, 0.018);  // olecranon
  group.boundCenter = {0.42, 0.46, 0.0};
  group.boundRadius = 0.36;
  return group;
}

FieldGroup makeHand() {
  FieldGroup group;
  group.isPaired = true;
  group.blendRadius = 0.012;
  Loft palm = alongArm(
      {0.685, 0.460, -0.002},
      {{-0.010, 0.027, 0.025, 0.0180, 0.0180},
       {0.020, 0.031, 0.032, 0.0160, 0.0180},
       {0.050, 0.038, 0.040, 0.0135, 0.0165},
       {0.072, 0.041, 0.042, 0.0105, 0.0130}});
  palm.exponent = 2.3;
  palm.startCap = 0.020;
  palm.endCap = 0.016;
  group.elements.push_back({palm, kLeftWrist, 0.0, FieldOperation::kUnion});
  addThumb(group);
  group.boundCenter = {0.74, 0.45, 0.01};
  group.boundRadius = 0.12;
  return group;
}

FieldGroup makeFingers() {
  FieldGroup group;
  group.isPaired = true;
  group.blendRadius = 0.012;
  addFinger(group, {0.760, 0.0305, 0.090, 0.0094, 0.080});
  addFinger(group, {0.764, 0.0090, 0.100, 0.0096, 0.020});
  addFinger(group, {0.760, -0.0125, 0.094, 0.0092, -0.050});
  addFinger(group, {0.751, -0.0335, 0.076, 0.0082, -0.130});
  group.boundCenter = {0.80, 0.45, 0.0};
  group.boundRadius = 0.10;
  return group;
}

}  // namespace avatar
