#include "src/synthesis/capture_scenes.h"

#include "avatar/geometry/measures.h"
#include "bullet_ext/core/stability.h"
#include "src/simulation/cloth_setup.h"
#include "src/simulation/stable_hinges.h"
#include "src/synthesis/soft_tissue.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>

namespace simulcap {
namespace {

constexpr std::array kCaptureNames = {"upper", "lower", "dress"};

bool isCaptureName(const std::string& name) {
  return std::find(kCaptureNames.begin(), kCaptureNames.end(), name) != kCaptureNames.end();
}

std::string captureName(const std::string& cut) {
  if (cut == "dress")
    return cut;
  return cut == "tshirt" || cut == "shirt" ? "upper" : "lower";
}

bool isPlaced(const ImportedGarment& garment) {
  return !garment.placement.position.isZero(0.0) || !garment.placement.rotationDegrees.isZero(0.0);
}

bool isWorn(const SceneGarment& garment) {
  const auto* imported = std::get_if<ImportedGarment>(&garment.source);
  return std::holds_alternative<TailoredGarment>(garment.source) ||
         (imported != nullptr && !isPlaced(*imported));
}

void nameGarments(Scene& scene) {
  std::set<std::string> names;
  for (SceneGarment& garment : scene.garments) {
    if (!isWorn(garment)) {
      if (isCaptureName(garment.name))
        throw std::runtime_error(
            "garments: " + garment.name + " isn't worn; this name is kept for clothes");
      continue;
    }
    const auto* tailored = std::get_if<TailoredGarment>(&garment.source);
    if (tailored != nullptr && !isCaptureName(garment.name))
      garment.name = captureName(tailored->cut);
    if (!isCaptureName(garment.name) || !names.insert(garment.name).second)
      throw std::runtime_error(
          "garments: a capture has one garment each of the names upper, lower and dress; found " +
          (isCaptureName(garment.name) ? "another " : std::string()) + garment.name);
  }
}

/// The same mass per area on a finer mesh: a triangle mesh with edges h has one vertex per
/// (√3/2)·h².
void refine(SceneGarment& garment, const SceneTruth& truth) {
  constexpr double kFinestEdge = 0.008;  // of the wardrobe [m]
  avatar::ClothParameters& cloth = garment.cloth.parameters;
  cloth.stretchStiffness *= truth.stretch;
  cloth.torsionStiffness *= truth.torsion;
  cloth.friction *= truth.friction;
  auto* tailored = std::get_if<TailoredGarment>(&garment.source);
  if (cloth.massMode == avatar::MassMode::kPerVertex && tailored != nullptr) {
    const double edge = tailored->edgeLength;
    cloth.massMode = avatar::MassMode::kAreal;
    cloth.arealDensity = cloth.vertexMass / (0.5 * std::numbers::sqrt3 * edge * edge);
  }
  cloth.arealDensity *= truth.mass;
  cloth.vertexMass *= truth.mass;
  if (tailored != nullptr)
    tailored->edgeLength = std::max(kFinestEdge, tailored->edgeLength / truth.refinement);
}

/// Every vertex weighs the same: a corner of a sliver would be too light for its springs.
void shareMass(StagedCloth& cloth) {
  avatar::ClothParameters& parameters = cloth.parameters;
  if (parameters.massMode != avatar::MassMode::kAreal || !parameters.vertexMasses.empty())
    return;
  parameters.massMode = avatar::MassMode::kPerVertex;
  parameters.vertexMass = parameters.arealDensity * avatar::faceAreas(cloth.rest).sum() /
                          static_cast<double>(cloth.rest.numVertices());
}

/// Per frame, that regular meshes of the cloths' edge lengths need: half of the limit of
/// bullet_ext::stability().
int regularSubsteps(const Stage& stage) {
  constexpr double kSafety = 0.5;
  double largest = 0.0;  // λ [1/s²]
  for (const StagedCloth& cloth : stage.cloths) {
    const avatar::ClothParameters& parameters = cloth.parameters;
    const double areaOfVertex =
        avatar::faceAreas(cloth.rest).sum() / static_cast<double>(cloth.rest.numVertices());
    const double squaredEdge = areaOfVertex / (0.5 * std::numbers::sqrt3);
    const double stiffness = std::max(
        3.0 * parameters.stretchStiffness, 35.6 * parameters.torsionStiffness / squaredEdge);
    largest = std::max(largest, stiffness / parameters.vertexMass);
  }
  const double frame = 1.0 / stage.framesPerSecond;
  return largest > 0.0 ? bullet_ext::substepsFor(frame, 2.0 * kSafety / std::sqrt(largest)) : 1;
}

}  // namespace

CaptureScenes captureScenes(const Scene& scene) {
  if (!scene.body || !scene.camera)
    throw std::runtime_error(
        "a synthetic capture needs a body and a camera; name them in the scene");
  CaptureScenes scenes{scene, scene};
  nameGarments(scenes.told);
  nameGarments(scenes.truth);
  for (SceneGarment& garment : scenes.truth.garments) {
    if (isWorn(garment))
      refine(garment, scene.truth);
  }
  return scenes;
}

Stage setTruthStage(const Scene& truth) {
  StageOptions options;
  options.settleSeconds = truth.truth.settleSeconds;
  if (truth.truth.softTissue > 0.0)
    options.softTissue = [&](const avatar::BodyModel& model, const avatar::ShapedBody& shaped) {
      return makeSoftTissue(
          model, shaped, {.largest = truth.truth.softTissue, .seed = truth.truth.seed});
    };
  Stage stage = setStage(truth, options);
  for (StagedCloth& cloth : stage.cloths)
    shareMass(cloth);
  const double frame = 1.0 / stage.framesPerSecond;
  const double substep = frame / regularSubsteps(stage);
  for (StagedCloth& cloth : stage.cloths)
    cloth.parameters.edgeTorsionStiffness =
        stableHinges(avatar::Garment{.mesh = cloth.rest, .cloth = cloth.parameters}, substep);
  return stage;
}

int truthSubsteps(const Stage& stage, const SceneTime& time) {
  constexpr double kSafety = 0.8;  // of the limit about the rest shape
  int substeps = std::max(substepsPerFrame(time), regularSubsteps(stage));
  for (const StagedCloth& cloth : stage.cloths) {
    const double largest =
        bullet_ext::stability(clothMesh(cloth), {.safety = kSafety}).largestSubstep;
    if (std::isfinite(largest))
      substeps = std::max(substeps, bullet_ext::substepsFor(1.0 / stage.framesPerSecond, largest));
  }
  return substeps;
}

PixelLabel labelOf(const StagedCloth& cloth) {
  if (cloth.name == "lower")
    return kLower;
  return isCaptureName(cloth.name) ? kUpper : kBackground;
}

}  // namespace simulcap
