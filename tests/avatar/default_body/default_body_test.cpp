#include "avatar/default_body/default_body.h"

#include "avatar/anthropometry.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/default_body/shape_space.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"
#include "avatar/skinning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace avatar {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;

TriangleMesh templateMesh() {
  return {defaultBody().templateVertices, defaultBody().faces};
}

// Everything an outside program may compare, in the order of the model's fields.
TEST(DefaultBody, IsMadeTheSameOnEveryRun) {
  const BodyModel made = makeDefaultBody();
  const BodyModel& embedded = defaultBody();
  EXPECT_EQ(made.templateVertices, embedded.templateVertices);
  EXPECT_EQ(made.faces, embedded.faces);
  EXPECT_EQ(made.shapeDirections, embedded.shapeDirections);
  EXPECT_EQ(Eigen::MatrixXd(made.jointRegressor), Eigen::MatrixXd(embedded.jointRegressor));
  EXPECT_EQ(Eigen::MatrixXd(made.skinningWeights), Eigen::MatrixXd(embedded.skinningWeights));
  EXPECT_EQ(made.parents, embedded.parents);
  ASSERT_EQ(made.poseDirections.size(), embedded.poseDirections.size());
  for (std::size_t joint = 0; joint < made.poseDirections.size(); ++joint) {
    ASSERT_EQ(made.poseDirections[joint].size(), embedded.poseDirections[joint].size());
    if (made.poseDirections[joint].size() == 0)
      continue;
    EXPECT_EQ(made.poseDirections[joint], embedded.poseDirections[joint]);
  }
}

TEST(DefaultBody, IsAClosedManifoldOfGenusZero) {
  const TriangleMesh mesh = templateMesh();
  const Topology shape = topology(mesh.faces, mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented && shape.closed);
  EXPECT_EQ(shape.components, 1);
  EXPECT_EQ(shape.genus, 0);
  EXPECT_GT(mesh.numVertices(), 6500);
  EXPECT_LT(mesh.numVertices(), 8000);
}

TEST(DefaultBody, HasTrianglesWithoutSmallAngles) {
  const TriangleMesh mesh = templateMesh();
  double smallest = std::numbers::pi;
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    smallest = std::min(smallest, faceAngles(mesh, f).minCoeff());
  }
  EXPECT_GT(smallest, 20.0 * kDegree);
}

std::map<std::tuple<double, double, double>, int> vertexAtPosition(const Eigen::Matrix3Xd& points) {
  std::map<std::tuple<double, double, double>, int> result;
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    result[{points(0, v), points(1, v), points(2, v)}] = static_cast<int>(v);
  }
  return result;
}

TEST(DefaultBody, IsLeftRightSymmetric) {
  const BodyModel& body = defaultBody();
  const auto vertexAt = vertexAtPosition(body.templateVertices);
  for (int v = 0; v < body.numVertices(); ++v) {
    const Vector3d p = body.templateVertices.col(v);
    const auto found = vertexAt.find({p.x() == 0.0 ? p.x() : -p.x(), p.y(), p.z()});
    ASSERT_NE(found, vertexAt.end()) << "vertex " << v;
    const int other = found->second;
    for (int joint = 0; joint < kNumSmplJoints; ++joint) {
      EXPECT_NEAR(
          body.skinningWeights.coeff(v, joint),
          body.skinningWeights.coeff(other, mirroredJoint(joint)),
          1e-12);
    }
    for (int k = 0; k < kNumShapes; ++k) {
      const Vector3d a = body.shapeDirections.block<3, 1>(3 * v, k);
      const Vector3d b = body.shapeDirections.block<3, 1>(3 * other, k);
      EXPECT_LT((a - Vector3d(-b.x(), b.y(), b.z())).norm(), 1e-9);
    }
  }
}

TEST(DefaultBody, SkinningWeightsAreFewAndSumToOne) {
  const BodyModel& body = defaultBody();
  for (int v = 0; v < body.numVertices(); ++v) {
    int count = 0;
    double sum = 0.0;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(body.skinningWeights, v);
         it;
         ++it) {
      EXPECT_GE(it.value(), 0.0);
      count += it.value() > 0.0 ? 1 : 0;
      sum += it.value();
    }
    EXPECT_LE(count, 4);
    EXPECT_NEAR(sum, 1.0, 1e-12);
  }
}

// Neighbouring vertices never differ by much: skin without tears.
TEST(DefaultBody, SkinningWeightsAreSmooth) {
  const BodyModel& body = defaultBody();
  const Adjacency adjacency = buildAdjacency(body.faces, body.numVertices());
  for (Eigen::Index e = 0; e < adjacency.numEdges(); ++e) {
    const int a = adjacency.edges(0, e);
    const int b = adjacency.edges(1, e);
    const Eigen::VectorXd difference =
        Eigen::VectorXd(body.skinningWeights.row(a)) - Eigen::VectorXd(body.skinningWeights.row(b));
    EXPECT_LT(difference.cwiseAbs().maxCoeff(), 0.42) << a << " " << b;
  }
}

