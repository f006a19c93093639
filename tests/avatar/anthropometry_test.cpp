#include "avatar/anthropometry.h"

#include "avatar/body_pose.h"
#include "tests/support/primitive_meshes.h"

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

namespace avatar {
namespace {

constexpr int kSides = 32;

struct Ring {
  double height;
  double radius;
};

double polygonGirth(double radius) {
  return 2.0 * kSides * radius * std::sin(test::kPi / kSides);
}

double polygonArea(double radius) {
  return 0.5 * kSides * radius * radius * std::sin(2.0 * test::kPi / kSides);
}

/// Closed pile of regular frusta along y between two poles; all its facets are plane, so that every
/// level section is a regular polygon.
TriangleMesh turned(const std::vector<Ring>& rings, double bottom, double top) {
  const int last = static_cast<int>(rings.size()) - 1;
  TriangleMesh mesh = test::grid(kSides, last, true, false, [&](int i, int j) {
    const Ring& ring = rings[static_cast<std::size_t>(j)];
    const double angle = 2.0 * test::kPi * i / kSides;
    return Eigen::Vector3d(
        ring.radius * std::sin(angle), ring.height, ring.radius * std::cos(angle));
  });
  const auto numVertices = static_cast<int>(mesh.numVertices());
  const Eigen::Index numFaces = mesh.numFaces();
  mesh.vertices.conservativeResize(3, numVertices + 2);
  mesh.vertices.col(numVertices) << 0.0, bottom, 0.0;
  mesh.vertices.col(numVertices + 1) << 0.0, top, 0.0;
  mesh.faces.conservativeResize(3, numFaces + 2 * kSides);
  for (int i = 0; i < kSides; ++i) {
    const int next = (i + 1) % kSides;
    mesh.faces.col(numFaces + 2 * i) << numVertices, next, i;
    mesh.faces.col(numFaces + 2 * i + 1) << numVertices + 1, last * kSides + i,
        last * kSides + next;
  }
  return mesh;
}

TriangleMesh turned(const std::vector<Ring>& rings) {
  return turned(rings, rings.front().height, rings.back().height);
}

double turnedVolume(const std::vector<Ring>& rings) {
  double volume = 0.0;
  for (std::size_t i = 1; i < rings.size(); ++i) {
    const double a = rings[i - 1].radius;
    const double b = rings[i].radius;
    volume += (rings[i].height - rings[i - 1].height) / 3.0 *
              (polygonArea(a) + polygonArea(b) + polygonArea(std::sqrt(a * b)));
  }
  return volume;
}

std::vector<Ring> sphereRings(double center, double radius) {
  constexpr int kRings = 96;
  std::vector<Ring> rings;
  for (int i = 1; i < kRings; ++i) {
    const double angle = test::kPi * i / kRings;
    rings.push_back({center - radius * std::cos(angle), radius * std::sin(angle)});
  }
  return rings;
}

void append(TriangleMesh& mesh, const TriangleMesh& part) {
  const Eigen::Index numVertices = mesh.numVertices();
  const Eigen::Index numFaces = mesh.numFaces();
  mesh.vertices.conservativeResize(3, numVertices + part.numVertices());
  mesh.faces.conservativeResize(3, numFaces + part.numFaces());
  mesh.vertices.rightCols(part.numVertices()) = part.vertices;
  mesh.faces.rightCols(part.numFaces()) = part.faces.array() + static_cast<int>(numVertices);
}

/// A lay figure of disjoint closed parts with known girths and lengths [m].
struct Figure {
  std::vector<Ring> trunk = {
      {0.80, 0.16}, {0.95, 0.16}, {1.05, 0.12}, {1.12, 0.12}, {1.25, 0.15}, {1.40, 0.15}};
  std::vector<Ring> leg = {
      {0.05, 0.040},
      {0.15, 0.040},
      {0.25, 0.055},
      {0.35, 0.055},
      {0.42, 0.050},
      {0.50, 0.050},
      {0.60, 0.080},
      {0.85, 0.080}};
  std::vector<Ring> arm = {{0.12, 0.045}, {0.45, 0.045}, {0.65, 0.030}, {0.88, 0.030}};
  std::vector<Ring> neck = {{1.35, 0.06}, {1.60, 0.06}};
  double rightArmStretch = 1.0;

  static constexpr double kHeadRadius = 0.11;
  static constexpr double kHeadCenter = 1.62;

