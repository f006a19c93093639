#include "bullet_ext/core/body_contact.h"
#include "bullet_ext/core/cloth_stepper.h"
#include "tests/benchmarks/benchmark.h"
#include "tests/bullet_ext/core/moving_bodies.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace {

using namespace bullet_ext;  // NOLINT(google-build-using-namespace)

constexpr int kSubsteps = 100;
constexpr double kFrame = 1.0 / 30.0;
constexpr double kSubstep = kFrame / kSubsteps;

constexpr test::Figure kFine = {64, 76, 20, 49};

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct FrameCost {
  double contact = 1e9, forces = 1e9, surface = 1e9;  ///< [s]
};

/// One run of some frames; every frame's cost replaces a higher one of an earlier run.
ContactCounts simulate(const ClothMesh& mesh, std::vector<FrameCost>& costs) {
  BodySurface surface(test::figureAt(0.0, kFine).faces, test::figureAt(0.0, kFine).vertices.cols());
  BodyContact contact(mesh, surface, contactFor(mesh.material));
  ClothStepper stepper(mesh);
  const Gravity gravity(mesh);
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  ClothState state = restState(mesh);
  ContactCounts counts;
  for (std::size_t frame = 0; frame < costs.size(); ++frame) {
    const double time = kFrame * static_cast<double>(frame);
    const Eigen::Matrix3Xd from = test::figureAt(time, kFine).vertices;
    const Eigen::Matrix3Xd to = test::figureAt(time + kFrame, kFine).vertices;
    FrameCost cost = {0.0, 0.0, 0.0};
    const auto begin = Clock::now();
    surface.setFrame(from, to, kFrame);
    cost.surface = secondsSince(begin);
    contact.beginFrame(state, kSubstep, kSubsteps);
    cost.contact = secondsSince(begin) - cost.surface;
    for (int substep = 0; substep < kSubsteps; ++substep) {
      const auto before = Clock::now();
      stepper.step(state, forces);
      const double stepped = secondsSince(before);
      counts += contact.resolve(state, substep);
      cost.contact += secondsSince(before) - stepped;
      cost.forces += stepped;
    }
    FrameCost& least = costs[frame];
    least.contact = std::min(least.contact, cost.contact);
    least.forces = std::min(least.forces, cost.forces);
    least.surface = std::min(least.surface, cost.surface);
  }
  return counts;
}

void dressed(const std::string& name, const test::TriangleMesh& garment) {
  constexpr int kRuns = 5;
  constexpr int kFrames = 15;  // one swing of the arms
  const ClothMesh mesh = buildClothMesh(garment.vertices, garment.faces, {.damping = 1.0});
  std::vector<FrameCost> costs(kFrames);
  ContactCounts counts;
  for (int run = 0; run < kRuns; ++run) {
    counts = simulate(mesh, costs);
  }
  FrameCost sum = {0.0, 0.0, 0.0};
  for (const FrameCost& cost : costs) {
    sum.contact += cost.contact;
    sum.forces += cost.forces;
    sum.surface += cost.surface;
  }
  const double substeps = kFrames * kSubsteps;
  const double all = static_cast<double>(mesh.numVertices()) * substeps;
  std::printf(
      "%-12s %d vertices: contact %5.1f, the body's boxes %4.1f, forces %5.1f ns per vertex and "
      "substep\n    %.0f contacts, %.0f nearest tests, %.0f listed triangles, %.2f lists renewed "
      "per substep; %lld tree queries\n",
      name.c_str(),
      static_cast<int>(mesh.numVertices()),
      1e9 * sum.contact / all,
      1e9 * sum.surface / all,
      1e9 * sum.forces / all,
      static_cast<double>(counts.contacts) / substeps,
      static_cast<double>(counts.nearestTests) / substeps,
      static_cast<double>(counts.listTests) / substeps,
      static_cast<double>(counts.listRebuilds) / substeps,
      static_cast<long long>(counts.treeQueries));
}

}  // namespace

/// Time per vertex and substep of contact with a moving body, beside that of the cloth's forces in
/// the same run: the sum over frames of the least of several equal runs.
int main() {
  benchmark::reportCalibration();
  dressed("loose dress", test::looseDress(52, 58));
  dressed("tight tube", test::tightTube(52, 58, 0.002));
  benchmark::reportCalibration();
  return 0;
}
