#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/stability.h"
#include "tests/benchmarks/benchmark.h"
#include "tests/bullet_ext/core/cloth_shapes.h"

#include <algorithm>
#include <array>
#include <string>

namespace {

using namespace bullet_ext;  // NOLINT(google-build-using-namespace)

/// A square sheet hanging from two corners: wide hinge angles, no contact.
ClothMesh hangingSheet(int side) {
  return test::clothOf(
      test::equilateralSheet(side, side, 0.02),
      {.damping = 1.0},
      {.pins = {side * (side - 1), side * side - 1}});
}

void stepping(const std::string& name, int side, const StepperOptions& options) {
  ClothStepper stepper(hangingSheet(side), options);
  const Gravity gravity(stepper.mesh(), {0.0, -9.81, 3.0});
  const std::array<const ExternalForce*, 1> forces = {&gravity};
  ClothState state = restState(stepper.mesh());
  const int substeps = std::max(4, 400000 / (side * side));
  const auto run = [&] {
    for (int i = 0; i < substeps; ++i) {
      stepper.step(state, forces);
    }
  };
  run();
  benchmark::report(
      name + ", " + std::to_string(side * side) + " vertices",
      benchmark::measure(9, run),
      static_cast<double>(substeps) * side * side);
}

}  // namespace

/// Time per vertex and substep of springs, hinges, gravity and integration.
int main() {
  benchmark::reportCalibration();
  for (const int side : {32, 64, 128, 256}) {
    stepping("portable", side, {.kernels = ClothKernels::kPortable});
    if (wideKernelsSupported()) {
      stepping("wide", side, {.kernels = ClothKernels::kWide});
      stepping("wide, 2 threads", side, {.kernels = ClothKernels::kWide, .threads = 2});
    }
  }
  benchmark::report("largest substep, 4096 vertices", benchmark::measure(3, [] {
                      benchmark::keep(stability(hangingSheet(64)).iterations);
                    }));
  benchmark::reportCalibration();
  return 0;
}
