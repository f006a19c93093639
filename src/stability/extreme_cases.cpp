#include "src/stability/extreme_cases.h"

#include "avatar/geometry/primitives_mesh.h"
#include "src/program/parallel_for.h"
#include "src/simulation/procedural_cloth.h"
#include "src/simulation/scene_run.h"
#include "src/simulation/stage.h"

#include <Eigen/Geometry>

#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

using bullet_ext::CaptureGarment;
using bullet_ext::CaptureWorld;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
// Of a cloth that was given hundreds of times the energy of its own weight a second before: what
// decides there is that the energy doesn't grow.
constexpr double kStillSwinging = 3.0;

bullet_ext::ClothMaterial middleCloth() {
  bullet_ext::ClothMaterial material = bullet_ext::paperMaterial("middle");
  material.damping = 5.0;  // 1/s: so that the end is calm
  return material;
}

/// A vertical sheet in the xy plane, its centre at the origin.
CaptureGarment sheetOf(const ClothSheet& sheet, const std::vector<Pin>& pins) {
  const ProceduralCloth cloth = makeSheet(sheet);
  return {
      .vertices = cloth.mesh.vertices,
      .faces = cloth.mesh.faces,
      .material = middleCloth(),
      .mesh = {.pins = pinnedVertices(cloth, pins)}};
}

/// 0.4 m wide and high, 2 cm edges, hanging from its upper edge.
CaptureGarment curtain() {
  return sheetOf({.width = 0.4, .height = 0.4}, {Pin("top")});
}

ExtremeScene sceneOf(const CaptureGarment& garment) {
  ExtremeScene scene;
  scene.setup.garments = {garment};
  return scene;
}

ExtremeScene curtainOf(double stretch, double torsion) {
  CaptureGarment garment = curtain();
  garment.material.stretchStiffness = stretch;
  garment.material.torsionStiffness = torsion;
  return sceneOf(garment);
}

ExtremeOutcome stiffAndLight(bullet_ext::Integrator integrator) {
  ExtremeScene scene = curtainOf(1e6, 10.0);
  scene.setup.garments[0].material.massMode = bullet_ext::MassMode::kAreal;
  scene.setup.simulation.integrator = integrator;
  return play(scene);
}

/// The whole way from a scene, whose number of substeps is refused before anything moves.
ExtremeOutcome tooFewSubsteps() {
  SceneGarment garment{.name = "sheet", .source = ClothSheet{.width = 0.4, .height = 0.4}};
  garment.cloth.parameters.stretchStiffness = 1e6;
  Scene scene;
  scene.time = SceneTime{.frames = 2, .substeps = 100};
  scene.garments = {garment};
  ExtremeOutcome outcome;
  try {
    const Stage stage = setStage(scene);
    const SceneRun run(scene, stage, 1);
    outcome.reason = std::to_string(run.substepsPerFrame()) + " substeps were taken";
  } catch (const std::runtime_error& error) {
    outcome.verdict = Verdict::kRefused;
    outcome.reason = error.what();
  }
  return outcome;
}

// ---- bodies

constexpr double kBallRadius = 0.12;  // [m]

Eigen::Matrix3Xd ballAt(const Eigen::Vector3d& center) {
  return avatar::sphereMesh(kBallRadius, 0.02).vertices.colwise() + center;
}

ExtremeScene curtainAndBall() {
  ExtremeScene scene = sceneOf(curtain());
  const avatar::TriangleMesh ball = avatar::sphereMesh(kBallRadius, 0.02);
  scene.setup.bodyFaces = ball.faces;
  scene.setup.numBodyVertices = ball.numVertices();
  return scene;
}

/// From a metre in front of the curtain at 10 m/s to a metre behind it.
ExtremeOutcome fastBody() {
  ExtremeScene scene = curtainAndBall();
  scene.body = [](int frame) {
    const double way = std::min(10.0 * kExtremeFrame * frame, 2.0);
    return ballAt({0.0, 0.0, 1.0 - way});
  };
  return play(scene);
}

