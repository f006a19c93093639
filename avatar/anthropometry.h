#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <string_view>
#include <vector>

namespace avatar {

/// Mass per volume inside the skin [kg/m³]. Tissue with 19 % fat has 1/(0.19/900 + 0.81/1100) =
/// 1055 kg/m³ (two compartments, Siri 1961), so 70 kg of it fill 66.3 l; the skin also holds some 3
/// l of air in lungs and gut, and 70 kg / 69.3 l = 1010 kg/m³.
inline constexpr double kBodyDensity = 1010.0;

/// What a tape, a calliper and a scale find on a standing body. Girths are lengths of a tight tape:
/// the perimeter of the convex hull of a plane section. Landmarks follow ISO 8559-1 as far as skin
/// and joints show them. Limbs are means of the left and the right one.
struct BodyMeasures {
  double stature = 0.0;       ///< sole to top of the head [m]
  double headHeight = 0.0;    ///< chin to top of the head [m]
  double neckGirth = 0.0;     ///< smallest, at right angles to the neck [m]
  double chestGirth = 0.0;    ///< largest level one between the lowest ribs and the armpits [m]
  double waistGirth = 0.0;    ///< smallest level one between the chest and the hips [m]
  double abdomenGirth = 0.0;  ///< level, at the navel [m]
  double hipGirth = 0.0;    ///< largest level one between the crotch and the hip bones' crests [m]
  double thighGirth = 0.0;  ///< largest level one between the crotch and half way to the knee [m]
  double calfGirth = 0.0;   ///< largest level one between knee and ankle [m]
  double upperArmGirth = 0.0;    ///< half way from shoulder to elbow, at right angles to it [m]
  double shoulderBreadth = 0.0;  ///< between the shoulder joints, near the biacromial breadth [m]
  double armLength = 0.0;        ///< shoulder joint to elbow to wrist [m]
  double handLength = 0.0;       ///< wrist joint to the farthest fingertip [m]
  double legLength = 0.0;        ///< hip joint to sole, vertical [m]
  double crotchHeight = 0.0;     ///< inseam: sole to crotch [m]
  double footLength = 0.0;       ///< heel to toe along the foot [m]
  double volume = 0.0;           ///< [m³]
  double mass = 0.0;             ///< volume times kBodyDensity [kg]
  double bmi = 0.0;              ///< mass / stature² [kg/m²]
};

/// Measures a body in T-pose: Y up, facing +Z, its left towards +X, metres, any origin. `joints` is
/// 3 × J in SMPL's order; the first 22 count, so SMPL+H and SMPL-X joints will do. The mesh must be
/// closed and wound outwards; several closed parts are welcome (their volumes add up, and each
/// section takes the largest loop around the bone).
///
/// Throws std::invalid_argument naming the reason: indices out of range, values that are not
/// finite, an open, non-manifold or inside-out mesh, too few joints, joints that are no T-pose (a
/// bone without length, arms more than 45° off the horizontal, left and right swapped) or lie off
/// the mesh.
BodyMeasures measureBody(const MeshView& mesh, const Eigen::Matrix3Xd& joints);

/// One line of a table.
struct MeasureRow {
  std::string_view name;  ///< "chest girth"
  double value = 0.0;
  std::string_view unit;  ///< "m", "m^3", "kg" or "kg/m^2"
};

/// All measures in the order of the struct.
std::vector<MeasureRow> measureRows(const BodyMeasures& measures);

}  // namespace avatar
