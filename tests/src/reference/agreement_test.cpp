#include "bullet_ext/core/body_contact.h"
#include "bullet_ext/core/body_surface.h"
#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/depth_fitting_force.h"
#include "bullet_ext/core/spring_force.h"
#include "bullet_ext/core/torsion_force.h"
#include "src/reference/body_contact.h"
#include "src/reference/cloth.h"
#include "src/reference/depth_force.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

/// The fast solver against the reference: same cloth, same state, same substep.
namespace {

using bullet_ext::ClothMaterial;
using bullet_ext::ClothMesh;
using bullet_ext::ClothState;
using bullet_ext::ClothStepper;
using bullet_ext::test::equilateralSheet;
using bullet_ext::test::Sheet;
using Eigen::Matrix3Xd;

/// Half the machine epsilon of float: the largest relative error of one rounding.
constexpr double kRounding = 0x1.0p-24;

/// A sheet rolled up and dented, its cloth in both solvers (vertices in the input's order).
struct Pair {
  ClothMesh mesh;
  reference::Cloth cloth;
};

Sheet rolledSheet(int columns, int rows) {
  Sheet sheet = equilateralSheet(columns, rows, 0.02);
  const double radius = 0.02 * columns / 2.0;
  for (Eigen::Index v = 0; v < sheet.vertices.cols(); ++v) {
    const double angle = sheet.vertices(0, v) / radius;
    sheet.vertices(0, v) = radius * std::sin(angle);
    sheet.vertices(2, v) = radius * (1.0 - std::cos(angle));
  }
  return sheet;
}

/// Folded at every row by 3 rad, to alternating sides.
Sheet pleatedSheet(int columns, int rows) {
  constexpr double kSlope = 1.5;
  Sheet sheet = equilateralSheet(columns, rows, 0.02);
  const double height = 0.01 * std::sqrt(3.0);
  for (Eigen::Index v = 0; v < sheet.vertices.cols(); ++v) {
    const double row = std::round(sheet.vertices(1, v) / height);
    sheet.vertices(1, v) = row * height * std::cos(kSlope);
    sheet.vertices(2, v) = std::remainder(row, 2.0) == 0.0 ? 0.0 : height * std::sin(kSlope);
  }
  return sheet;
}

Pair pairOf(const Sheet& sheet, const ClothMaterial& material, const std::vector<int>& pins = {}) {
  Pair pair = {
      bullet_ext::test::clothOf(
          sheet, material, {.pins = pins, .vertexOrder = bullet_ext::VertexOrder::kInput}),
      reference::buildCloth(
          sheet.vertices,
          sheet.faces,
          {material.stretchStiffness, material.torsionStiffness, material.vertexMass})};
  for (const int pin : pins) {
    pair.cloth.vertices[static_cast<std::size_t>(pin)].pinned = true;
  }
  return pair;
}

ClothMaterial literal(const std::string& name) {
  ClothMaterial material = bullet_ext::paperMaterial(name);
  material.limitCompressedTorsion = false;
  return material;
}

void copyState(const ClothState& state, reference::Cloth& cloth) {
  for (std::size_t v = 0; v < cloth.vertices.size(); ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    cloth.vertices[v].position = state.positions.col(column).head<3>().cast<double>();
    cloth.vertices[v].velocity = state.velocities.col(column).head<3>().cast<double>();
  }
}

Matrix3Xd asMatrix(const reference::Forces& forces) {
  Matrix3Xd result(3, std::ssize(forces));
  for (std::size_t v = 0; v < forces.size(); ++v) {
    result.col(static_cast<Eigen::Index>(v)) = forces[v];
  }
  return result;
}

Matrix3Xd positionsOf(const reference::Cloth& cloth) {
  Matrix3Xd result(3, std::ssize(cloth.vertices));
  for (std::size_t v = 0; v < cloth.vertices.size(); ++v) {
    result.col(static_cast<Eigen::Index>(v)) = cloth.vertices[v].position;
  }
  return result;
}

Matrix3Xd velocitiesOf(const reference::Cloth& cloth) {
  Matrix3Xd result(3, std::ssize(cloth.vertices));
  for (std::size_t v = 0; v < cloth.vertices.size(); ++v) {
    result.col(static_cast<Eigen::Index>(v)) = cloth.vertices[v].velocity;
  }
  return result;
}

double largestDifference(const Eigen::Matrix4Xf& forces, const Matrix3Xd& expected) {
  return (forces.topRows<3>().cast<double>() - expected).colwise().norm().maxCoeff();
}

/// The measured figure on stdout, for docs/physics.md.
void report(const std::string& name, double value) {
  std::printf("%s = %.2g\n", name.c_str(), value);
}

class Agreement : public testing::TestWithParam<std::string> {
 protected:
  const ClothMaterial material_ = literal(GetParam());
  Pair pair_ = pairOf(rolledSheet(10, 10), material_);