/// Two metres through the curtain within one frame: at 60 m/s.
ExtremeOutcome teleportedBody() {
  ExtremeScene scene = curtainAndBall();
  scene.body = [](int frame) { return ballAt({0.0, 0.0, frame < 5 ? 1.0 : -1.0}); };
  scene.strainBound = kStillSwinging;
  return play(scene);
}

ExtremeOutcome bodyInsideCloth() {
  ExtremeScene scene = curtainAndBall();
  scene.body = [](int) { return ballAt({0.0, 0.0, 0.03}); };
  return play(scene);
}

/// Two boxes close until they touch with a sheet between them, and stay so.
ExtremeOutcome squeezingBodies() {
  ExtremeScene scene = sceneOf(curtain());
  const avatar::TriangleMesh box = avatar::boxMesh({0.3, 0.3, 0.2});
  scene.setup.bodyFaces.resize(3, 2 * box.numFaces());
  scene.setup.bodyFaces << box.faces, box.faces.array() + static_cast<int>(box.numVertices());
  scene.setup.numBodyVertices = 2 * box.numVertices();
  scene.bodyParts = true;
  scene.body = [box](int frame) {
    const double gap = std::max(0.0, 0.1 - 0.01 * frame);
    const Eigen::Vector3d shift(0.0, -0.05, 0.1 + gap);
    Eigen::Matrix3Xd both(3, 2 * box.numVertices());
    both << box.vertices.colwise() + shift,
        box.vertices.colwise() + Eigen::Vector3d(shift.x(), shift.y(), -shift.z());
    return both;
  };
  return play(scene);
}

// ---- pins

Eigen::Matrix3Xd pinsOf(const CaptureWorld& world) {
  const bullet_ext::ClothMesh& mesh = world.mesh(0);
  const Eigen::Matrix3Xd x = world.vertices(0);
  std::vector<int> pins;
  for (int v = 0; v < static_cast<int>(x.cols()); ++v)
    if (mesh.isPinned(mesh.solverFromInput[static_cast<std::size_t>(v)]))
      pins.push_back(v);
  return x(Eigen::all, pins);
}

/// Straight through its own axis, where for a moment all of the edge is in one point.
ExtremeOutcome halfTurnInOneFrame() {
  const ClothSheet ribbon{.width = 0.1, .height = 0.4};
  ExtremeScene scene = sceneOf(sheetOf(ribbon, {Pin("top"), Pin("bottom")}));
  scene.setup.selfContact = true;
  scene.beforeFrame = [](CaptureWorld& world, int frame) {
    Eigen::Matrix3Xd pins = pinsOf(world);
    for (Eigen::Index i = 0; frame == 5 && i < pins.cols(); ++i)
      if (pins(1, i) < 0.0)
        pins.col(i).x() *= -1.0;
    world.movePins(0, pins);
  };
  return play(scene);
}

ExtremeOutcome pinsMovedAMetre() {
  ExtremeScene scene = sceneOf(curtain());
  scene.beforeFrame = [](CaptureWorld& world, int frame) {
    Eigen::Matrix3Xd pins = pinsOf(world);
    if (frame == 5)
      pins.row(0).array() += 1.0;
    world.movePins(0, pins);
  };
  scene.strainBound = kStillSwinging;
  return play(scene);
}

// ---- meshes

/// A curtain with a row of vertices so near the next that triangles are much longer than high.
CaptureGarment needleCurtain(double altitude) {
  CaptureGarment garment = sheetOf({.width = 0.2, .height = 0.2}, {Pin("top")});
  double rowBelow = -1.0;
  double row = -1.0;
  for (const double y : garment.vertices.row(1))
    if (y < 0.0)
      row = std::max(row, y);
  for (const double y : garment.vertices.row(1))
    if (y < row - 1e-6)
      rowBelow = std::max(rowBelow, y);
  for (double& y : garment.vertices.row(1))
    if (std::abs(y - row) < 1e-6)
      y = rowBelow + altitude;
  return garment;
}

