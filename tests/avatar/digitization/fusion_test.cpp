#include "avatar/digitization/fusion.h"

#include "avatar/axis_angle.h"
#include "avatar/digitization/limbs.h"
#include "avatar/digitization/outer_surface.h"
#include "avatar/digitization/surface_gap.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "tests/avatar/digitization/rendered_frame.h"
#include "tests/support/capsule_figure.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace avatar {
namespace {

constexpr int kViews = 8;
constexpr double kVoxel = 0.008;  // coarse, to be quick [m]

/// A turn in which the arms go up and down.
BodyPose turnPose(int view) {
  BodyPose pose = test::turned(aPose(), 2.0 * std::numbers::pi * view / kViews);
  const double lift = 0.3 * std::sin(view);
  pose.jointRotations[3 * kLeftShoulder + 2] += lift;
  pose.jointRotations[3 * kRightShoulder + 2] -= lift;
  return pose;
}

class FusionTest : public testing::Test {
 protected:
  PosedDepthFrame frameOf(const BodyPose& pose) const {
    const Eigen::Matrix3Xd vertices = skinning_.pose(shaped_, pose).vertices;
    const std::vector<test::PaintedMesh> painted = {
        {MeshView(vertices, model_.faces), kUpperLabel, {0.8, 0.2, 0.4}}};
    return test::renderedFrame(painted, test::frontCamera(2.2), pose);
  }

  CanonicalFusion fusedTurn(const LoopRunner& runLoop = runSerially) const {
    CanonicalFusion fusion(
        skinning_,
        betas_,
        aPose(),
        {.voxelSize = kVoxel, .truncation = 3.0 * kVoxel, .runLoop = runLoop});
    for (int view = 0; view < kViews; ++view)
      fusion.allocate(frameOf(turnPose(view)));
    for (int view = 0; view < kViews; ++view)
      fusion.integrate(frameOf(turnPose(view)));
    return fusion;
  }

  Eigen::Vector3d canonicalJoint(int joint) const {
    return skinning_.pose(shaped_, aPose()).joints.col(joint);
  }

  BodyModel model_ = test::capsuleFigure();
  Skinning skinning_{model_};
  Eigen::VectorXd betas_ = Eigen::VectorXd::Zero(model_.numBetas());
  ShapedBody shaped_ = skinning_.shape(betas_);
  Eigen::Matrix3Xd canonical_ = skinning_.pose(shaped_, aPose()).vertices;
};

/// Distances of the points to the body, sorted.
std::vector<double> distancesTo(const MeshView& body, const Eigen::Matrix3Xd& points) {
  const TriangleBvh bvh(body);
  std::vector<double> distances;
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    distances.push_back(std::sqrt(bvh.closestPoint(points.col(i)).squaredDistance));
  std::sort(distances.begin(), distances.end());
  return distances;
}

TEST_F(FusionTest, BringsAMovingBodyBackIntoTheCanonicalPose) {
  const FusedPoints points = surfacePoints(fusedTurn().volume(), 0.05);
  ASSERT_GT(points.size(), 5000);
  const std::vector<double> distances = distancesTo({canonical_, model_.faces}, points.points);
  // Noiseless depth of the very body: what remains is the voxels' and pixels' size; capsules that
  // lie in one another at the joints leave edges that no field of this resolution holds.
  EXPECT_LT(distances[distances.size() / 2], 0.25 * kVoxel);
  EXPECT_LT(distances[distances.size() * 95 / 100], kVoxel);
}

TEST_F(FusionTest, KeepsColourAndLabel) {
  const FusedPoints points = surfacePoints(fusedTurn().volume(), 0.05);
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    const LabelCounts& counts = points.labels[static_cast<std::size_t>(i)];
    ASSERT_EQ(counts[kSkinLabel - 1] + counts[kLowerLabel - 1], 0);
    if (points.colors(0, i) >= 0.0F) {
      ASSERT_NEAR(points.colors(0, i), 0.8F, 2.0 / 255.0);
    }
  }
}

