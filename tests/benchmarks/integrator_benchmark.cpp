#include "bullet_ext/core/cloth_hessian.h"
#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/implicit_stepper.h"
#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/stability.h"
#include "bullet_ext/core/torsion_force.h"
#include "tests/benchmarks/benchmark.h"
#include "tests/bullet_ext/core/cloth_shapes.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>

/// Error against run time of ways to integrate stiff light cloth: what ImplicitStepper was chosen
/// by. The ways that lost are here alone.
namespace {

using namespace bullet_ext;  // NOLINT(google-build-using-namespace)
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kTime = 0.25;  ///< later, errors of any method grow to the size of the cloth
const Vector3d kAcceleration = {0.0, -9.81, 3.0};

struct Motion {
  Matrix3Xd positions, velocities;
};

/// One step of duration dt of a method in double.
using StepInDouble = std::function<void(Motion&, double dt)>;

Matrix3Xd accelerations(const ClothMesh& mesh, const Matrix3Xd& x) {
  Matrix3Xd forces = kAcceleration * mesh.masses.transpose();
  addStretchForces<double>(mesh, x, forces);
  addTorsionForces<double>(mesh, x, forces);
  return forces * mesh.inverseMasses.asDiagonal();
}

void semiImplicitEuler(const ClothMesh& mesh, Motion& motion, double dt) {
  motion.velocities += dt * accelerations(mesh, motion.positions);
  motion.positions += dt * motion.velocities;
}

/// Backward Euler, linearised (Baraff and Witkin 1998): one solve.
void backwardEuler(const ClothMesh& mesh, ClothHessian& hessian, Motion& motion, double dt) {
  const Matrix3Xd guess = motion.positions + dt * motion.velocities;
  hessian.factorize(guess, dt);
  const Matrix3Xd forces = accelerations(mesh, guess) * mesh.masses.asDiagonal();
  const Matrix3Xd correction = hessian.solve(forces);
  motion.velocities += correction / dt;
  motion.positions = guess + correction;
}

struct Constraint {
  double value;       ///< C
  double compliance;  ///< α/dt²
};

/// C ← 0 as far as its compliance allows (Macklin et al. 2016), one visit.
void relax(
    const ClothMesh& mesh,
    const auto& vertices,
    const auto& gradient,
    const Constraint& constraint,
    Matrix3Xd& x) {
  double weight = constraint.compliance;
  for (Eigen::Index i = 0; i < vertices.size(); ++i) {
    weight += mesh.inverseMasses[vertices[i]] * gradient.col(i).squaredNorm();
  }
  for (Eigen::Index i = 0; i < vertices.size(); ++i) {
    const int v = vertices[i];
    x.col(v) -= mesh.inverseMasses[v] * constraint.value / weight * gradient.col(i);
  }
}

/// Extended position based dynamics with small steps (Macklin et al. 2019): one Gauss–Seidel pass.
void xpbd(const ClothMesh& mesh, Motion& motion, double dt) {
  const Matrix3Xd start = motion.positions;
  Matrix3Xd& x = motion.positions;
  x += dt * motion.velocities;
  x.colwise() += dt * dt * kAcceleration;
  for (const int pin : mesh.pins) {
    x.col(pin) = start.col(pin);
  }
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    const Eigen::Vector2i ends = mesh.springs.col(s);
    const Vector3d edge = x.col(ends[1]) - x.col(ends[0]);
    Eigen::Matrix<double, 3, 2> gradient;
    gradient << -edge.normalized(), edge.normalized();
    const double compliance = 2.0 / (mesh.springStiffness[s] * dt * dt);
    relax(mesh, ends, gradient, {edge.norm() - mesh.springRestLengths[s], compliance}, x);
  }
  for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
    const Eigen::Vector4i corners = mesh.hinges.col(h);
    const HingeVectors<double> positions = x(Eigen::all, corners);
    const HingeAngle<double> angle = hingeAngle<double>(positions);
    const double compliance = 1.0 / (mesh.hingeStiffness[h] * dt * dt);
    relax(mesh, corners, angle.gradient, {angle.angle - mesh.hingeRestAngles[h], compliance}, x);
  }
  motion.velocities = (x - start) / dt;
}