  /// Strains of some 10 %, angles of some 30°; the same floats for both solvers.
  ClothState randomState() {
    ClothState state = bullet_ext::restState(pair_.mesh);
    state.positions.topRows<3>() =
        bullet_ext::test::jiggled(pair_.mesh.restPositions, 0.002).cast<float>();
    copyState(state, pair_.cloth);
    return state;
  }

  /// A spring's force is k/2 (1 − l0/l) of its edge: l, its inverse, the quotient, k/2, the product
  /// and l0 are rounded, 8 roundings in all, of terms of size k/2 · l. Six springs meet in a
  /// vertex, whose sum takes another six.
  double springTolerance() const {
    return 6 * (8 + 6) * kRounding * 0.5 * material_.stretchStiffness * 0.025;
  }

  /// The angle of a hinge is off by 5e-7 (signed_angle.h) and by the roundings of two unit normals,
  /// 10 each, its direction by 10 more of the moment (at most w · 1.5). The moment acts with 1/h,
  /// h ≥ 0.013 here, at up to 12 hinges of a vertex, four of them with the double sum of two wings.
  double torsionTolerance() const {
    const double w = material_.torsionStiffness;
    return 16 * w * (5e-7 + 20 * kRounding + 1.5 * 10 * kRounding) / 0.013;
  }

