#include "avatar/default_body/anatomy.h"

namespace avatar {
namespace {

Loft faceLoft() {
  Loft face;
  face.origin = {0.0, 0.0, 0.050};
  face.axes.col(0) = Eigen::Vector3d::UnitX();
  face.axes.col(1) = Eigen::Vector3d::UnitZ();
  face.axes.col(2) = Eigen::Vector3d::UnitY();
  // height, half-width, depth in front of and behind the loft's axis [m]
  constexpr double kSections[][4] = {
      {0.582, 0.030, 0.056, 0.020},
      {0.600, 0.046, 0.060, 0.030},
      {0.625, 0.057, 0.060, 0.045},
      {0.655, 0.064, 0.060, 0.050},
      {0.690, 0.068, 0.063, 0.050},
      {0.725, 0.069, 0.064, 0.050}};
  for (const auto& s : kSections)
    face.sections.push_back({s[0], s[1], s[1], s[2], s[3]});
  face.startCap = 0.016;
  face.endCap = 0.050;
  face.exponent = 2.2;
  return face;
}

Ellipsoid ear(const Eigen::Vector3d& center, const Eigen::Vector3d& radii) {
  // The auricle leans back by 15° and stands off the skull by 25°.
  const Eigen::AngleAxisd flare(-0.40, Eigen::Vector3d::UnitY());
  const Eigen::AngleAxisd lean(-0.25, Eigen::Vector3d::UnitX());
  return {center, radii, (flare * lean).toRotationMatrix()};
}

}  // namespace

FieldGroup makeHead() {
  FieldGroup group;
  group.blendRadius = 0.022;
  const auto add = [&](const Primitive& primitive,
                       double blend,
                       FieldOperation operation = FieldOperation::kUnion) {
    group.elements.push_back({primitive, kHead, blend, operation});
  };
  add(Ellipsoid{{0.0, 0.694, 0.020}, {0.075, 0.100, 0.098}}, 0.0);    // cranium
  add(Ellipsoid{{0.0, 0.712, 0.000}, {0.077, 0.076, 0.084}}, 0.030);  // parietal bones
  add(faceLoft(), 0.020);
  add(RoundCone{{0.047, 0.614, 0.036}, {0.018, 0.586, 0.090}, 0.013, 0.012}, 0.020);    // mandible
  add(Ellipsoid{{0.0, 0.586, 0.099}, {0.021, 0.014, 0.014}}, 0.018);                    // chin
  add(Ellipsoid{{0.040, 0.658, 0.088}, {0.018, 0.012, 0.016}}, 0.022);                  // cheekbone
  add(RoundCone{{0.010, 0.695, 0.108}, {0.044, 0.697, 0.094}, 0.0080, 0.0070}, 0.014);  // brow
  add(Ellipsoid{{0.031, 0.677, 0.122}, {0.017, 0.0110, 0.016}},
      0.012,
      FieldOperation::kSubtract);                                                   // eye socket
  add(Ellipsoid{{0.031, 0.677, 0.0955}, {0.0125, 0.0125, 0.0125}}, 0.003);          // eyeball
  add(RoundCone{{0.0, 0.690, 0.111}, {0.0, 0.650, 0.126}, 0.0065, 0.0090}, 0.010);  // nose bridge
  add(Ellipsoid{{0.0, 0.6455, 0.1275}, {0.0110, 0.0095, 0.0115}}, 0.006);           // nose tip
  add(Ellipsoid{{0.0110, 0.642, 0.117}, {0.0070, 0.0070, 0.0100}}, 0.005);          // nose wing
  // Lips, corner to corner.
  add(RoundCone{{0.0040, 0.6215, 0.1090}, {0.0225, 0.6165, 0.1030}, 0.0066, 0.0042}, 0.004);
  add(RoundCone{{0.0, 0.6075, 0.1090}, {0.0205, 0.6130, 0.1030}, 0.0076, 0.0042}, 0.0015);
  add(ear({0.077, 0.668, 0.004}, {0.0065, 0.031, 0.018}), 0.009);
  add(ear({0.085, 0.668, 0.008}, {0.0060, 0.019, 0.010}), 0.006, FieldOperation::kSubtract);
  group.boundCenter = {0.0, 0.69, 0.03};
  group.boundRadius = 0.16;
  return group;
}

}  // namespace avatar