TEST(DefaultBody, JointsStayInsideEveryShapeAndMirrorEachOther) {
  const BodyModel& body = defaultBody();
  const Skinning skinning(body);
  for (int i = 0; i < 2 * kNumShapes; ++i) {
    const double beta = i % 2 == 0 ? -2.0 : 2.0;
    const ShapedBody shaped = skinning.shape(beta * Eigen::VectorXd::Unit(kNumShapes, i / 2));
    const TriangleMesh mesh{shaped.vertices, body.faces};
    const SignedDistance signedDistance(mesh);
    for (int joint = 0; joint < kNumSmplJoints; ++joint) {
      const Vector3d a = shaped.joints.col(joint);
      const Vector3d b = shaped.joints.col(mirroredJoint(joint));
      EXPECT_LT(signedDistance(a).distance, -0.004)
          << kShapeNames[i / 2] << " " << kSmplJointNames[joint];
      EXPECT_LT((a - Vector3d(-b.x(), b.y(), b.z())).norm(), 1e-6);
    }
  }
}

struct AdultRange {
  const char* name;
  double BodyMeasures::*measure;
  double low, high;  // [m], BMI [kg/m²]
};

// About the first to the 99th percentile of adult women and men together, rounded outwards (surveys
// such as ANSUR and NHANES); lengths between joint centres are shorter than those between
// landmarks.
constexpr AdultRange kAdults[] = {
    {"stature", &BodyMeasures::stature, 1.48, 1.95},
    {"neck girth", &BodyMeasures::neckGirth, 0.27, 0.48},
    {"chest girth", &BodyMeasures::chestGirth, 0.74, 1.35},
    {"waist girth", &BodyMeasures::waistGirth, 0.58, 1.30},
    {"hip girth", &BodyMeasures::hipGirth, 0.80, 1.35},
    {"thigh girth", &BodyMeasures::thighGirth, 0.43, 0.80},
    {"calf girth", &BodyMeasures::calfGirth, 0.29, 0.48},
    {"upper arm girth", &BodyMeasures::upperArmGirth, 0.21, 0.45},
    {"shoulder breadth", &BodyMeasures::shoulderBreadth, 0.30, 0.46},
    {"arm length", &BodyMeasures::armLength, 0.43, 0.65},
    {"crotch height", &BodyMeasures::crotchHeight, 0.65, 0.97},
    {"foot length", &BodyMeasures::footLength, 0.21, 0.31},
    {"body mass index", &BodyMeasures::bmi, 16.0, 42.0}};

void expectAdult(const Skinning& skinning, const Eigen::VectorXd& betas) {
  const ShapedBody shaped = skinning.shape(betas);
  const BodyMeasures measures =
      measureBody({shaped.vertices, skinning.model().faces}, shaped.joints);
  for (const AdultRange& range : kAdults) {
    EXPECT_GT(measures.*range.measure, range.low) << range.name << ", betas " << betas.transpose();
    EXPECT_LT(measures.*range.measure, range.high) << range.name << ", betas " << betas.transpose();
  }
}

TEST(DefaultBody, MeasuresLikeAnAdultInEveryDirection) {
  const Skinning skinning(defaultBody());
  expectAdult(skinning, Eigen::VectorXd::Zero(kNumShapes));
  for (int k = 0; k < kNumShapes; ++k) {
    expectAdult(skinning, -2.0 * Eigen::VectorXd::Unit(kNumShapes, k));
    expectAdult(skinning, 2.0 * Eigen::VectorXd::Unit(kNumShapes, k));
  }
}

// The chain of names, directions and measures holds together: each direction changes what it names,
// and nobody's stature but stature's.
TEST(DefaultBody, ShapeDirectionsChangeWhatTheyName) {
  const Skinning skinning(defaultBody());
  const auto measured = [&](int direction, double beta) {
    const ShapedBody shaped = skinning.shape(beta * Eigen::VectorXd::Unit(kNumShapes, direction));
    return measureBody({shaped.vertices, defaultBody().faces}, shaped.joints);
  };
  const std::pair<std::string_view, double BodyMeasures::*> named[] = {
      {"stature", &BodyMeasures::stature},
      {"mass", &BodyMeasures::mass},
      {"shoulder_breadth", &BodyMeasures::shoulderBreadth},
      {"chest", &BodyMeasures::chestGirth},
      {"waist", &BodyMeasures::waistGirth},
      {"hip", &BodyMeasures::hipGirth},
      {"leg_length", &BodyMeasures::crotchHeight},
      {"arm_length", &BodyMeasures::armLength},
      {"muscle", &BodyMeasures::upperArmGirth},
      {"belly", &BodyMeasures::abdomenGirth}};
  for (int k = 0; k < kNumShapes; ++k) {
    const auto& [name, measure] = named[k];
    ASSERT_EQ(kShapeNames[static_cast<std::size_t>(k)], name);
    const BodyMeasures less = measured(k, -1.0);
    const BodyMeasures more = measured(k, 1.0);
    EXPECT_GT(more.*measure / (less.*measure), 1.03) << name;
    if (k > 0) {
      EXPECT_NEAR(more.stature, less.stature, 0.01) << name;
    }
  }
}