  TriangleMesh mesh() const {
    TriangleMesh mesh = turned(trunk);
    append(mesh, turned(neck));
    append(
        mesh,
        turned(
            sphereRings(kHeadCenter, kHeadRadius),
            kHeadCenter - kHeadRadius,
            kHeadCenter + kHeadRadius));
    for (const double side : {1.0, -1.0}) {
      TriangleMesh part = turned(leg);
      part.vertices.colwise() += Eigen::Vector3d(0.1 * side, 0.0, 0.0);
      append(mesh, part);
      append(mesh, foot(side));
      append(mesh, armOf(side));
    }
    return mesh;
  }

  Eigen::Matrix3Xd joints() const {
    Eigen::Matrix3Xd joints = Eigen::Matrix3Xd::Zero(3, kNumSmplJoints);
    const auto set = [&](int index, double x, double y, double z) { joints.col(index) << x, y, z; };
    set(kPelvis, 0.0, 0.92, 0.0);
    set(kSpine1, 0.0, 1.02, 0.0);
    set(kSpine2, 0.0, 1.12, 0.0);
    set(kSpine3, 0.0, 1.22, 0.0);
    set(kNeck, 0.0, 1.45, 0.0);
    set(kHead, 0.0, 1.55, 0.0);
    set(kLeftHip, 0.1, 0.90, 0.0);
    set(kLeftKnee, 0.1, 0.45, 0.0);
    set(kLeftAnkle, 0.1, 0.08, 0.0);
    set(kLeftFoot, 0.1, 0.02, 0.1);
    set(kLeftCollar, 0.05, 1.36, 0.0);
    set(kLeftShoulder, 0.18, 1.38, 0.0);
    set(kLeftElbow, 0.45, 1.38, 0.0);
    set(kLeftWrist, 0.70, 1.38, 0.0);
    set(kLeftHand, 0.78, 1.38, 0.0);
    for (int left = 0; left < kNumSmplJoints; ++left) {
      if (const int right = mirroredJoint(left); joints(0, left) > 0.0) {
        joints.col(right) << -joints(0, left), joints(1, left), joints(2, left);
      }
    }
    joints(0, kRightElbow) *= rightArmStretch;
    joints(0, kRightWrist) *= rightArmStretch;
    return joints;
  }

  BodyMeasures measure() const { return measureBody(mesh(), joints()); }

 private:
  static TriangleMesh foot(double side) {
    TriangleMesh box = test::cube();
    box.vertices = Eigen::Vector3d(0.08, 0.06, 0.24).asDiagonal() * box.vertices;
    box.vertices.colwise() += Eigen::Vector3d(0.1 * side, 0.03, 0.06);
    return box;
  }

