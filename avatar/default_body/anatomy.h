#pragma once

#include "avatar/default_body/body_field.h"

namespace avatar {

/// The anatomy of the mean adult (stature 1.70 m): lofts for trunk and limbs, ellipsoids and round
/// cones for muscles, face, fingers and toes. Lengths follow published segment proportions
/// (Drillis & Contini 1966; NASA-STD-3000), girths the middle of adult surveys.
BodyField makeAnatomy();

/// Height of the soles in the template frame [m].
inline constexpr double kSoleHeight = -0.905;

// The groups, one source file each.
FieldGroup makeTrunk();
FieldGroup makeNeck();
FieldGroup makeHead();
FieldGroup makeArm();
FieldGroup makeHand();
FieldGroup makeFingers();
FieldGroup makeLeg();
FieldGroup makeFoot();

}  // namespace avatar