TEST_F(FusionTest, GivesTheSameForAnyOrderOfTheBlocks) {
  const LoopRunner backwards = [](long count, const std::function<void(long)>& body) {
    for (long i = count; i-- > 0;)
      body(i);
  };
  const FusedPoints a = surfacePoints(fusedTurn().volume(), 0.05);
  const FusedPoints b = surfacePoints(fusedTurn(backwards).volume(), 0.05);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.normals, b.normals);
}

TEST_F(FusionTest, ClosesTheSurface) {
  const FusedPoints points = surfacePoints(fusedTurn().volume(), 0.05);
  const MeshView body{canonical_, model_.faces};
  const OuterSurface surface = completeOuterSurface(points, body, {.poissonDepth = 7});
  const Topology shape = topology(surface.mesh.faces, surface.mesh.numVertices());
  EXPECT_TRUE(shape.manifold());
  EXPECT_TRUE(shape.closed);
  EXPECT_EQ(shape.components, 1);
  EXPECT_TRUE(surface.warnings.empty());
  Eigen::Matrix3Xd seen(3, 0);
  for (std::size_t v = 0; v < surface.seen.size(); ++v) {
    if (!surface.seen[v])
      continue;
    seen.conservativeResize(3, seen.cols() + 1);
    seen.rightCols<1>() = surface.mesh.vertices.col(static_cast<Eigen::Index>(v));
  }
  // Leaves of the octree are about 15 mm.
  const std::vector<double> distances = distancesTo(body, seen);
  EXPECT_LT(distances[distances.size() / 2], 0.003);
}

using Move = std::function<void(BodyPose& pose, int view)>;

class FusedSkirt : public FusionTest {
 protected:
  FusionOptions options(bool legsCovered) const {
    return {.voxelSize = kVoxel, .truncation = 3.0 * kVoxel, .legsCovered = legsCovered};
  }

  /// A skirt that is wider all round by this [m] than the one in the middle.
  TriangleMesh skirt(double wider) const {
    return test::openCone(waist_, 0.5, 0.22 + wider, 0.4 + wider);
  }

  /// What a frame sees of a skirt that goes with the hips and stays upright.
  PosedDepthFrame frameOf(TriangleMesh skirt, const BodyPose& pose, double angle) const {
    const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitY());
    const Eigen::Vector3d pelvis = skinning_.pose(shaped_, pose).joints.col(kPelvis);
    skirt.vertices =
        (turn.toRotationMatrix() * (skirt.vertices.colwise() - waist_)).colwise() + pelvis;
    return test::renderedFrame(std::array{test::PaintedMesh{skirt}}, test::frontCamera(2.2), pose);
  }

  Eigen::Matrix3Xd fused(
      const std::vector<PosedDepthFrame>& frames, const FusionOptions& options) const {
    CanonicalFusion fusion(skinning_, betas_, aPose(), options);
    for (const PosedDepthFrame& frame : frames)
      fusion.allocate(frame);
    for (const PosedDepthFrame& frame : frames)
      fusion.integrate(frame);
    return surfacePoints(fusion.volume(), 0.05).points;
  }

  /// Median distance of what is fused from a skirt that keeps its shape, whatever moves beneath
  /// [m].
  double medianError(bool legsCovered, const Move& move) const {
    std::vector<PosedDepthFrame> frames;
    for (int view = 0; view < kViews; ++view) {
      const double angle = 2.0 * std::numbers::pi * view / kViews;
      BodyPose pose = test::turned(aPose(), angle);
      move(pose, view);
      frames.push_back(frameOf(skirt(0.0), pose, angle));
    }
    const std::vector<double> distances =
        distancesTo(skirt(0.0), fused(frames, options(legsCovered)));
    return distances[distances.size() / 2];
  }

  /// Points fused of a skirt that swings in and out like a pendulum while the person turns [m].
  Eigen::Matrix3Xd fusedSwinging(double swing, const FusionOptions& options) const {
    constexpr int kPhases = 4;
    std::vector<PosedDepthFrame> frames;
    for (int view = 0; view < kViews; ++view) {
      const double angle = 2.0 * std::numbers::pi * view / kViews;
      for (int phase = 0; phase < kPhases; ++phase) {
        const double wider = swing * std::cos(std::numbers::pi * (phase + 0.5) / kPhases);
        frames.push_back(frameOf(skirt(wider), test::turned(aPose(), angle), angle));
      }
    }
    return fused(frames, options);
  }

  Eigen::Vector3d waist_ = canonicalJoint(kPelvis);
};