  TriangleMesh armOf(double side) const {
    TriangleMesh part = turned(arm);
    const double reach = side > 0.0 ? 1.0 : -rightArmStretch;
    // y becomes ±x by a turn about z, so that the faces stay outwards.
    const Eigen::RowVectorXd along = part.vertices.row(1);
    part.vertices.row(1) = -side * part.vertices.row(0);
    part.vertices.row(0) = reach * along;
    part.vertices.row(1).array() += 1.38;
    return part;
  }
};

TEST(Anthropometry, FindsTheGirthsOfALayFigure) {
  const BodyMeasures m = Figure().measure();
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(m.neckGirth, polygonGirth(0.06), kRounding);
  EXPECT_NEAR(m.chestGirth, polygonGirth(0.15), kRounding);
  EXPECT_NEAR(m.waistGirth, polygonGirth(0.12), kRounding);
  // The navel's level is 0.90 + 0.25 (1.38 − 0.90) = 1.02, on the slope from 0.16 to 0.12.
  EXPECT_NEAR(m.abdomenGirth, polygonGirth(0.16 - 0.04 * 0.7), kRounding);
  EXPECT_NEAR(m.hipGirth, polygonGirth(0.16), kRounding);
  EXPECT_NEAR(m.thighGirth, polygonGirth(0.08), kRounding);
  EXPECT_NEAR(m.calfGirth, polygonGirth(0.055), kRounding);
  EXPECT_NEAR(m.upperArmGirth, polygonGirth(0.045), kRounding);
}

TEST(Anthropometry, FindsTheLengthsOfALayFigure) {
  const BodyMeasures m = Figure().measure();
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(m.stature, 1.73, kRounding);
  EXPECT_NEAR(m.shoulderBreadth, 0.36, kRounding);
  EXPECT_NEAR(m.armLength, 0.52, kRounding);
  EXPECT_NEAR(m.handLength, 0.18, kRounding);
  EXPECT_NEAR(m.legLength, 0.90, kRounding);
  EXPECT_NEAR(m.crotchHeight, 0.80, kRounding);
  EXPECT_NEAR(m.footLength, 0.24, kRounding);
  // The ball's point farthest along (0, −0.8, 1), found among rings that are 3.6 mm apart.
  EXPECT_NEAR(m.headHeight, Figure::kHeadRadius * (1.0 + 0.8 / std::hypot(0.8, 1.0)), 0.002);
}

TEST(Anthropometry, VolumesOfThePartsAddUp) {
  const Figure figure;
  const BodyMeasures m = figure.measure();
  const std::vector<Ring> head = sphereRings(Figure::kHeadCenter, Figure::kHeadRadius);
  // The poles' cones.
  const double cap = head.front().height - (Figure::kHeadCenter - Figure::kHeadRadius);
  const double caps = 2.0 / 3.0 * cap * polygonArea(head.front().radius);
  const double volume = turnedVolume(figure.trunk) + turnedVolume(figure.neck) +
                        turnedVolume(head) + caps + 2.0 * turnedVolume(figure.leg) +
                        2.0 * turnedVolume(figure.arm) + 2.0 * 0.08 * 0.06 * 0.24;
  EXPECT_NEAR(m.volume, volume, 1e-12);
  EXPECT_NEAR(m.mass, 1010.0 * volume, 1e-9);
  EXPECT_NEAR(m.bmi, 1010.0 * volume / (1.73 * 1.73), 1e-9);
}

/// A tape does not follow dents: it spans them with a chord.
TEST(Anthropometry, TapeSpansHollows) {
  Figure figure;
  TriangleMesh mesh = figure.mesh();
  const double before = figure.measure().waistGirth;
  const auto numTrunk = static_cast<Eigen::Index>(kSides * figure.trunk.size());
  for (Eigen::Index i = 0; i < numTrunk; i += 4) {
    mesh.vertices(0, i) *= 0.9;
    mesh.vertices(2, i) *= 0.9;
  }
  const double after = measureBody(mesh, figure.joints()).waistGirth;
  // Every fourth corner is dented: there two sides become one chord over twice the angle.
  const double chord = 2.0 * 0.12 * std::sin(2.0 * test::kPi / kSides);
  const double side = 2.0 * 0.12 * std::sin(test::kPi / kSides);
  EXPECT_NEAR(after, 8.0 * (chord + 2.0 * side), 1e-12);
  EXPECT_LT(after, before);
}

/// Arms that grow out of the trunk make its sections wide, but not its chest.
TEST(Anthropometry, ChestEndsAtTheArmpits) {
  Figure figure;
  figure.trunk.back() = {1.30, 0.15};
  figure.trunk.push_back({1.38, 0.25});
  figure.trunk.push_back({1.40, 0.25});
  const double chest = figure.measure().chestGirth;
  EXPECT_GE(chest, polygonGirth(0.15) - 1e-12);
  // The slope of 1.25 is recognised when it makes 40 % of four levels, which are 4.5 mm apart.
  EXPECT_LE(chest, polygonGirth(0.15 + 1.25 * 0.4 * 4 * 0.0045));
}

/// The lean from a narrow waist to the ribs is none of an armpit.
TEST(Anthropometry, ChestIsFoundAboveANarrowWaist) {
  Figure figure;
  figure.trunk[2] = {1.05, 0.07};
  figure.trunk[3] = {1.12, 0.07};
  figure.trunk[4] = {1.19, 0.15};
  const BodyMeasures m = figure.measure();
  EXPECT_NEAR(m.waistGirth, polygonGirth(0.07), 1e-12);
  EXPECT_NEAR(m.chestGirth, polygonGirth(0.15), 1e-12);
}

TEST(Anthropometry, StoutTrunkMayBeWiderThanTheShoulderJoints) {
  Figure figure;
  for (Ring& ring : figure.trunk) {
    ring.radius += 0.08;
  }
  EXPECT_NEAR(figure.measure().chestGirth, polygonGirth(0.23), 1e-12);
}

TEST(Anthropometry, ScalesWithTheBody) {
  const Figure figure;
  const BodyMeasures unit = figure.measure();
  const double s = 1.37;
  TriangleMesh mesh = figure.mesh();
  mesh.vertices *= s;
  const std::vector<MeasureRow> scaled = measureRows(measureBody(mesh, s * figure.joints()));
  const std::vector<MeasureRow> rows = measureRows(unit);
  ASSERT_EQ(rows.size(), scaled.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool cubic = rows[i].unit == "m^3" || rows[i].unit == "kg";
    const double factor = cubic ? s * s * s : s;  // mass / stature² is linear, as a length
    EXPECT_NEAR(scaled[i].value, factor * rows[i].value, 1e-11 * scaled[i].value) << rows[i].name;
  }
}

void expectEqual(const BodyMeasures& a, const BodyMeasures& b) {
  const std::vector<MeasureRow> rowsA = measureRows(a);
  const std::vector<MeasureRow> rowsB = measureRows(b);
  for (std::size_t i = 0; i < rowsA.size(); ++i) {
    // Rounding of coordinates of a few metres.
    EXPECT_NEAR(rowsA[i].value, rowsB[i].value, 1e-12 * (1.0 + rowsA[i].value)) << rowsA[i].name;
  }
}

TEST(Anthropometry, IsTheSameInAMirror) {
  Figure figure;
  figure.rightArmStretch = 1.1;
  TriangleMesh mesh = figure.mesh();
  mesh.vertices.row(0) *= -1.0;
  mesh.faces.row(1).swap(mesh.faces.row(2));
  const Eigen::Matrix3Xd joints = figure.joints();
  Eigen::Matrix3Xd mirroredJoints(3, kNumSmplJoints);
  for (int j = 0; j < kNumSmplJoints; ++j) {
    mirroredJoints.col(j) = joints.col(mirroredJoint(j));
    mirroredJoints(0, j) *= -1.0;
  }
  const BodyMeasures original = figure.measure();
  expectEqual(original, measureBody(mesh, mirroredJoints));
  EXPECT_NEAR(original.handLength, 0.5 * (0.18 + 0.18 * 1.1), 1e-12) << "mean of both sides";
}

TEST(Anthropometry, DoesNotDependOnTheOrigin) {
  const Figure figure;
  const Eigen::Vector3d offset(0.7, -0.9, 2.1);
  TriangleMesh mesh = figure.mesh();
  mesh.vertices.colwise() += offset;
  expectEqual(figure.measure(), measureBody(mesh, figure.joints().colwise() + offset));
}

TEST(Anthropometry, JointsAfterThe22ndDoNotCount) {
  const Figure figure;
  Eigen::Matrix3Xd joints = figure.joints();
  expectEqual(figure.measure(), measureBody(figure.mesh(), joints.leftCols(22)));
  joints.conservativeResize(3, 52);
  joints.rightCols(28).setConstant(9.0);
  expectEqual(figure.measure(), measureBody(figure.mesh(), joints));
}

TEST(Anthropometry, TableShowsEveryMeasure) {
  const BodyMeasures m = Figure().measure();
  const std::vector<MeasureRow> rows = measureRows(m);
  EXPECT_EQ(rows.size() * sizeof(double), sizeof(BodyMeasures));
  std::set<std::string_view> names;
  for (const MeasureRow& row : rows) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_GT(row.value, 0.0) << row.name;
  }
}

TEST(Anthropometry, RefusesMeshesWithoutAnInside) {
  const Figure figure;
  TriangleMesh mesh = figure.mesh();
  mesh.faces.conservativeResize(3, mesh.numFaces() - 1);
  EXPECT_THROW(measureBody(mesh, figure.joints()), std::invalid_argument) << "open";
  mesh = figure.mesh();
  mesh.faces.row(0).swap(mesh.faces.row(1));
  EXPECT_THROW(measureBody(mesh, figure.joints()), std::invalid_argument) << "inside out";
  mesh = figure.mesh();
  std::swap(mesh.faces(0, 0), mesh.faces(1, 0));
  EXPECT_THROW(measureBody(mesh, figure.joints()), std::invalid_argument) << "one face turned";
  mesh = figure.mesh();
  mesh.vertices(1, 5) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(measureBody(mesh, figure.joints()), std::invalid_argument) << "not finite";
  EXPECT_THROW(measureBody(TriangleMesh(), figure.joints()), std::invalid_argument) << "empty";
}

TEST(Anthropometry, RefusesJointsThatAreNoTPose) {
  const Figure figure;
  const TriangleMesh mesh = figure.mesh();
  const auto refused = [&](const Eigen::Matrix3Xd& joints) {
    EXPECT_THROW(measureBody(mesh, joints), std::invalid_argument);
  };
  refused(figure.joints().leftCols(21));
  refused(Eigen::Matrix3Xd::Zero(3, kNumSmplJoints));
  refused(figure.joints().colwise() + Eigen::Vector3d(0.0, 5.0, 0.0));

  Eigen::Matrix3Xd joints = figure.joints();
  joints(2, kHead) = std::numeric_limits<double>::infinity();
  refused(joints);

  joints = figure.joints();
  joints.col(kLeftKnee) = joints.col(kLeftHip);
  refused(joints);

  joints = figure.joints();
  joints.col(kRightElbow) = joints.col(kRightShoulder) - Eigen::Vector3d(0.05, 0.3, 0.0);
  refused(joints);

  joints = figure.joints();
  joints.row(0) *= -1.0;
  refused(joints);
}

}  // namespace
}  // namespace avatar
