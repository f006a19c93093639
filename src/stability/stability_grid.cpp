#include "src/stability/stability_grid.h"

#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/energy_balance.h"
#include "bullet_ext/core/stability.h"
#include "src/program/parallel_for.h"
#include "src/simulation/procedural_cloth.h"
#include "src/simulation/substep_safety.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>

namespace simulcap {
namespace {

using bullet_ext::ClothMesh;
using bullet_ext::ClothState;

/// Across the sheet, which so falls and swings like a flag.
const Eigen::Vector3d kGravity = {0.0, 0.0, -9.81};  // [m/s²]

constexpr int kSmallSheet = 8;  // edges each way
constexpr int kLargeSheet = 24;

double altitude(const Eigen::Matrix3d& corners) {
  const Eigen::Vector3d a = corners.col(1) - corners.col(0);
  const Eigen::Vector3d b = corners.col(2) - corners.col(1);
  const double longest = std::max({a.norm(), b.norm(), (a + b).norm(), 1e-12});
  return a.cross(b).norm() / longest;
}

double leastAltitude(const ClothMesh& mesh, const ClothState& state) {
  double least = 1.0;
  for (const auto& face : mesh.faces.colwise()) {
    const Eigen::Matrix3d now = state.positions(Eigen::all, face).topRows<3>().cast<double>();
    least = std::min(least, altitude(now) / altitude(mesh.restPositions(Eigen::all, face)));
  }
  return least;
}

/// One cloth in runs with different substeps.
class TrialRun {
 public:
  TrialRun(const ClothMesh& mesh, bool gravity)
      : mesh_(mesh), hangs_(gravity), stepper_(mesh), weight_(mesh, kGravity) {
    constexpr double kShake = 1e-4;  // of an edge: far within what is linear
    start_ = shakenState(mesh, kShake * mesh.springRestLengths.minCoeff());
    startEnergy_ = energy(start_);
  }

  SubstepTrial run(double substep, int count) {
    constexpr int kLookEvery = 25;
    bullet_ext::SubstepOptions options = stepper_.substep();
    options.duration = substep;
    stepper_.setSubstep(options);
    const std::array<const bullet_ext::ExternalForce*, 1> forces = {&weight_};
    const std::span<const bullet_ext::ExternalForce* const> acting(forces.data(), hangs_ ? 1 : 0);
    SubstepTrial trial{.substep = substep, .held = true};
    ClothState state = start_;
    for (int i = 1; i <= count && trial.held; ++i) {
      stepper_.step(state, acting);
      if (i % kLookEvery != 0 && i < count)
        continue;
      trial.held = isPlausible(state);
      if (trial.held)
        trial.leastAltitude = std::min(trial.leastAltitude, leastAltitude(mesh_, state));
    }
    return trial;
  }

 private:
  double energy(const ClothState& state) const {
    return bullet_ext::kineticEnergy(mesh_, state) + bullet_ext::elasticEnergy(mesh_, state);
  }

  /// Near its limit semi-implicit Euler swings between E/(1 + r) and E/(1 − r) in the highest mode,
  /// r being the substep's part of the limit: what is started with gets a factor far beyond that,
  /// which an unstable mode passes in some dozens of substeps. What gravity has put in gets two.
  bool isPlausible(const ClothState& state) const {
    constexpr double kSwing = 1e4;
    constexpr double kWorkFactor = 2.0;
    const Eigen::Matrix3Xd way = (state.positions - start_.positions).topRows<3>().cast<double>();
    const double work = hangs_ ? kGravity.dot(way * mesh_.masses) : 0.0;
    return isFinite(state) &&
           energy(state) <= kSwing * startEnergy_ + kWorkFactor * std::max(0.0, work);
  }