/// Processor time [s]: a single run of seconds meets other work on the machine.
double processorSeconds(const std::function<void()>& function) {
  const std::clock_t start = std::clock();
  function();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

struct Study {
  ClothMesh mesh;
  Matrix3Xd exact;

  void report(const std::string& method, int rate, double seconds, const Matrix3Xd& x) const {
    std::printf(
        "  %-22s %7d steps/s %10.0f ms per simulated s   rms %8.1e m\n",
        method.c_str(),
        rate,
        1e3 * seconds / kTime,
        std::sqrt((x - exact).colwise().squaredNorm().mean()));
  }

  Matrix3Xd runInDouble(int rate, const StepInDouble& step) const {
    Motion motion = {mesh.restPositions, Matrix3Xd::Zero(3, mesh.numVertices())};
    for (int i = 0; i < std::lround(kTime * rate); ++i) {
      step(motion, 1.0 / rate);
    }
    return motion.positions;
  }

  void measureInDouble(const std::string& method, int rate, const StepInDouble& step) const {
    Matrix3Xd end;
    const double seconds = processorSeconds([&] { end = runInDouble(rate, step); });
    report(method, rate, seconds, end);
  }

  template <typename Stepper>
  void measureStepper(const std::string& method, int rate, Stepper& stepper) const {
    const Gravity gravity(mesh, kAcceleration);
    const std::array<const ExternalForce*, 1> forces = {&gravity};
    ClothState state = restState(mesh);
    const double seconds = processorSeconds([&] {
      for (int i = 0; i < std::lround(kTime * rate); ++i) {
        stepper.step(state, forces);
      }
    });
    report(method, rate, seconds, state.positions.topRows<3>().cast<double>());
  }
};

void study(int side, double stretch, double torsion) {
  Study study = {
      .mesh = test::clothOf(
          test::equilateralSheet(side, side, 0.02),
          {.stretchStiffness = stretch,
           .torsionStiffness = torsion,
           .massMode = MassMode::kAreal,
           .arealDensity = 0.2,
           .damping = 0.0,
           .limitCompressedTorsion = false},
          {.pins = {side * (side - 1), side * side - 1}}),
      .exact = {}};
  const ClothMesh& mesh = study.mesh;
  const int rate = static_cast<int>(std::ceil(1.0 / stability(mesh).largestSubstep));
  std::printf("k = %.0e N/m, w = %g N·m/rad, %d vertices\n", stretch, torsion, side * side);
  const StepInDouble semiImplicit = [&](Motion& motion, double dt) {
    semiImplicitEuler(mesh, motion, dt);
  };
  study.exact = study.runInDouble(2 * rate, semiImplicit);
  ClothStepper stepper(mesh);
  stepper.setSubstep({.duration = 1.0 / rate, .damping = 0.0});
  study.measureStepper("explicit, float", rate, stepper);
  for (const int steps : {60, 120, 300}) {
    ImplicitStepper implicitStepper(mesh, {.duration = 1.0 / steps, .damping = 0.0});
    study.measureStepper("implicit Runge-Kutta", steps, implicitStepper);
  }
  ClothHessian hessian(mesh);
  for (const int steps : {300, 1200}) {
    study.measureInDouble("backward Euler", steps, [&](Motion& motion, double dt) {
      backwardEuler(mesh, hessian, motion, dt);
    });
  }
  for (const int steps : {3000, 12000}) {
    study.measureInDouble(
        "XPBD", steps, [&](Motion& motion, double dt) { xpbd(mesh, motion, dt); });
  }
}

}  // namespace

/// integrator_benchmark [SIDE]: sheets of SIDE × SIDE vertices, 20 by default.
int main(int argc, char** argv) {
  const int side = argc > 1 ? std::atoi(argv[1]) : 20;
  if (side < 3 || side > 100) {
    std::fprintf(stderr, "integrator_benchmark: SIDE must be within 3 … 100\n");
    return 2;
  }
  benchmark::reportCalibration();
  study(side, 1e5, 1.0);
  study(side, 1e6, 10.0);
  study(side, 1e7, 10.0);
  benchmark::reportCalibration();
  return 0;
}
