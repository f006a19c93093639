#pragma once

// Part of scene_fields.h: rigid things.

#include "src/scene/scene_field_text.h"

namespace simulcap {

template <class Visitor>
void describe(Visitor& v, SphereShape& sphere) {
  v.record("sphere", "A ball around the local origin.");
  v.field(
      "radius",
      sphere.radius,
      {.unit = "m", .min = 0.001, .max = 100.0, .meaning = "Radius of the ball."});
}

template <class Visitor>
void describe(Visitor& v, BoxShape& box) {
  v.record("box", "A box around the local origin.");
  v.field(
      "size",
      box.size,
      {.unit = "m", .min = 0.001, .max = 100.0, .meaning = "Whole extents along x, y, z."});
}

template <class Visitor>
void describe(Visitor& v, CapsuleShape& capsule) {
  v.record("capsule", "A cylinder with round ends about the local y axis, centred.");
  v.field(
      "radius",
      capsule.radius,
      {.unit = "m", .min = 0.001, .max = 100.0, .meaning = "Of cylinder and ends."});
  v.field(
      "length",
      capsule.length,
      {.unit = "m", .min = 0.001, .max = 100.0, .meaning = "Between the centres of the ends."});
}

template <class Visitor>
void describe(Visitor& v, PlaneShape&) {
  v.record("plane", "Everything below the local plane y = 0; has no keys. Can't be moved.");
}

template <class Visitor, class Motion>
void describeVelocities(Visitor& v, Motion& motion) {
  v.field(
      "velocity",
      motion.velocity,
      {.unit = "m/s", .min = -kFast, .max = kFast, .meaning = "Of the centre, in the world."});
  v.field(
      "angular_velocity",
      motion.angularVelocity,
      {.unit = "rad/s", .min = -kFast, .max = kFast, .meaning = "About the world's axes."});
}

template <class Visitor>
void describe(Visitor& v, KinematicMotion& motion) {
  v.record("kinematic", "Keeps its velocity, whatever it meets.");
  describeVelocities(v, motion);
}

template <class Visitor>
void describe(Visitor& v, DynamicMotion& motion) {
  v.record("dynamic", "Moved by gravity, cloth and other obstacles; velocities are the start's.");
  v.field(
      "mass",
      motion.mass,
      {.unit = "kg", .min = 1e-6, .max = 1e6, .required = true, .meaning = "Whole mass."});
  describeVelocities(v, motion);
}

template <class Visitor>
void describe(Visitor& v, SceneObstacle& obstacle) {
  v.record("obstacle", "A rigid thing that the cloth meets; stands still unless told otherwise.");
  v.oneOf(
      obstacle.shape,
      {{{"sphere", "A ball."},
        {"box", "A box."},
        {"capsule", "A cylinder with round ends."},
        {"plane", "A floor or wall."}}});
  v.oneOf(
      obstacle.motion,
      {{{"", ""}, {"kinematic", "Moves at constant velocity."}, {"dynamic", "Is pushed around."}}});
  describePlacement(v, obstacle.placement);
  v.field(
      "friction",
      obstacle.friction,
      {.min = 0.0, .max = 10.0, .meaning = "Coulomb coefficient against other obstacles."});
}

}  // namespace simulcap