  const ClothMesh& mesh_;
  bool hangs_;
  bullet_ext::ClothStepper stepper_;
  bullet_ext::Gravity weight_;
  ClothState start_;
  double startEnergy_ = 0.0;  // [J]
};

/// Substeps in parts of the prediction, and how many of them to do.
struct Bisection {
  double accepted = kAskedSafety;
  double lowest = 0.1;
  double highest = 1.3;
  int steps = 8;
};

/// The accepted substep first: it decides on which side the limit is.
template <typename Run>
ObservedLimit bisected(double predicted, const Bisection& bisection, const Run& run) {
  ObservedLimit limit;
  double holds = bisection.lowest;
  double fails = bisection.highest;
  double part = bisection.accepted;
  for (int i = 0; i < bisection.steps; ++i) {
    limit.trials.push_back(run(part * predicted));
    if (limit.trials.back().held) {
      holds = part;
      limit.substep = std::max(limit.substep, part * predicted);
    } else {
      fails = part;
    }
    part = 0.5 * (holds + fails);
  }
  return limit;
}

std::optional<GuardedDrop> dropped(const GridCloth& cloth, double seconds) {
  constexpr double kFrame = 1.0 / 30.0;  // [s]
  constexpr int kMostSubsteps = 1000;
  bullet_ext::ClothSimulation simulation;
  simulation.addCloth(gridSheet(cloth, kLargeSheet));
  const double accepted =
      bullet_ext::stability(simulation.mesh(0), {.safety = kAskedSafety}).largestSubstep;
  GuardedDrop drop{.substeps = bullet_ext::substepsFor(kFrame, accepted)};
  if (drop.substeps > kMostSubsteps)
    return std::nullopt;
  const bullet_ext::Gravity weight(simulation.mesh(0), kGravity);
  simulation.addForce(0, weight);
  for (int frame = 0; frame < std::lround(seconds / kFrame); ++frame) {
    const bullet_ext::FrameReport report = simulation.advance({kFrame, drop.substeps});
    drop.redone += report.redone;
    drop.givenUp += report.stable ? 0 : 1;
  }
  return drop;
}

}  // namespace

StabilityGrid StabilityGrid::quick() {
  return {
      .stretch = {300, 1e6},
      .torsion = {0.01, 10},
      .vertexMass = {0.001},
      .edgeLength = {0.02},
      .hangingSeconds = 0.1,
      .dropSeconds = 0.3};
}

void StabilityGrid::validate() const {
  if (stretch.empty() || torsion.empty() || vertexMass.empty() || edgeLength.empty())
    throw std::invalid_argument("StabilityGrid: each of its lists needs a value");
  if (!(hangingSeconds >= 0.01 && hangingSeconds <= 10.0))
    throw std::invalid_argument("StabilityGrid: hangingSeconds must be within [0.01, 10] s");
  if (!(dropSeconds >= 0.05 && dropSeconds <= 10.0))
    throw std::invalid_argument("StabilityGrid: dropSeconds must be within [0.05, 10] s");
}

std::vector<GridCloth> StabilityGrid::cloths() const {
  std::vector<GridCloth> cloths;
  for (const double mass : vertexMass)
    for (const double edge : edgeLength)
      for (const double w : torsion)
        for (const double k : stretch)
          cloths.push_back({k, w, mass, edge});
  return cloths;
}

double GridFinding::accepted() const {
  return kAskedSafety * predicted;
}

bool GridFinding::acceptedHeld() const {
  for (const ObservedLimit* limit : {&shaken, &hanging})
    for (const SubstepTrial& trial : limit->trials)
      if (!trial.held && trial.substep <= accepted())
        return false;
  return !drop || drop->givenUp == 0;
}

bool GridFinding::collapsed() const {
  constexpr double kHalf = 0.5;
  return std::any_of(hanging.trials.begin(), hanging.trials.end(), [&](const SubstepTrial& trial) {
    return trial.substep <= accepted() && trial.leastAltitude < kHalf;
  });
}

double GridFinding::error() const {
  const double shakenError = std::abs(shaken.substep / predicted - 1.0);
  return collapsed() ? shakenError
                     : std::max(shakenError, std::abs(hanging.substep / predicted - 1.0));
}

ClothMesh gridSheet(const GridCloth& cloth, int edges) {
  ClothSheet sheet;
  sheet.width = edges * cloth.edgeLength;
  sheet.height = edges * std::sqrt(0.75) * cloth.edgeLength;
  sheet.edgeLength = cloth.edgeLength;
  const ProceduralCloth piece = makeSheet(sheet);
  bullet_ext::ClothMaterial material;
  material.stretchStiffness = cloth.stretch;
  material.torsionStiffness = cloth.torsion;
  material.vertexMass = cloth.vertexMass;
  material.damping = 0.0;
  return bullet_ext::buildClothMesh(
      piece.mesh.vertices,
      piece.mesh.faces,
      material,
      {.pins = pinnedVertices(piece, {Pin("top_left"), Pin("top_right")})});
}

ClothState shakenState(const ClothMesh& mesh, double amount) {
  ClothState state = restState(mesh);
  for (Eigen::Index i = 0; i < state.positions.cols(); ++i) {
    if (mesh.isPinned(i))
      continue;
    for (int row = 0; row < 3; ++row) {
      // A chirp: its phase runs through the circle ever faster, so that it resembles no mode.
      const auto phase = static_cast<double>(3 * i + row + 1);
      state.positions(row, i) += static_cast<float>(amount * std::sin(17.0 * phase * phase));
    }
  }
  return state;
}

GridFinding observe(const GridCloth& cloth, double hangingSeconds, double dropSeconds) {
  // At 1.003 of the limit an unstable mode grows by √(8 · 0.003) in each, 1e26 times in all.
  constexpr int kSubsteps = 400;
  const ClothMesh mesh = gridSheet(cloth, kSmallSheet);
  GridFinding finding{.cloth = cloth};
  finding.predicted =
      bullet_ext::stability(mesh, {.safety = 1.0, .tolerance = 1e-4}).largestSubstep;
  TrialRun shaken(mesh, false);
  finding.shaken = bisected(
      finding.predicted, {}, [&](double substep) { return shaken.run(substep, kSubsteps); });
  TrialRun hanging(mesh, true);
  finding.hanging = bisected(finding.predicted, {.steps = 6}, [&](double substep) {
    return hanging.run(substep, static_cast<int>(std::ceil(hangingSeconds / substep)));
  });
  finding.drop = dropped(cloth, dropSeconds);
  return finding;
}

std::vector<GridFinding> observe(
    const StabilityGrid& grid, int threads, const std::function<void()>& done) {
  grid.validate();
  const std::vector<GridCloth> cloths = grid.cloths();
  std::vector<GridFinding> findings(cloths.size());
  parallelFor(static_cast<long>(cloths.size()), threads, [&](long i) {
    const auto at = static_cast<std::size_t>(i);
    findings[at] = observe(cloths[at], grid.hangingSeconds, grid.dropSeconds);
    done();
  });
  return findings;
}

}  // namespace simulcap
