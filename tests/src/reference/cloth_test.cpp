#include "src/reference/cloth.h"

#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/bullet_ext/core/force_checks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>

namespace reference {
namespace {

using bullet_ext::test::equilateralSheet;
using bullet_ext::test::jiggled;
using bullet_ext::test::Sheet;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kGravity = 9.81;
constexpr double kDuration = 1.0 / 3000.0;

Cloth referenceCloth(const Sheet& sheet, const Material& material = {}) {
  return buildCloth(sheet.vertices, sheet.faces, material);
}

void setPositions(Cloth& cloth, const Matrix3Xd& positions) {
  for (std::size_t v = 0; v < cloth.vertices.size(); ++v) {
    cloth.vertices[v].position = positions.col(static_cast<Eigen::Index>(v));
  }
}

Matrix3Xd asMatrix(const Forces& forces) {
  Matrix3Xd result(3, std::ssize(forces));
  for (std::size_t v = 0; v < forces.size(); ++v) {
    result.col(static_cast<Eigen::Index>(v)) = forces[v];
  }
  return result;
}

using AddForces = void (*)(const Cloth&, Forces&);

Matrix3Xd forcesAt(Cloth cloth, const Matrix3Xd& positions, AddForces add) {
  setPositions(cloth, positions);
  Forces forces = noForces(cloth);
  add(cloth, forces);
  return asMatrix(forces);
}

double energyOf(const Cloth& cloth) {
  return stretchEnergy(cloth) + torsionEnergy(cloth) + kineticEnergy(cloth);
}

void run(
    Cloth& cloth, const StepOptions& options, int steps, const std::function<void()>& after = [] {
    }) {
  for (int i = 0; i < steps; ++i) {
    step(cloth, options);
    after();
  }
}

/// A chain of vertices of 1 g between springs, from the origin along x.
Cloth chain(int links, double length, double stiffness) {
  Cloth cloth;
  for (int i = 0; i <= links; ++i) {
    cloth.vertices.push_back({.position = {i * length / links, 0.0, 0.0}});
  }
  for (int i = 0; i < links; ++i) {
    cloth.springs.push_back({i, i + 1, length / links, stiffness});
  }
  return cloth;
}

TEST(ReferenceCloth, forcesAreMinusTheEnergysGradient) {
  const Sheet sheet = equilateralSheet(5, 5, 0.02);
  const Cloth cloth = referenceCloth(sheet);
  const Matrix3Xd bent = jiggled(sheet.vertices, 0.004);
  const auto check = [&](AddForces add, double (*energy)(const Cloth&)) {
    const bullet_ext::test::ForceLaw law = {
        [&](const Matrix3Xd& x) {
          Cloth moved = cloth;
          setPositions(moved, x);
          return energy(moved);
        },
        [&](const Matrix3Xd& x) { return forcesAt(cloth, x, add); },
        {}};
    // Differences of energies of 0.1 J over 1e-5 m: rounding 1e-12, truncation (1e-5/0.02)⁴.
    EXPECT_LT(bullet_ext::test::energyForceError(law, bent, 1e-5), 1e-8);
    EXPECT_LT(bullet_ext::test::netForce(law.forces(bent)), 1e-14);
    EXPECT_LT(bullet_ext::test::netTorque(bent, law.forces(bent)), 1e-14);
    EXPECT_LT(bullet_ext::test::rigidMotionError(law, bent), 1e-12);
  };
  check(addStretchForces, stretchEnergy);
  check(addTorsionForces, torsionEnergy);
}

TEST(ReferenceCloth, torsionAngleIsTheFoldsAndSigned) {
  for (const double angle : {-3.0, -1.2, -1e-7, 0.0, 1e-7, 0.4, 2.9}) {
    const Cloth cloth = referenceCloth(bullet_ext::test::hingeSheet(0.05, 0.03, angle));
    ASSERT_EQ(cloth.hinges.size(), 1U);
    EXPECT_NEAR(cloth.hinges[0].restAngle, angle, 1e-14);
  }
}

TEST(ReferenceCloth, restShapeIsWithoutForce) {
  const Sheet sheet = bullet_ext::test::hingeSheet(0.05, 0.03, 0.7);
  const Cloth cloth = referenceCloth(sheet);
  EXPECT_EQ(cloth.springs.size(), 5U);
  EXPECT_EQ(forcesAt(cloth, sheet.vertices, addStretchForces).norm(), 0.0);
  EXPECT_EQ(forcesAt(cloth, sheet.vertices, addTorsionForces).norm(), 0.0);
}

TEST(ReferenceCloth, springExtendsUnderAWeight) {
  // The stiffness acts on half the difference: k/2 · δ = m g.
  Cloth cloth = chain(1, 0.1, 800.0);
  cloth.vertices[0].pinned = true;
  run(cloth,
      {.gravity = {kGravity, 0.0, 0.0}, .dampingMode = DampingMode::kPerSubstep, .damping = 0.05},
      3000);
  EXPECT_NEAR(cloth.vertices[1].position.x() - 0.1, 0.001 * kGravity / 400.0, 1e-12);
}

TEST(ReferenceCloth, chainHangsInACatenary) {
  constexpr int kLinks = 40;
  constexpr double kSpan = 0.3;
  Cloth cloth = chain(kLinks, 0.4, 1e5);
  for (Vertex& vertex : cloth.vertices) {  // slack, over the whole length
    const double s = vertex.position.x() / 0.4;
    vertex.position = {kSpan * s, -0.1 * std::sin(std::numbers::pi * s), 0.0};
  }
  cloth.vertices.front().pinned = cloth.vertices.back().pinned = true;
  run(cloth, {.duration = 1e-4, .damping = 8.0}, 40000);
  // A catenary with parameter a has the length 2 a sinh(span/2a) and the sag a cosh(span/2a) − a.
  double low = 0.01;
  double high = 1.0;
  for (int i = 0; i < 60; ++i) {
    const double a = 0.5 * (low + high);
    (2.0 * a * std::sinh(0.5 * kSpan / a) > 0.4 ? low : high) = a;
  }
  for (int i = 0; i <= kLinks; ++i) {
    const Vector3d& x = cloth.vertices[static_cast<std::size_t>(i)].position;
    const double y = low * (std::cosh((x.x() - 0.5 * kSpan) / low) - std::cosh(0.5 * kSpan / low));
    // Chords of 1 cm, (0.01/a)²/24 of the sag, and springs 4e-4 longer under tension.
    EXPECT_NEAR(x.y(), y, 2e-4) << i;
  }
}

TEST(ReferenceCloth, pendulumSwingsWithItsPeriod) {
  Cloth cloth = chain(1, 0.25, 2e4);
  cloth.vertices[0].pinned = true;
  const double amplitude = 0.2;
  cloth.vertices[1].position = 0.25 * Vector3d(std::sin(amplitude), -std::cos(amplitude), 0.0);
  double previous = cloth.vertices[1].position.x();
  double first = 0.0;
  double last = 0.0;
  int passages = 0;
  int count = 0;
  run(cloth, {.damping = 0.0}, 15000, [&] {
    const double x = cloth.vertices[1].position.x();
    ++count;
    if (previous < 0.0 && x >= 0.0) {
      last = kDuration * (count - x / (x - previous));
      first = passages++ == 0 ? last : first;
    }
    previous = x;
  });
  const double expected =
      2.0 * std::numbers::pi * std::sqrt(0.25 / kGravity) *
      (1.0 + std::pow(amplitude, 2) / 16.0 + 11.0 * std::pow(amplitude, 4) / 3072.0);
  // The spring is 4e-6 longer than at rest, half of that in the period.
  EXPECT_NEAR((last - first) / (passages - 1), expected, 1e-5 * expected);
}

/// A plank of pairs of vertices at x = 0, a, 2a …, hinged at every pair by two torsion springs that
/// mirror each other, the first two pairs pinned.
Cloth cantilever(int joints, double a, double w) {
  constexpr double kStretch = 2e4;
  Cloth cloth;
  for (int i = 0; i <= joints + 1; ++i) {
    for (const double side : {-0.5, 0.5}) {
      cloth.vertices.push_back({.position = {i * a, 0.0, side * a}, .pinned = i < 2});
    }
  }
  for (int i = 0; i <= joints + 1; ++i) {
    cloth.springs.push_back({2 * i, 2 * i + 1, a, kStretch});
    if (i > 0) {
      cloth.springs.push_back({2 * i - 2, 2 * i, a, kStretch});
      cloth.springs.push_back({2 * i - 1, 2 * i + 1, a, kStretch});
    }
    if (i > 0 && i <= joints) {
      cloth.hinges.push_back({{2 * i, 2 * i + 1, 2 * i - 2, 2 * i + 3}, 0.0, w});
      cloth.hinges.push_back({{2 * i, 2 * i + 1, 2 * i - 1, 2 * i + 2}, 0.0, w});
    }
  }
  return cloth;
}

TEST(ReferenceCloth, cantileverSagsByItsWeightOverTorsion) {
  constexpr int kJoints = 8;
  constexpr double kPitch = 0.02;
  constexpr double kWeight = 2 * 0.001 * kGravity;  // of a pair
  for (const double w : {0.2, 0.4, 0.8}) {
    Cloth cloth = cantilever(kJoints, kPitch, w);
    run(cloth, {.duration = 1e-4, .damping = 30.0}, 20000);
    // Small angles: joint i turns by the moment of all pairs beyond it over 2 w, and lowers the tip
    // by that times its distance.
    double sag = 0.0;
    for (int i = 1; i <= kJoints; ++i) {
      double moment = 0.0;
      for (int j = i + 1; j <= kJoints + 1; ++j) {
        moment += kWeight * kPitch * (j - i);
      }
      sag += moment / (2.0 * w) * kPitch * (kJoints + 1 - i);
    }
    // Relative error of the linear theory: (sag/length)².
    const double tolerance = 2.0 * std::pow(sag / (kJoints * kPitch), 2);
    EXPECT_NEAR(cloth.vertices.back().position.y() / -sag, 1.0, tolerance + 1e-4) << w;
  }
}

TEST(ReferenceCloth, flexuralRigidityOfAnEquilateralMesh) {
  // Rolled to a curvature κ in any direction, an equilateral mesh has the energy B κ²/2 per area
  // with B = √3/2 w, whatever its edge: the three edges of a vertex turn by κh/√12 · (3 − 4 cos²φ),
  // φ from the direction of curvature, together ¾ κ²h² on an area of √¾ h².
  constexpr double kCurvature = 1.0;
  for (const double edge : {0.01, 0.02}) {
    for (const double direction : {0.0, 0.4, 1.3}) {
      Sheet sheet = equilateralSheet(7, 7, edge);
      Cloth cloth = referenceCloth(sheet);
      for (Vertex& vertex : cloth.vertices) {
        Vector3d& x = vertex.position;
        const double s = std::cos(direction) * x.x() + std::sin(direction) * x.y();
        const double across = std::cos(direction) * x.y() - std::sin(direction) * x.x();
        x = {std::sin(kCurvature * s) / kCurvature, across, std::cos(kCurvature * s) / kCurvature};
      }
      constexpr int kMiddle = 24;
      double energy = 0.0;
      for (const TorsionSpring& hinge : cloth.hinges) {
        if (hinge.p[0] == kMiddle || hinge.p[1] == kMiddle) {
          energy += 0.5 * hinge.stiffness * std::pow(torsionAngle(cloth, hinge.p), 2);
        }
      }
      const double area = std::sqrt(0.75) * edge * edge;
      const double rigidity = 0.5 * energy / area / (0.5 * kCurvature * kCurvature);
      // Relative error (κ · edge)².
      EXPECT_NEAR(rigidity / 0.05, std::sqrt(0.75), 1e-3) << edge << ", " << direction;
    }
  }
}

TEST(ReferenceCloth, fallsAsEachDampingSays) {
  const auto speedAfterASecond = [](DampingMode mode, double damping) {
    Cloth cloth;
    cloth.vertices.emplace_back();
    run(cloth, {.dampingMode = mode, .damping = damping}, 3000);
    return -cloth.vertices[0].velocity.y();
  };
  EXPECT_NEAR(speedAfterASecond(DampingMode::kPerSecond, 0.0), kGravity, 1e-10);
  // v ← 0.9 (v + g dt) ends at 9 g dt.
  EXPECT_NEAR(speedAfterASecond(DampingMode::kPerSubstep, 0.1), 9.0 * kGravity * kDuration, 1e-12);
  // v = g/c (1 − e^(−c t)), first order in c dt.
  for (const double c : {0.1, 5.0}) {
    const double expected = kGravity / c * (1.0 - std::exp(-c));
    EXPECT_NEAR(speedAfterASecond(DampingMode::kPerSecond, c), expected, c * kDuration * expected);
  }
}

TEST(ReferenceCloth, freeFlightKeepsMomentumAndDampingTakesEnergy) {
  const Sheet sheet = equilateralSheet(6, 6, 0.02);
  Cloth cloth = referenceCloth(sheet);
  setPositions(cloth, jiggled(sheet.vertices, 0.001));
  for (Vertex& vertex : cloth.vertices) {
    vertex.velocity = {0.3, 0.0, 5.0 * vertex.position.y()};
  }
  const auto momenta = [&] {
    Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
    for (const Vertex& vertex : cloth.vertices) {
      sum.head<3>() += vertex.mass * vertex.velocity;
      sum.tail<3>() += vertex.mass * vertex.position.cross(vertex.velocity);
    }
    return sum;
  };
  const auto before = momenta();
  const double energyBefore = energyOf(cloth);
  StepOptions options = {.duration = 1e-4, .gravity = Vector3d::Zero(), .damping = 0.0};
  run(cloth, options, 2000);
  EXPECT_LT((momenta() - before).norm(), 1e-12 * before.norm());
  // Symplectic: the energy swings by ω dt/2 ≤ 0.1 and doesn't drift.
  EXPECT_NEAR(energyOf(cloth), energyBefore, 0.03 * energyBefore);
  options.damping = 3.0;
  double previous = energyOf(cloth);
  for (int i = 0; i < 5; ++i) {
    run(cloth, options, 500);
    EXPECT_LT(energyOf(cloth), 0.95 * previous);
    previous = energyOf(cloth);
  }
}

TEST(ReferenceCloth, motionDoesNotDependOnWhereItHappens) {
  const Sheet sheet = equilateralSheet(5, 5, 0.02);
  const Eigen::Isometry3d motion = bullet_ext::test::someRigidMotion();
  StepOptions options;
  Cloth here = referenceCloth(sheet);
  Cloth there = referenceCloth({motion * sheet.vertices, sheet.faces});
  here.vertices[20].pinned = there.vertices[20].pinned = true;
  run(here, options, 600);
  options.gravity = motion.linear() * options.gravity;
  run(there, options, 600);
  for (std::size_t v = 0; v < here.vertices.size(); ++v) {
    EXPECT_LT((motion * here.vertices[v].position - there.vertices[v].position).norm(), 1e-11);
  }
}

TEST(ReferenceCloth, forwardEulerGainsEnergy) {
  const Sheet sheet = equilateralSheet(6, 6, 0.02);
  for (const Integrator integrator : {Integrator::kSemiImplicitEuler, Integrator::kForwardEuler}) {
    Cloth cloth = referenceCloth(sheet);
    setPositions(cloth, jiggled(sheet.vertices, 1e-5));
    const double before = energyOf(cloth);
    run(cloth, {.gravity = Vector3d::Zero(), .integrator = integrator, .damping = 0.1}, 100);
    if (integrator == Integrator::kForwardEuler) {
      EXPECT_GT(energyOf(cloth), 100.0 * before);
    } else {
      EXPECT_LT(energyOf(cloth), 1.5 * before);  // the swing of ω dt/2
    }
  }
}

TEST(ReferenceCloth, refusesWhatIsNoSurface) {
  const Sheet sheet = bullet_ext::test::hingeSheet(0.05, 0.03, 0.0);
  Eigen::Matrix3Xi faces = sheet.faces;
  faces(2, 1) = 4;
  EXPECT_THROW(buildCloth(sheet.vertices, faces), std::invalid_argument);
  faces = sheet.faces;
  faces.col(1) << 0, 1, 3;
  EXPECT_THROW(buildCloth(sheet.vertices, faces), std::invalid_argument);
}

}  // namespace
}  // namespace reference
