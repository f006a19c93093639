#include "avatar/default_body/anatomy.h"

namespace avatar {
namespace {

// A trunk section as a tailor would note it: half-width, and where front and back lie.
struct TrunkSection {
  double height, halfWidth, middle, front, back;  // [m]; middle, front, back along z
};

Loft trunkLoft() {
  constexpr TrunkSection kSections[] = {
      {-0.064, 0.095, 0.000, 0.045, -0.060},
      {-0.036, 0.138, 0.004, 0.080, -0.082},
      {-0.002, 0.163, 0.006, 0.100, -0.092},
      {0.040, 0.163, 0.008, 0.112, -0.084},
      {0.100, 0.154, 0.012, 0.116, -0.073},
      {0.160, 0.143, 0.014, 0.115, -0.066},
      {0.210, 0.139, 0.014, 0.113, -0.066},
      {0.270, 0.144, 0.010, 0.113, -0.076},
      {0.330, 0.156, 0.005, 0.117, -0.088},
      {0.380, 0.162, -0.001, 0.112, -0.095},
      {0.430, 0.155, -0.007, 0.094, -0.096},
      {0.470, 0.126, -0.011, 0.068, -0.088},
      {0.505, 0.090, -0.014, 0.044, -0.073},
      {0.540, 0.056, -0.018, 0.026, -0.060},
      {0.570, 0.036, -0.020, 0.012, -0.050}};
  Loft loft;
  loft.origin = Eigen::Vector3d::Zero();
  loft.axes.col(0) = Eigen::Vector3d::UnitX();
  loft.axes.col(1) = Eigen::Vector3d::UnitZ();
  loft.axes.col(2) = Eigen::Vector3d::UnitY();
  for (const TrunkSection& s : kSections) {
    loft.sections.push_back(
        {s.height, s.halfWidth, s.halfWidth, s.front - s.middle, s.middle - s.back, 0.0, s.middle});
  }
  loft.startCap = 0.022;
  loft.endCap = 0.03;
  loft.exponent = 2.3;
  return loft;
}

}  // namespace

FieldGroup makeTrunk() {
  FieldGroup group;
  const auto add = [&](const Primitive& primitive, int bone, double blend) {
    group.elements.push_back({primitive, bone, blend, FieldOperation::kUnion});
  };
  add(trunkLoft(), kPelvis, 0.0);
  // Gluteus, iliac crest, lower belly.
  add(Ellipsoid{{0.072, -0.040, -0.056}, {0.080, 0.085, 0.060}}, kPelvis, 0.030);
  add(Ellipsoid{{0.0, 0.030, 0.062}, {0.105, 0.095, 0.056}}, kPelvis, 0.040);
  // Pectoralis / breast, latissimus, scapula, trapezius, clavicle.
  add(Ellipsoid{{0.072, 0.356, 0.064}, {0.074, 0.062, 0.052}}, kSpine3, 0.040);
  add(Ellipsoid{{0.106, 0.340, -0.032}, {0.047, 0.135, 0.054}}, kSpine3, 0.070);
  add(Ellipsoid{{0.080, 0.405, -0.064}, {0.060, 0.080, 0.032}}, kSpine3, 0.040);
  add(RoundCone{{0.020, 0.540, -0.030}, {0.150, 0.490, -0.016}, 0.025, 0.030}, kLeftCollar, 0.045);
  add(RoundCone{{0.022, 0.484, 0.026}, {0.150, 0.492, 0.004}, 0.010, 0.016}, kLeftCollar, 0.025);
  group.boundCenter = {0.0, 0.22, 0.0};
  group.boundRadius = 0.42;
  return group;
}

FieldGroup makeNeck() {
  const Eigen::Vector3d base(0.0, 0.480, -0.026);
  const Eigen::Vector3d top(0.0, 0.640, 0.016);
  Loft neck;
  neck.origin = base;
  neck.axes.col(2) = (top - base).normalized();
  neck.axes.col(0) = Eigen::Vector3d::UnitX();
  neck.axes.col(1) = neck.axes.col(0).cross(neck.axes.col(2)).normalized();
  neck.sections = {
      {0.0, 0.053, 0.053, 0.055, 0.049},
      {0.060, 0.0495, 0.0495, 0.052, 0.046},
      {0.110, 0.0490, 0.0490, 0.050, 0.046},
      {0.165, 0.0500, 0.0500, 0.048, 0.048}};
  FieldGroup group;
  group.blendRadius = 0.040;
  group.elements.push_back({neck, kNeck, 0.0, FieldOperation::kUnion});
  group.boundCenter = 0.5 * (base + top);
  group.boundRadius = 0.16;
  return group;
}

}  // namespace avatar