// Volume of the part of a limb whose faces pass `contains` at rest, closed by fans over its cuts.
template <typename Contains>
double limbVolume(const Eigen::Matrix3Xd& posed, const Contains& contains) {
  const BodyModel& body = defaultBody();
  std::map<int, int> nextOnCut;
  std::map<std::pair<int, int>, bool> edges;
  double volume = 0.0;
  for (Eigen::Index f = 0; f < body.numFaces(); ++f) {
    const Eigen::Vector3i face = body.faces.col(f);
    bool isInside = true;
    for (const int v : face)
      isInside = isInside && contains(Vector3d(body.templateVertices.col(v)));
    if (!isInside)
      continue;
    volume += posed.col(face[0]).dot(posed.col(face[1]).cross(posed.col(face[2]))) / 6.0;
    for (int i = 0; i < 3; ++i)
      edges[{face[i], face[(i + 1) % 3]}] = true;
  }
  for (const auto& [edge, unused] : edges) {
    if (!edges.contains({edge.second, edge.first}))
      nextOnCut[edge.second] = edge.first;
  }
  while (!nextOnCut.empty()) {
    std::vector<int> loop;
    for (int v = nextOnCut.begin()->first; nextOnCut.contains(v);) {
      loop.push_back(v);
      const int next = nextOnCut[v];
      nextOnCut.erase(v);
      v = next;
    }
    Vector3d center = Vector3d::Zero();
    for (const int v : loop)
      center += posed.col(v) / static_cast<double>(loop.size());
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vector3d a = posed.col(loop[i]);
      const Vector3d b = posed.col(loop[(i + 1) % loop.size()]);
      volume += center.dot(a.cross(b)) / 6.0;
    }
  }
  return volume;
}

struct Bend {
  const char* name;
  int joint;
  Vector3d rotation;   // [rad]
  Vector3d low, high;  // the limb around the joint, at rest [m]
};

class DefaultBodyBends : public testing::TestWithParam<Bend> {};

// Without its pose blend shapes the elbow loses 15 %, the knee 16 % and the forearm 23 % at 120°.
TEST_P(DefaultBodyBends, KeepTheVolumeOfTheLimb) {
  const Bend& bend = GetParam();
  const Skinning skinning(defaultBody());
  BodyPose pose;
  pose.jointRotations.segment<3>(3 * bend.joint) = bend.rotation;
  const auto contains = [&](const Vector3d& p) {
    return (p.array() > bend.low.array()).all() && (p.array() < bend.high.array()).all();
  };
  const double atRest = limbVolume(defaultBody().templateVertices, contains);
  const SkinnedBody posed = skinning.pose(skinning.shape({}), pose);
  EXPECT_NEAR(limbVolume(posed.vertices, contains) / atRest, 1.0, 0.05);
}

INSTANTIATE_TEST_SUITE_P(
    At60And120Degrees,
    DefaultBodyBends,
    testing::Values(
        Bend{"elbow", kLeftElbow, {0, -60 * kDegree, 0}, {0.33, 0.3, -0.2}, {0.54, 0.6, 0.2}},
        Bend{"elbow", kLeftElbow, {0, -120 * kDegree, 0}, {0.33, 0.3, -0.2}, {0.54, 0.6, 0.2}},
        Bend{
            "right elbow",
            kRightElbow,
            {0, 120 * kDegree, 0},
            {-0.54, 0.3, -0.2},
            {-0.33, 0.6, 0.2}},
        Bend{"knee", kLeftKnee, {60 * kDegree, 0, 0}, {0, -0.56, -0.3}, {0.3, -0.32, 0.3}},
        Bend{"knee", kLeftKnee, {120 * kDegree, 0, 0}, {0, -0.56, -0.3}, {0.3, -0.32, 0.3}},
        Bend{"forearm", kLeftWrist, {120 * kDegree, 0, 0}, {0.58, 0.3, -0.2}, {0.75, 0.6, 0.2}},
        Bend{"forearm", kLeftWrist, {-120 * kDegree, 0, 0}, {0.58, 0.3, -0.2}, {0.75, 0.6, 0.2}},
        Bend{"forearm", kRightWrist, {60 * kDegree, 0, 0}, {-0.75, 0.3, -0.2}, {-0.58, 0.6, 0.2}}));

TEST(BodyPresets, AreNamedShapesOfTheDefaultBody) {
  EXPECT_GE(bodyPresets().size(), 3u);
  for (const BodyPreset& preset : bodyPresets()) {
    EXPECT_EQ(preset.betas.size(), defaultBody().numBetas()) << preset.name;
    EXPECT_LE(preset.betas.cwiseAbs().maxCoeff(), 2.0) << preset.name;
  }
}

}  // namespace
}  // namespace avatar