TEST_F(FusedSkirt, DoesntStepWithTheLegs) {
  const Move step = [](BodyPose& pose, int view) {
    pose.jointRotations[3 * kLeftHip] += 0.3 * std::sin(2.0 * view);
    pose.jointRotations[3 * kRightHip] -= 0.3 * std::sin(2.0 * view);
  };
  EXPECT_LT(medianError(true, step), 0.5 * kVoxel);
  EXPECT_GT(medianError(false, step), kVoxel)
      << "steps of 0.3 rad move a thigh by a tenth of a metre";
}

TEST_F(FusedSkirt, HangsPlumbHoweverThePelvisTilts) {
  const Move tilt = [](BodyPose& pose, int view) {
    const Eigen::AngleAxisd pitch(0.1 * std::sin(2.0 * view), Eigen::Vector3d::UnitX());
    pose.jointRotations.head<3>() = axisAngleFromQuaternion(
        quaternionFromAxisAngle(pose.jointRotations.head<3>()) * Eigen::Quaterniond(pitch));
  };
  EXPECT_LT(medianError(true, tilt), 0.5 * kVoxel);
  EXPECT_GT(medianError(false, tilt), kVoxel) << "0.1 rad move the hem by 5 cm";
}

TEST_F(FusedSkirt, IsFusedAtTheMiddleOfItsSwing) {
  constexpr double kSwing = 0.03;  // either way [m]
  FusionOptions far = options(true);
  far.truncation = 2.0 * kVoxel;
  FusionOptions near = far;
  near.hangingTruncation = near.truncation;
  const auto medianFrom = [&](double wider, const FusionOptions& options) {
    const std::vector<double> distances = distancesTo(skirt(wider), fusedSwinging(kSwing, options));
    return distances[distances.size() / 2];
  };
  // All places weigh alike where none is out of reach; planes under several angles and voxels of
  // 8 mm leave half a voxel.
  EXPECT_LT(medianFrom(0.0, far), 0.5 * kVoxel);
  // s = 2.8, 1.1, −1.1 and −2.8 cm: 2 cm inside of the middle the inner two alone are within
  // 1.6 cm, and are 0 on average there.
  EXPECT_GT(medianFrom(0.0, near), 0.5 * kSwing);
  EXPECT_LT(medianFrom(-0.02, near), 0.5 * kVoxel);
}

TEST_F(FusionTest, ArmsTouchTheTrunkOnlyWhereTheyCameNearIt) {
  BodyPose hanging = aPose();
  for (const int axis : {0, 1, 2}) {
    hanging.jointRotations[3 * kLeftShoulder + axis] *= 2.2;
    hanging.jointRotations[3 * kRightShoulder + axis] *= 2.2;
  }
  const SkinnedBody live = skinning_.pose(shaped_, hanging);
  const SkinnedBody canonical = skinning_.pose(shaped_, aPose());
  const std::vector<Limb> limbs = limbsOfBody(model_);
  const ArmContact contact(live.vertices.cast<float>(), canonical.vertices, limbs);
  const ArmContact still(canonical.vertices.cast<float>(), canonical.vertices, limbs);
  constexpr float kDistance = 0.05F;
  constexpr float kApart = 0.08F;
  int touching = 0;
  for (Eigen::Index v = 0; v < live.vertices.cols(); ++v) {
    const Eigen::Vector3f here = live.vertices.col(v).cast<float>();
    const Eigen::Vector3f place = canonical.vertices.col(v).cast<float>();
    ASSERT_FALSE(still.isAt(place, place, kDistance, kApart)) << "nothing moved";
    // The slow and obvious version.
    bool expected = false;
    for (Eigen::Index other = 0; other < live.vertices.cols() && !expected; ++other) {
      const float now = (live.vertices.col(other).cast<float>() - here).norm();
      const float then = (canonical.vertices.col(other).cast<float>() - place).norm();
      expected = now < 0.5F * kDistance && then > now + 1.2F * kApart;
    }
    const bool found = contact.isAt(here, place, kDistance, kApart);
    // Cells know one vertex of each: what is well within must be found.
    EXPECT_TRUE(found || !expected) << v;
    touching += found ? 1 : 0;
  }
  EXPECT_GT(touching, 0);
  EXPECT_LT(touching, live.vertices.cols() / 2);
}

