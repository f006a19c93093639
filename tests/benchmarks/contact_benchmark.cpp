#include "bullet_ext/core/body_contact.h"
#include "bullet_ext/core/cloth_stepper.h"
#include "tests/benchmarks/benchmark.h"
#include "tests/bullet_ext/core/moving_bodies.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <string>

namespace {

using namespace bullet_ext;  // NOLINT(google-build-using-namespace)

constexpr int kSubsteps = 100;
constexpr double kFrame = 1.0 / 30.0;
constexpr double kSubstep = kFrame / kSubsteps;

constexpr test::Figure kFine = {64, 76, 20, 49};

using Seconds = std::chrono::duration<double>;

/// What contact and forces took [ns per vertex and substep]: the least disturbed of all frames.
struct Cost {
  double contact = 1e9, mean = 0.0, force = 1e9, surface = 1e9;
};

void dressed(const std::string& name, const test::TriangleMesh& garment, int frames) {
  const test::TriangleMesh first = test::figureAt(0.0, kFine);
  const ClothMesh mesh = buildClothMesh(garment.vertices, garment.faces, {.damping = 1.0});
  BodySurface surface(first.faces, first.vertices.cols());
  BodyContact contact(mesh, surface, contactFor(mesh.material));
  ClothStepper stepper(mesh);
  const Gravity gravity(mesh);
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  ClothState state = restState(mesh);
  const double perVertex = 1e9 / (static_cast<double>(mesh.numVertices()) * kSubsteps);
  Cost cost;
  ContactCounts counts;
  for (int frame = 0; frame < frames; ++frame) {
    const auto start = std::chrono::steady_clock::now();
    const Eigen::Matrix3Xd from = test::figureAt(kFrame * frame, kFine).vertices;
    const Eigen::Matrix3Xd to = test::figureAt(kFrame * (frame + 1), kFine).vertices;
    const auto posed = std::chrono::steady_clock::now();
    surface.setFrame(from, to, kFrame);
    const auto set = std::chrono::steady_clock::now();
    contact.beginFrame(state, kSubstep, kSubsteps);
    Seconds inContact = std::chrono::steady_clock::now() - set;
    Seconds inForces{0.0};
    for (int substep = 0; substep < kSubsteps; ++substep) {
      const auto before = std::chrono::steady_clock::now();
      stepper.step(state, forces);
      const auto between = std::chrono::steady_clock::now();
      const ContactCounts done = contact.resolve(state, substep);
      inContact += std::chrono::steady_clock::now() - between;
      inForces += between - before;
      if (frame > 0) {
        counts += done;
      }
    }
    static_cast<void>(start);
    cost.surface = std::min(cost.surface, Seconds(set - posed).count() * perVertex);
    cost.force = std::min(cost.force, inForces.count() * perVertex);
    if (frame > 0) {
      cost.contact = std::min(cost.contact, inContact.count() * perVertex);
      cost.mean += inContact.count() * perVertex / (frames - 1);
    }
  }
  const double all = static_cast<double>(mesh.numVertices()) * kSubsteps * (frames - 1);
  std::printf(
      "%-12s %5d vertices, %d triangles: contact min %6.1f mean %6.1f, forces min %5.1f, surface "
      "min "
      "%5.1f ns per vertex and substep\n"
      "    per substep: contacts %.0f; of all vertices nearest tests %.3f, listed triangles %.3f; "
      "per frame: rebuilds of 8 %.0f, tree queries %.0f; finite %d\n",
      name.c_str(),
      static_cast<int>(mesh.numVertices()),
      static_cast<int>(first.faces.cols()),
      cost.contact,
      cost.mean,
      cost.force,
      cost.surface,
      static_cast<double>(counts.contacts) / kSubsteps / (frames - 1),
      static_cast<double>(counts.nearestTests) / all,
      static_cast<double>(counts.listTests) / all,
      static_cast<double>(counts.listRebuilds) / (frames - 1),
      static_cast<double>(counts.treeQueries) / (frames - 1),
      isFinite(state) ? 1 : 0);
}

}  // namespace

/// Time per vertex and substep of contact with a moving body, beside that of the cloth's forces in
/// the same run.
int main() {
  benchmark::reportCalibration();
  dressed("loose dress", test::looseDress(52, 58), 16);
  dressed("tight tube", test::tightTube(52, 58, 0.002), 16);
  benchmark::reportCalibration();
  return 0;
}
