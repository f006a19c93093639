#pragma once

#include "avatar/body_model.h"

namespace avatar {

/// Builds the built-in body from its anatomy: template, shape directions, skinning weights, joint
/// regressor and pose blend shapes. Takes seconds; the same bytes on every run. Programs use the
/// embedded copy (embedded_body.h) instead.
BodyModel makeDefaultBody();

}  // namespace avatar