/// Needles that turn over stay so: their hinges, by then at half a turn, hold edges at some three
/// times their length.
ExtremeOutcome needles() {
  ExtremeScene scene = sceneOf(needleCurtain(2e-4));
  scene.strainBound = 4.0;
  return play(scene);
}

CaptureGarment oneTriangle() {
  CaptureGarment garment;
  garment.vertices.resize(3, 3);
  garment.vertices << 0.0, 0.02, 0.01, 0.0, 0.0, 0.017, 0.0, 0.0, 0.0;
  garment.faces = Eigen::Vector3i(0, 1, 2);
  garment.material = middleCloth();
  garment.mesh.pins = {2};
  return garment;
}

/// Six sheets in one garment that fall on a ball.
ExtremeOutcome disconnectedPieces() {
  constexpr int kPieces = 6;
  const avatar::TriangleMesh piece = makeSheet({.width = 0.1, .height = 0.1}).mesh;
  const Eigen::Matrix3d flat =
      Eigen::AngleAxisd(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitX()).toRotationMatrix();
  ExtremeScene scene = curtainAndBall();
  CaptureGarment& garment = scene.setup.garments[0];
  garment.mesh.pins.clear();
  garment.vertices.resize(3, kPieces * piece.numVertices());
  garment.faces.resize(3, kPieces * piece.numFaces());
  for (int i = 0; i < kPieces; ++i) {
    const Eigen::Vector3d shift(0.02 * i - 0.05, 0.15 + 0.02 * i, 0.01 * i);
    garment.vertices.middleCols(i * piece.numVertices(), piece.numVertices()) =
        (flat * piece.vertices).colwise() + shift;
    garment.faces.middleCols(i * piece.numFaces(), piece.numFaces()).array() =
        piece.faces.array() + static_cast<int>(i * piece.numVertices());
  }
  scene.body = [](int) { return ballAt(Eigen::Vector3d::Zero()); };
  return play(scene);
}

/// 256 vertices each way: a sail of 5 m.
ExtremeOutcome manyVertices() {
  ExtremeScene scene = sceneOf(sheetOf({.width = 5.1, .height = 4.4}, {Pin("top")}));
  scene.frames = 3;
  return play(scene);
}

// ---- forces

ExtremeOutcome withGravity(double gravity) {
  ExtremeScene scene = sceneOf(curtain());
  scene.setup.gravity = {0.0, -gravity, 0.0};
  // n rows of vertices that weigh m g each pull at the uppermost springs, of which two at 30
  // degrees to the vertical hold each vertex: 2 cos² 30° k/2 Δl = n m g. Twice that, because it
  // bounces.
  const bullet_ext::ClothMaterial material = middleCloth();
  constexpr double kRows = 24.0;
  constexpr double kEdge = 0.02;
  scene.strainBound = 0.1 + 2.0 * kRows * material.vertexMass * gravity /
                                (0.75 * material.stretchStiffness * kEdge);
  return play(scene);
}

// ---- values that are no numbers

ExtremeOutcome notANumberInRestShape() {
  CaptureGarment garment = curtain();
  garment.vertices(1, 7) = kNotANumber;
  return play(sceneOf(garment));
}

ExtremeOutcome notANumberInMaterial() {
  CaptureGarment garment = curtain();
  garment.material.torsionStiffness = kNotANumber;
  return play(sceneOf(garment));
}

ExtremeOutcome notANumberInState() {
  ExtremeScene scene = sceneOf(curtain());
  scene.beforeFrame = [](CaptureWorld& world, int frame) {
    Eigen::Matrix3Xd x = world.vertices(0);
    if (frame != 3)
      return;
    x(2, 5) = kNotANumber;
    world.setState(0, x, world.velocities(0));
  };
  return play(scene);
}

