#include "src/stability/extreme_run.h"

#include "avatar/geometry/closest_point.h"
#include "bullet_ext/core/implicit_stepper.h"
#include "bullet_ext/core/stability.h"
#include "src/simulation/substep_safety.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace simulcap {
namespace {

constexpr int kPaperSubsteps = 100;
constexpr double kEnergyFactor = 1.1;  // SimulationOptions::energyFactor, over all frames
constexpr double kNoEnergy = 1e-6;     // [J]: rounding, where nothing moves

/// As the program chooses them for a scene that doesn't say.
int chosenSubsteps(const bullet_ext::CaptureWorld& world, bool implicit) {
  if (implicit)
    return bullet_ext::substepsFor(kExtremeFrame, bullet_ext::ImplicitOptions{}.duration);
  int substeps = kPaperSubsteps;
  for (int i = 0; i < world.numGarments(); ++i) {
    const double safe =
        bullet_ext::stability(world.mesh(i), {.safety = kChosenSafety}).largestSubstep;
    if (std::isfinite(safe))
      substeps = std::max(substeps, bullet_ext::substepsFor(kExtremeFrame, safe));
  }
  return substeps;
}

/// Largest strain of an edge, longer or shorter; not finite after an explosion.
double largestStrain(const bullet_ext::CaptureWorld& world) {
  double strain = 0.0;
  for (int i = 0; i < world.numGarments(); ++i) {
    const bullet_ext::ClothMesh& mesh = world.mesh(i);
    const Eigen::Matrix3Xd x = bullet_ext::toSolverOrder(mesh, world.vertices(i));
    if (!x.allFinite() || !world.velocities(i).allFinite())
      return std::nan("");
    for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
      const double length = (x.col(mesh.springs(1, s)) - x.col(mesh.springs(0, s))).norm();
      strain = std::max(strain, std::abs(length / mesh.springRestLengths[s] - 1.0));
    }
  }
  return strain;
}

int countUnderSkin(
    const bullet_ext::CaptureWorld& world,
    const Eigen::Matrix3Xd& skin,
    const Eigen::Matrix3Xi& faces) {
  const avatar::SignedDistance distance(avatar::MeshView(skin, faces));
  int count = 0;
  for (int i = 0; i < world.numGarments(); ++i) {
    const Eigen::Matrix3Xd vertices = world.vertices(i);
    for (const auto& x : vertices.colwise())
      count += distance(x).distance < 0.0 ? 1 : 0;
  }
  return count;
}

/// A scene in motion.
class ExtremePlay {
 public:
  explicit ExtremePlay(const ExtremeScene& scene) : scene_(scene), world_(scene.setup) {
    for (int i = 0; i < world_.numGarments(); ++i)
      outcome_.vertices += static_cast<int>(world_.mesh(i).numVertices());
    if (scene.body)
      world_.placeBody(scene.body(0));
    const bool implicit = scene.setup.simulation.integrator == bullet_ext::Integrator::kImplicit;
    outcome_.asked = chosenSubsteps(world_, implicit);
  }

  ExtremeOutcome outcome() {
    for (int frame = 1; frame <= scene_.frames; ++frame) {
      try {
        advance(frame);
      } catch (const std::invalid_argument& error) {
        outcome_.reason = error.what();
      }
      strain_ = largestStrain(world_);
      if (!std::isfinite(strain_)) {
        outcome_.reason = "not finite after frame " + std::to_string(frame);
        return outcome_;
      }
      outcome_.largestStrain = std::max(outcome_.largestStrain, strain_);
    }
    world_.castRay({0.01, 10.0, 0.02}, {0.0, -10.0, 0.0});  // must return whatever the cloth is
    outcome_.finalStrain = strain_;
    judge();
    return outcome_;
  }

 private:
  void advance(int frame) {
    if (scene_.beforeFrame)
      scene_.beforeFrame(world_, frame);
    if (scene_.body)
      skin_ = scene_.body(frame);
    const bullet_ext::FrameReport report = world_.step(skin_, kExtremeFrame, outcome_.asked);
    ++outcome_.frames;
    outcome_.substeps = std::max(outcome_.substeps, report.substeps);
    outcome_.redone += report.redone;
    if (outcome_.frames == 1)
      energyGiven_ = report.energy.before;
    energyGiven_ += report.energy.available() - report.energy.before;
    energy_ = report.energy.after;
    if (report.stable)
      return;
    ++outcome_.givenUp;
    givenUpLate_ = givenUpLate_ || 3 * frame > 2 * scene_.frames;
  }

  void judge() {
    if (scene_.body && !scene_.bodyParts)
      outcome_.underSkin = countUnderSkin(world_, skin_, scene_.setup.bodyFaces);
    std::string wrong;
    if (givenUpLate_)
      wrong = "frames of the last third blew up even with the most substeps";
    else if (energy_ > kEnergyFactor * energyGiven_ + kNoEnergy)
      wrong = "it has more energy than it was ever given";
    else if (outcome_.finalStrain > scene_.strainBound)
      wrong = "an edge is strained beyond what its load explains";
    else if (outcome_.underSkin.value_or(0) > 0)
      wrong = "vertices are under the skin";
    if (!wrong.empty())
      outcome_.reason = wrong;
    else
      outcome_.verdict = outcome_.reason.empty() ? Verdict::kStable : Verdict::kRefused;
  }

  const ExtremeScene& scene_;
  bullet_ext::CaptureWorld world_;
  Eigen::Matrix3Xd skin_ = Eigen::Matrix3Xd::Zero(3, 0);  // at the frame's end [m]
  double energyGiven_ = 0.0;  // at the start and by gravity, pins and contact, at most [J]
  double energy_ = 0.0;       // [J]
  double strain_ = 0.0;
  bool givenUpLate_ = false;
  ExtremeOutcome outcome_;
};

}  // namespace

const char* nameOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kStable:
      return "stable";
    case Verdict::kRefused:
      return "refused";
    default:
      return "UNSTABLE";
  }
}

ExtremeOutcome play(const ExtremeScene& scene) {
  try {
    return ExtremePlay(scene).outcome();
  } catch (const std::invalid_argument& error) {
    ExtremeOutcome refused;
    refused.verdict = Verdict::kRefused;
    refused.reason = error.what();
    return refused;
  }
}

}  // namespace simulcap
