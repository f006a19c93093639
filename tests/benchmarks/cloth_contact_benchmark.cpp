#include "tests/benchmarks/benchmark.h"
#include "tests/bullet_ext/core/contact_scenes.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>
#include <time.h>

namespace {

using bullet_ext::ContactCounters;
using bullet_ext::test::ContactScene;

/// Processor time of this program [s]: other programs on the machine don't count.
double processorSeconds() {
  timespec time = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Runs a scene frame by frame; reports the mean and the worst frame, and what was done.
void runScene(const std::string& name, const std::function<void(ContactScene&)>& make, int frames) {
  ContactScene scene;
  make(scene);
  scene.start();
  double forces = 0.0;
  double contact = 0.0;
  double worst = 0.0;
  int crossedFrames = 0;
  for (int f = 0; f < frames; ++f) {
    double forcesOfFrame = 0.0;
    const double start = processorSeconds();
    scene.beginFrame();
    for (int i = 0; i < bullet_ext::test::kSubstepsPerFrame; ++i) {
      const double before = processorSeconds();
      scene.integrate();
      forcesOfFrame += processorSeconds() - before;
      scene.contact().resolve(scene.states(), i);
    }
    const double total = processorSeconds() - start;
    forces += forcesOfFrame;
    contact += total - forcesOfFrame;
    worst = std::max(worst, total - forcesOfFrame);
    crossedFrames += scene.crossings() > 0 ? 1 : 0;
  }
  const double items =
      1e-9 * static_cast<double>(scene.numVertices()) * bullet_ext::test::kSubstepsPerFrame;
  const ContactCounters& counters = scene.contact().counters();
  const double substeps = static_cast<double>(counters.substeps * scene.numVertices());
  std::printf(
      "%-24s %6ld vertices  forces %5.1f  contact %6.1f  worst frame %6.1f ns per vertex-substep, "
      "%d of %d frames crossed\n",
      name.c_str(),
      static_cast<long>(scene.numVertices()),
      forces / items / frames,
      contact / items / frames,
      worst / items,
      crossedFrames,
      frames);
  std::printf(
      "%24s per vertex-substep: listed %.3f  looked at %.3f  distances %.3f  contacts %.3f; lists "
      "%.4f; continuous tests %ld, approaches %ld, zones %ld\n",
      "",
      static_cast<double>(counters.pairsListed) / substeps,
      static_cast<double>(counters.pairsFiltered) / substeps,
      static_cast<double>(counters.distances) / substeps,
      static_cast<double>(counters.contacts) / substeps,
      static_cast<double>(counters.listBuilds) / substeps,
      static_cast<long>(counters.continuousTests),
      static_cast<long>(counters.approaches),
      static_cast<long>(counters.zones));
}

}  // namespace

/// Time of contacts between and within garments beside that of their springs and hinges. With an
/// argument only of the scenes whose name contains it, for profiling.
int main(int argc, char** argv) {
  namespace test = bullet_ext::test;
  const std::string wanted = argc > 1 ? argv[1] : "";
  const auto run = [&](const std::string& name, const auto& make, int frames) {
    if (name.find(wanted) != std::string::npos) {
      runScene(name, make, frames);
    }
  };
  benchmark::reportCalibration();
  run(
      "two free tubes", [](ContactScene& s) { test::concentricTubes(s, 64, false); }, 6);
  run(
      "outer tube over inner", [](ContactScene& s) { test::concentricTubes(s, 64, true); }, 6);
  run(
      "ribbon, 6 turns", [](ContactScene& s) { test::twistedRibbon(s, 80, 6.0, 1.6); }, 60);
  run(
      "dropped sheet", [](ContactScene& s) { test::droppedSheet(s, 48); }, 20);
  run(
      "falling sheets", [](ContactScene& s) { test::fallingSheets(s, 40); }, 12);
  benchmark::reportCalibration();
  return 0;
}