ExtremeOutcome notANumberInPins() {
  ExtremeScene scene = sceneOf(curtain());
  scene.beforeFrame = [](CaptureWorld& world, int frame) {
    Eigen::Matrix3Xd pins = pinsOf(world);
    if (frame == 3)
      pins(0, 0) = kNotANumber;
    world.movePins(0, pins);
  };
  return play(scene);
}

ExtremeOutcome notANumberInBody() {
  ExtremeScene scene = curtainAndBall();
  scene.body = [](int frame) { return ballAt({frame == 3 ? kNotANumber : 0.0, 0.0, 0.5}); };
  return play(scene);
}

}  // namespace

std::vector<ExtremeCase> extremeCases() {
  const auto stable = Verdict::kStable;
  const auto refused = Verdict::kRefused;
  return {
      {"stretch_1e6", "k = 1e6 N/m", stable, false, [] { return play(curtainOf(1e6, 0.05)); }},
      {"torsion_10", "w = 10 N m/rad", stable, false, [] { return play(curtainOf(1e3, 10.0)); }},
      {"stiff_and_light",
       "k = 1e6, w = 10 at 0.2 kg/m2: substeps beyond single precision",
       refused,
       true,
       [] { return stiffAndLight(bullet_ext::Integrator::kSemiImplicitEuler); }},
      {"stiff_and_light_implicit",
       "the same, implicitly",
       stable,
       false,
       [] { return stiffAndLight(bullet_ext::Integrator::kImplicit); }},
      {"too_few_substeps", "k = 1e6 with 100 substeps", refused, true, tooFewSubsteps},
      {"fast_body", "a ball at 10 m/s through a curtain", stable, true, fastBody},
      {"body_teleport", "a ball 2 m on within a frame", stable, false, teleportedBody},
      {"body_inside", "a ball that is in the cloth from the start", stable, true, bodyInsideCloth},
      {"squeezing_bodies", "two boxes close on a sheet", stable, true, squeezingBodies},
      {"half_turn", "180 degrees of twist in a frame", stable, false, halfTurnInOneFrame},
      {"pins_moved_1m", "all pins 1 m aside in a frame", stable, true, pinsMovedAMetre},
      {"needle_triangles", "triangles 0.2 mm high, 20 mm long", stable, false, needles},
      {"zero_area_triangles",
       "triangles without height",
       refused,
       true,
       [] { return play(sceneOf(needleCurtain(0.0))); }},
      {"one_triangle",
       "a garment of one",
       stable,
       true,
       [] { return play(sceneOf(oneTriangle())); }},
      {"disconnected_pieces", "six sheets as one garment", stable, true, disconnectedPieces},
      {"64k_vertices", "a sail of 65 thousand vertices", stable, false, manyVertices},
      {"no_gravity", "g = 0", stable, true, [] { return withGravity(0.0); }},
      {"gravity_100", "g = 100 m/s2", stable, true, [] { return withGravity(100.0); }},
      {"nan_rest_shape", "a vertex is no number", refused, true, notANumberInRestShape},
      {"nan_material", "w is no number", refused, true, notANumberInMaterial},
      {"nan_state", "a position is no number", refused, true, notANumberInState},
      {"nan_pin", "a pin's target is no number", refused, true, notANumberInPins},
      {"nan_body", "the skin is no number in a frame", refused, true, notANumberInBody}};
}

std::vector<ExtremeResult> runAll(
    const std::vector<ExtremeCase>& cases, int threads, const std::function<void()>& done) {
  using Clock = std::chrono::steady_clock;
  std::vector<ExtremeResult> results(cases.size());
  parallelFor(static_cast<long>(cases.size()), threads, [&](long i) {
    const ExtremeCase& extreme = cases[static_cast<std::size_t>(i)];
    const Clock::time_point start = Clock::now();
    const ExtremeOutcome outcome = extreme.run();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    results[static_cast<std::size_t>(i)] = {
        extreme.name, extreme.what, extreme.expected, outcome, seconds};
    done();
  });
  return results;
}

}  // namespace simulcap
