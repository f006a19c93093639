#pragma once

// The one declaration of the scene file's keys. describe(visitor, part) names each member once,
// with its key, unit, range and meaning; visitors make of it the table behind the reader's checks,
// scenes/scene.schema.json and scenes/README.md (scene_table.cpp), and fill a Scene from JSON
// (scene_binder.cpp). Defaults are the members' initialisers in scene.h.

#include "avatar/default_body/embedded_body.h"
#include "avatar/motion_clips.h"
#include "src/output/named_pose.h"
#include "src/scene/scene_field_text.h"
#include "src/scene/scene_garment_fields.h"
#include "src/scene/scene_obstacle_fields.h"

#include <string>
#include <vector>

namespace simulcap {

inline std::vector<std::string> bodyPresetNames() {
  std::vector<std::string> names;
  for (const avatar::BodyPreset& preset : avatar::bodyPresets())
    names.push_back(preset.name);
  return names;
}

inline std::string clipNamesInWords() {
  std::string names;
  for (const std::string_view name : avatar::clipNames())
    names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}

template <class Visitor>
void describe(Visitor& v, SceneTime& time) {
  v.record("time", "How long the scene lasts, and in which steps.");
  v.field(
      "seconds",
      time.seconds,
      {.unit = "s",
       .min = 0.001,
       .max = 3600.0,
       .defaultWords = "as long as the body's motion",
       .meaning = "Simulated time, rounded to whole frames."});
  v.field(
      "frames",
      time.frames,
      {.min = 1,
       .max = 1e6,
       .defaultWords = "as long as the body's motion",
       .meaning = "Number of frames, the start being the first; instead of `seconds`."});
  v.field(
      "frames_per_second",
      time.framesPerSecond,
      {.unit = "1/s", .min = 1.0, .max = 1000.0, .meaning = "Frames shown, written and captured."});
  v.field(
      "substeps",
      time.substeps,
      {.min = 1,
       .max = 1e6,
       .choices = {"auto"},
       .meaning = "Simulation steps per frame; `auto`: of 1/3000 s each, 100 at 30 frames/s, or as "
                  "many more as the cloth needs to be stable; of 1/300 s when `implicit`."});
  v.atMostOneOf({"seconds", "frames"});
}

template <class Visitor>
void describe(Visitor& v, SceneBody& body) {
  v.record("body", "The person, who moves as told and is not moved by the cloth.");
  v.field(
      "model",
      body.model,
      {.example = "default", .meaning = "`default` (the built-in body) or an SMPL-family `.npz`."});
  v.field(
      "betas",
      body.betas,
      {.min = -20.0,
       .max = 20.0,
       .minItems = 0,
       .maxItems = 300,
       .choices = bodyPresetNames(),
       .meaning = "Shape: a preset of the default body, or shape parameters (the rest is 0)."});
  v.field(
      "motion",
      body.motion,
      {.minItems = 1,
       .maxItems = 100,
       .example = "walk",
       .defaultWords = "none: the body stands still",
       .meaning = "Built-in clips (" + clipNamesInWords() +
                  "; `turn:3.2` takes 3.2 s), `.npz` (AMASS) or `.bvh` files; a list is played one "
                  "after the other."});
  v.field(
      "up_axis",
      body.upAxis,
      {.needs = "motion", .meaning = "Up axis of the motion files; `auto`: what each file says."});
  v.field(
      "pose", body.pose, {.choices = namedPoses(), .meaning = "Pose of a body that stands still."});
  v.field(
      "soft_tissue",
      body.softTissue,
      {.example = "body.npz",
       .defaultWords = "none: the skin follows the skeleton",
       .meaning = "`.npz` with `offsets` (T, V, 3) [m], added to the rest shape frame by frame "
                  "before posing."});
  v.atMostOneOf({"motion", "pose"});
}

template <class Visitor>
void describe(Visitor& v, SceneContact& contact) {
  v.record(
      "contact",
      "Which contacts are looked for, as far as the scene has both sides; obstacles always count.");
  v.field("body", contact.body, {.meaning = "Cloth against the body."});
  v.field("between_garments", contact.betweenGarments, {.meaning = "Garment against garment."});
  v.field("self_contact", contact.selfContact, {.meaning = "Each garment against itself."});
}

template <class Visitor>
void describe(Visitor& v, SceneWind& wind) {
  v.record(
      "wind",
      "Uniform moving air: ½·density·drag·area·|u|u on each triangle, u the air's velocity "
      "relative to it, along its normal.");
  v.field(
      "velocity",
      wind.velocity,
      {.unit = "m/s",
       .min = -kFast,
       .max = kFast,
       .required = true,
       .meaning = "Of the air in the world; zero: still air that brakes the cloth."});
  v.field(
      "air_density",
      wind.airDensity,
      {.unit = "kg/m³", .min = 0.001, .max = 1000.0, .meaning = "Air at 20 °C by default."});
  v.field(
      "drag_coefficient",
      wind.dragCoefficient,
      {.min = 0.0, .max = 10.0, .meaning = "A plate across the flow by default."});
}

template <class Visitor>
void describe(Visitor& v, SceneCamera& camera) {
  v.record("camera", "A pinhole camera that stands still; pixel centres at integers.");
  v.field("width", camera.width, {.unit = "px", .min = 16, .max = 8192, .meaning = "Image width."});
  v.field(
      "height", camera.height, {.unit = "px", .min = 16, .max = 8192, .meaning = "Image height."});
  v.field(
      "fx",
      camera.fx,
      {.unit = "px", .min = 1.0, .max = 1e5, .meaning = "Focal length, horizontal."});
  v.field(
      "fy",
      camera.fy,
      {.unit = "px",
       .min = 1.0,
       .max = 1e5,
       .defaultWords = "as `fx`",
       .meaning = "Focal length, vertical."});
  v.field(
      "cx",
      camera.cx,
      {.unit = "px",
       .min = -1e5,
       .max = 1e5,
       .defaultWords = "the image's centre",
       .meaning = "Principal point, from the left."});
  v.field(
      "cy",
      camera.cy,
      {.unit = "px",
       .min = -1e5,
       .max = 1e5,
       .defaultWords = "the image's centre",
       .meaning = "Principal point, from the top."});
  v.field(
      "position",
      camera.position,
      {.unit = "m", .min = -kFarAway, .max = kFarAway, .meaning = "The camera's centre."});
  v.field(
      "look_at",
      camera.target,
      {.unit = "m",
       .min = -kFarAway,
       .max = kFarAway,
       .meaning = "Point shown at the principal point."});
  v.field(
      "up",
      camera.up,
      {.min = -1.0, .max = 1.0, .meaning = "Direction shown upwards, not along the view."});
}

template <class Visitor>
void describe(Visitor& v, SceneSensor& sensor) {
  v.record("sensor", "What measures depth, with its errors.");
  v.field(
      "model",
      sensor.model,
      {.required = true,
       .meaning = "`ideal` (exact), `kinect_v1` (structured light) or `time_of_flight`."});
  v.field(
      "seed", sensor.seed, {.min = 0, .max = kSeedMax, .meaning = "Another number, other noise."});
}

template <class Visitor>
void describe(Visitor& v, SceneRoom& room) {
  v.record("room", "Floor, walls, textures and lights around the scene, for colour images.");
  v.field(
      "seed", room.seed, {.min = 0, .max = kSeedMax, .meaning = "Another number, another room."});
}

template <class Visitor>
void describe(Visitor& v, SceneTruth& truth) {
  v.record(
      "truth",
      "What a synthetic capture (`simulcap synth`) shows instead of the scene's own cloth and "
      "skin, so that whoever captures it doesn't know the answer beforehand. `avatar.glb` is the "
      "person without this.");
  v.field(
      "refinement",
      truth.refinement,
      {.min = 1.0,
       .max = 10.0,
       .meaning = "Edges of worn cloth are this many times shorter, down to the wardrobe's 8 mm."});
  v.field(
      "stretch",
      truth.stretch,
      {.min = 0.01, .max = 100.0, .meaning = "Factor of the cloth's `stretch_k`."});
  v.field(
      "torsion",
      truth.torsion,
      {.min = 0.01, .max = 100.0, .meaning = "Factor of the cloth's `torsion_w`."});
  v.field(
      "mass",
      truth.mass,
      {.min = 0.01, .max = 100.0, .meaning = "Factor of the mass of the same area of cloth."});
  v.field(
      "friction",
      truth.friction,
      {.min = 0.0, .max = 100.0, .meaning = "Factor of the cloth's `friction`."});
  v.field(
      "soft_tissue",
      truth.softTissue,
      {.unit = "m",
       .min = 0.0,
       .max = 0.05,
       .meaning = "Largest offset of the skin from the body model; smooth, partly with the pose."});
  v.field(
      "settle_seconds",
      truth.settleSeconds,
      {.unit = "s",
       .min = 0.0,
       .max = 60.0,
       .meaning = "Time that clothes get to come to rest before frame 0."});
  v.field(
      "seed",
      truth.seed,
      {.min = 0, .max = kSeedMax, .meaning = "Another number, other skin and other prints."});
  v.field(
      "back_stride",
      truth.backStride,
      {.min = 1,
       .max = 1000,
       .meaning = "Frames from one picture of the hidden back camera to the next."});
}

/// What only those need who look at the scene.
template <class Visitor>
void describePictures(Visitor& v, Scene& scene) {
  v.field("camera", scene.camera, {.defaultWords = "none", .meaning = "Who looks."});
  v.field(
      "sensor",
      scene.sensor,
      {.defaultWords = "none: exact depth", .needs = "camera", .meaning = "What measures depth."});
  v.field(
      "room",
      scene.room,
      {.defaultWords = "none: plain background, even light",
       .needs = "camera",
       .meaning = "What is around."});
  v.field(
      "truth",
      scene.truth,
      {.defaultWords = "its own defaults",
       .meaning = "What a synthetic capture doesn't tell; `simulate` takes no notice."});
}

template <class Visitor>
void describe(Visitor& v, Scene& scene) {
  v.record("scene", "The whole file.");
  v.field(
      "time",
      scene.time,
      {.defaultWords = "as long as the body's motion, else a still",
       .meaning = "Length and steps."});
  v.field(
      "gravity",
      scene.gravity,
      {.unit = "m/s²", .min = -1000.0, .max = 1000.0, .meaning = "Zero leaves it out."});
  v.field(
      "integrator",
      scene.integrator,
      {.meaning = "`semi_implicit` Euler, the paper's literal `forward_euler`, which diverges, or "
                  "`implicit` Runge–Kutta for cloth that is too stiff or light for short steps."});
  v.field("body", scene.body, {.defaultWords = "none", .meaning = "The person."});
  v.field(
      "garments",
      scene.garments,
      {.minItems = 0,
       .maxItems = 64,
       .defaultWords = "none",
       .meaning =
           "Pieces of cloth, inner ones first; what is worn goes over each other as clothes do."});
  v.field(
      "contact",
      scene.contact,
      {.defaultWords = "body and between garments", .meaning = "Which contacts are looked for."});
  v.field(
      "strain_limit",
      scene.strainLimit,
      {.min = 0.001,
       .max = 10.0,
       .defaultWords = "none",
       .meaning = "Springs longer than (1 + this) times their rest length are pulled back after "
                  "each substep (Provot 1995 uses 0.1)."});
  v.field("wind", scene.wind, {.defaultWords = "none: no air at all", .meaning = "Moving air."});
  v.field(
      "obstacles",
      scene.obstacles,
      {.minItems = 0,
       .maxItems = 1000,
       .defaultWords = "none, not even a floor",
       .meaning = "Rigid things."});
  describePictures(v, scene);
}

}  // namespace simulcap