TEST(MedianGap, OfSpheresInOneAnotherIsTheirDistance) {
  const TriangleMesh sphere = test::icosphere(1.0, 4);
  const auto points = [&](double radius) {
    FusedPoints result;
    result.points = radius * sphere.vertices;
    result.normals = sphere.vertices;
    return result;
  };
  const std::optional<double> gap = medianGap(points(0.12), points(0.125), 0.02);
  ASSERT_TRUE(gap);
  EXPECT_NEAR(*gap, 0.005, 1e-4);  // the nearest point is straight above
  EXPECT_FALSE(medianGap(points(0.12), points(0.2), 0.02)) << "out of reach";
  FusedPoints inwards = points(0.125);
  inwards.normals *= -1.0;
  EXPECT_FALSE(medianGap(points(0.12), inwards, 0.02)) << "another side of something thin";
}

TEST_F(FusionTest, RefusesImagesOfAnotherSize) {
  PosedDepthFrame frame = frameOf(aPose());
  frame.depth.pop_back();
  CanonicalFusion fusion(skinning_, betas_, aPose());
  EXPECT_THROW(fusion.allocate(frame), std::invalid_argument);
  EXPECT_THROW(
      CanonicalFusion(skinning_, betas_, aPose(), {.voxelSize = -1}), std::invalid_argument);
  for (const double truncation : {0.0, 0.3, std::nan("")})
    EXPECT_THROW(
        CanonicalFusion(skinning_, betas_, aPose(), {.hangingTruncation = truncation}),
        std::invalid_argument);
}

TEST(Fusion, OfAStillSphereIsTheSphere) {
  // Radius 12 cm; the "body" is the sphere itself with one joint.
  const TriangleMesh sphere = test::icosphere(0.12, 4);
  BodyModel model;
  model.templateVertices = sphere.vertices;
  model.faces = sphere.faces;
  model.shapeDirections = Eigen::MatrixXd::Zero(3 * sphere.numVertices(), 1);
  model.parents = {-1};
  model.jointRegressor.resize(1, sphere.numVertices());
  model.jointRegressor.insert(0, 0) = 1.0;
  model.skinningWeights.resize(sphere.numVertices(), 1);
  for (Eigen::Index v = 0; v < sphere.numVertices(); ++v)
    model.skinningWeights.insert(v, 0) = 1.0;
  model.skinningWeights.makeCompressed();
  model.jointRegressor.makeCompressed();
  const Skinning skinning(model);
  const BodyPose still{.jointRotations = Eigen::VectorXd::Zero(3)};
  const std::vector<test::PaintedMesh> painted = {{sphere}};
  const PosedDepthFrame frame = test::renderedFrame(painted, test::frontCamera(1.0), still);
  CanonicalFusion fusion(skinning, Eigen::VectorXd::Zero(1), still);
  fusion.allocate(frame);
  fusion.integrate(frame);
  const FusedPoints points = surfacePoints(fusion.volume(), 0.05);
  ASSERT_GT(points.size(), 2000);
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    // A pixel is 3 mm wide here: within one the plane departs from the sphere by less than 0.1 mm
    // in the middle, and at the rim by the cosine's inverse of it; a quarter voxel holds it all.
    ASSERT_NEAR(points.points.col(i).norm(), 0.12, 0.001);
    ASSERT_GT(points.normals.col(i).dot(points.points.col(i).normalized()), 0.9);
  }
}

}  // namespace
}  // namespace avatar