  void expectInnerForcesOfBothKernels(const ClothState& state) {
    reference::Forces expected = reference::noForces(pair_.cloth);
    reference::addStretchForces(pair_.cloth, expected);
    reference::addTorsionForces(pair_.cloth, expected);
    for (const auto kernels :
         {bullet_ext::ClothKernels::kPortable, bullet_ext::ClothKernels::kAutomatic}) {
      ClothStepper stepper(pair_.mesh, {.kernels = kernels});
      EXPECT_LT(
          largestDifference(stepper.innerForces(state), asMatrix(expected)),
          springTolerance() + torsionTolerance());
    }
  }
};

TEST_P(Agreement, stretchForces) {
  const ClothState state = randomState();
  Eigen::Matrix4Xf forces = Eigen::Matrix4Xf::Zero(4, state.positions.cols());
  bullet_ext::addStretchForces<float>(
      pair_.mesh, state.positions.topRows<3>(), forces.topRows<3>());
  reference::Forces expected = reference::noForces(pair_.cloth);
  reference::addStretchForces(pair_.cloth, expected);
  report("stretch_N", largestDifference(forces, asMatrix(expected)));
  EXPECT_LT(largestDifference(forces, asMatrix(expected)), springTolerance());
  EXPECT_GT(asMatrix(expected).norm(), 1.0);
}

TEST_P(Agreement, torsionForces) {
  const ClothState state = randomState();
  Eigen::Matrix4Xf forces = Eigen::Matrix4Xf::Zero(4, state.positions.cols());
  bullet_ext::addTorsionForces<float>(
      pair_.mesh, state.positions.topRows<3>(), forces.topRows<3>());
  reference::Forces expected = reference::noForces(pair_.cloth);
  reference::addTorsionForces(pair_.cloth, expected);
  report("torsion_N", largestDifference(forces, asMatrix(expected)));
  EXPECT_LT(largestDifference(forces, asMatrix(expected)), torsionTolerance());
  EXPECT_GT(asMatrix(expected).norm(), 1.0);
}

TEST_P(Agreement, innerForcesInDouble) {
  // The same formulas in double: what is left is rounding, 2⁻²⁹ of the float tolerances.
  const ClothState state = randomState();
  const Matrix3Xd x = state.positions.topRows<3>().cast<double>();
  Matrix3Xd forces = Matrix3Xd::Zero(3, x.cols());
  bullet_ext::addStretchForces<double>(pair_.mesh, x, forces);
  bullet_ext::addTorsionForces<double>(pair_.mesh, x, forces);
  reference::Forces expected = reference::noForces(pair_.cloth);
  reference::addStretchForces(pair_.cloth, expected);
  reference::addTorsionForces(pair_.cloth, expected);
  EXPECT_LT(
      (forces - asMatrix(expected)).cwiseAbs().maxCoeff(),
      0x1.0p-29 * (springTolerance() + torsionTolerance()));
}

TEST_P(Agreement, innerForcesOfPleats) {
  pair_ = pairOf(pleatedSheet(10, 10), material_);
  const ClothState state = randomState();
  const bool pressedThrough =
      std::any_of(pair_.cloth.hinges.begin(), pair_.cloth.hinges.end(), [&](const auto& hinge) {
        return std::abs(reference::torsionAngle(pair_.cloth, hinge.p) - hinge.restAngle) > 6.0;
      });
  EXPECT_TRUE(pressedThrough);
  expectInnerForcesOfBothKernels(state);
}

TEST_P(Agreement, innerForcesOfBothKernels) {
  expectInnerForcesOfBothKernels(randomState());
}

/// RMS distance [m] of the vertices after 0.25 s, a sheet swinging from two corners.
double trajectoryDifference(
    const ClothMaterial& material,
    bullet_ext::ClothKernels kernels,
    bullet_ext::SubstepOptions substep) {
  Pair pair = pairOf(equilateralSheet(20, 20, 0.02), material, {380, 399});
  ClothStepper stepper(pair.mesh, {.kernels = kernels});
  stepper.setSubstep(substep);
  ClothState state = bullet_ext::restState(pair.mesh);
  copyState(state, pair.cloth);
  const Eigen::Vector3d acceleration = {0.0, -9.81, 2.0};
  const bullet_ext::Gravity gravity(pair.mesh, acceleration);
  const std::array<const bullet_ext::ExternalForce*, 1> forces = {&gravity};
  const reference::StepOptions options = {
      .duration = substep.duration,
      .gravity = acceleration,
      .integrator = substep.integrator == bullet_ext::Integrator::kForwardEuler
                        ? reference::Integrator::kForwardEuler
                        : reference::Integrator::kSemiImplicitEuler,
      .dampingMode = substep.dampingMode == bullet_ext::DampingMode::kPerSubstep
                         ? reference::DampingMode::kPerSubstep
                         : reference::DampingMode::kPerSecond,
      .damping = substep.damping};
  for (int i = 0; i < std::lround(0.25 / substep.duration); ++i) {
    stepper.step(state, forces);
    reference::step(pair.cloth, options);
  }
  const Matrix3Xd difference =
      state.positions.topRows<3>().cast<double>() - positionsOf(pair.cloth);
  return std::sqrt(difference.colwise().squaredNorm().mean());
}

TEST_P(Agreement, trajectoriesOverAQuarterSecond) {
  // Rounding of positions, 750 substeps of 2e-8 m at random, amplified by the cloth's own
  // sensitivity; beyond a second the two part completely.
  const bullet_ext::SubstepOptions perSecond = {.damping = 0.1};
  const bullet_ext::SubstepOptions perSubstep = {
      .dampingMode = bullet_ext::DampingMode::kPerSubstep, .damping = 0.1};
  for (const auto kernels :
       {bullet_ext::ClothKernels::kPortable, bullet_ext::ClothKernels::kAutomatic}) {
    for (const auto& substep : {perSecond, perSubstep}) {
      const double difference = trajectoryDifference(material_, kernels, substep);
      report("rms_m", difference);
      EXPECT_LT(difference, 1e-5);
    }
  }
}

TEST(AgreementOfDepthForces, ringsInBothModes) {
  const Pair pair = pairOf(equilateralSheet(12, 12, 0.02), literal("middle"));
  std::vector<bullet_ext::DepthTarget> targets;
  std::vector<reference::DepthPull> pulls;
  for (int v = 0; v < 144; v += 2) {
    bullet_ext::DepthTarget target = {.vertex = v, .numPoints = 1 + v % 9, .blend = 0.7F};
    reference::DepthPull pull = {.vertex = v, .blend = static_cast<double>(target.blend)};
    for (int i = 0; i < target.numPoints; ++i) {
      const Eigen::Vector3d offset = {
          0.003 * (i % 3 - 1), 0.003 * (i / 3 - 1), 0.025 * std::sin(1.0 + v)};
      target.points.col(i) =
          (pair.cloth.vertices[static_cast<std::size_t>(v)].position + offset).cast<float>();
      target.weights[i] = 1.0F / static_cast<float>(target.numPoints);
      pull.points.emplace_back(target.points.col(i).cast<double>());
      pull.weights.push_back(static_cast<double>(target.weights[i]));
    }
    targets.push_back(target);
    pulls.push_back(pull);
  }
  ClothState state = bullet_ext::restState(pair.mesh);
  reference::Cloth cloth = pair.cloth;
  copyState(state, cloth);
  const double duration = 1.0 / 3000.0;
  for (const bool tapered : {false, true}) {
    bullet_ext::DepthForceOptions options;
    options.mode =
        tapered ? bullet_ext::DepthForceMode::kTapered : bullet_ext::DepthForceMode::kLiteral;
    Eigen::Matrix4Xf forces = Eigen::Matrix4Xf::Zero(4, 144);
    bullet_ext::DepthFittingForce(pair.mesh, targets, duration, options)
        .addTo(forces, state, {0, 144});
    reference::Forces expected = reference::noForces(cloth);
    reference::DepthForceOptions same = {.largestDistance = options.largestDistance};
    if (tapered) {
      same.largestDistance = bullet_ext::stableDepthDistance(options, 0.001, duration);
      same.softening = options.softening;
    }
    reference::addDepthForces(cloth, pulls, same, expected);
    report("depth_N", largestDifference(forces, asMatrix(expected)));
    // Forces of up to 41 N. Distances of points up to 0.25 m from the origin are rounded by 2^-24
    // of that, which γ = 240/m turns into a relative 4e-6 of the force.
    EXPECT_LT(largestDifference(forces, asMatrix(expected)), 4e-6 * 41.0);
    EXPECT_GT(asMatrix(expected).norm(), 100.0);
  }
}

/// A ball that rises into a sheet, for two frames.
class RisingBall {
 public:
  RisingBall()
      : ball_(avatar::test::icosphere(0.1, 1)), surface_(ball_.faces, ball_.numVertices()) {}

  /// Frame 0, 1 …: the ball moves and turns a little.
  void setFrame(int frame) {
    body_ = {at(frame), at(frame + 1), ball_.faces, 1.0 / 30.0};
    surface_.setFrame(body_.start, body_.end, body_.duration);
  }

  const bullet_ext::BodySurface& surface() const { return surface_; }

  const reference::MovingBody& body() const { return body_; }

 private:
  Matrix3Xd at(int frame) const {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.05 * frame, Eigen::Vector3d(0.2, 0.3, 1.0).normalized())
            .toRotationMatrix();
    const Eigen::Vector3d centre = {0.11, 0.1, -0.11 + 0.02 * frame};
    return (turn * ball_.vertices).colwise() + centre;
  }

  avatar::TriangleMesh ball_;
  bullet_ext::BodySurface surface_;
  reference::MovingBody body_;
};

TEST(AgreementOfContact, everySubstepFromTheReferencesState) {
  // Contact switches on and off, so trajectories part; one substep from the same state does not.
  const ClothMaterial material = literal("middle");
  Pair pair = pairOf(equilateralSheet(12, 12, 0.02), material);
  ClothStepper stepper(pair.mesh);
  const Eigen::Vector3d acceleration = {0.5, 0.0, -9.81};
  const bullet_ext::Gravity gravity(pair.mesh, acceleration);
  const std::array<const bullet_ext::ExternalForce*, 1> forces = {&gravity};
  RisingBall ball;
  bullet_ext::BodyContactOptions options = bullet_ext::contactFor(material);
  options.slack = 0.0;  // always the nearest triangle, as the reference
  bullet_ext::BodyContact contact(pair.mesh, ball.surface(), options);
  ClothState state = bullet_ext::restState(pair.mesh);
  copyState(state, pair.cloth);
  double positions = 0.0;
  double velocities = 0.0;
  std::int64_t pushes = 0;
  for (int substep = 0; substep < 200; ++substep) {
    if (substep % 100 == 0) {
      ball.setFrame(substep / 100);
      contact.beginFrame(state, 1.0 / 3000.0, 100);
    }
    copyState(state, pair.cloth);  // both from the same floats
    stepper.step(state, forces);
    pushes += contact.resolve(state, substep % 100).contacts;
    reference::step(pair.cloth, {.gravity = acceleration});
    reference::collide(pair.cloth, ball.body(), (substep % 100 + 1) / 100.0);
    positions = std::max(positions, largestDifference(state.positions, positionsOf(pair.cloth)));
    velocities =
        std::max(velocities, largestDifference(state.velocities, velocitiesOf(pair.cloth)));
    state =
        bullet_ext::stateFromInput(pair.mesh, positionsOf(pair.cloth), velocitiesOf(pair.cloth));
  }
  report("contact_position_m", positions);
  report("contact_velocity_m_s", velocities);
  EXPECT_GT(pushes, 500);
  // Offsets of 4 mm between floats of 0.1 m, some roundings of 7e-9 m: 1e-5 rad in the direction of
  // the push, of 0.6 m/s; and as much in the speed by forces of 3e-6 N on 1 g for 1/3000 s.
  EXPECT_LT(positions, 1e-7);
  EXPECT_LT(velocities, 2e-5);
}

INSTANTIATE_TEST_SUITE_P(
    PaperMaterials, Agreement, testing::Values("soft", "middle", "hard"), [](const auto& material) {
      return material.param;
    });

TEST(AgreementOfForwardEuler, trajectory) {
  // Stable only with the damping of a fit and the soft material: f λ dt² < 1 − f.
  const double difference = trajectoryDifference(
      literal("soft"),
      bullet_ext::ClothKernels::kAutomatic,
      {.integrator = bullet_ext::Integrator::kForwardEuler,
       .dampingMode = bullet_ext::DampingMode::kPerSubstep,
       .damping = 0.1});
  EXPECT_LT(difference, 1e-5);
}

}  // namespace
