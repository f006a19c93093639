#include "src/fitting/depth_targets.h"

#include "src/fitting/layer_view.h"
#include "src/fitting/steady_targets.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace simulcap {
namespace {

constexpr double kDistance = 2.0;  // of the sheet from the camera [m]

avatar::Camera smallCamera() {
  return {.width = 160, .height = 120, .fx = 130.0, .fy = 130.0, .cx = 79.5, .cy = 59.5};
}

/// A square of a metre that faces the camera, `distance` [m] in front of it.
avatar::TriangleMesh sheetAt(double distance, double size = 1.0) {
  constexpr int kCells = 20;
  return avatar::test::grid(kCells, kCells, false, false, [&](int i, int j) {
    return Eigen::Vector3d(
        size * (static_cast<double>(i) / kCells - 0.5),
        size * (0.5 - static_cast<double>(j) / kCells),
        distance);
  });
}

/// What a perfect camera measures of a plane in front of it.
DepthCloud planeCloud(const avatar::Camera& camera, float depth) {
  DepthCloud cloud;
  cloud.width = camera.width;
  cloud.height = camera.height;
  const auto count = static_cast<std::size_t>(camera.width * camera.height);
  cloud.depth.assign(count, depth);
  cloud.person.assign(count, 1);
  cloud.points.resize(3, static_cast<Eigen::Index>(count));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x)
      cloud.points.col(static_cast<Eigen::Index>(cloud.index(x, y))) =
          (avatar::rayInCamera(camera, x, y) * static_cast<double>(depth)).cast<float>();
  }
  return cloud;
}

avatar::TriangleMesh nothing() {
  avatar::TriangleMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Zero(3, 0);
  mesh.faces = Eigen::Matrix3Xi::Zero(3, 0);
  return mesh;
}

GarmentView viewOf(const avatar::TriangleMesh& sheet, const avatar::TriangleMesh& body) {
  LayerViewer viewer(smallCamera());
  return viewer(body, {avatar::MeshView(sheet)}).front();
}

TEST(DepthTargets, LieOnTheMeasuredSurface) {
  const avatar::TriangleMesh sheet = sheetAt(kDistance);
  const GarmentView view = viewOf(sheet, nothing());
  const GarmentTargets found =
      depthTargets({.mesh = sheet, .view = view}, smallCamera(), planeCloud(smallCamera(), 2.03F));
  ASSERT_GT(found.targets.size(), 100U);
  EXPECT_EQ(found.rejected.total(), 0);
  for (std::size_t i = 0; i < found.targets.size(); ++i) {
    const bullet_ext::DepthTarget& target = found.targets[i];
    EXPECT_EQ(target.numPoints, 9);
    EXPECT_NEAR(target.weights.sum(), 1.0F, 1e-6F);
    EXPECT_NEAR(found.residuals[i], 0.03F, 1e-6F);
    const Eigen::Vector3f mean = target.points * target.weights;
    const Eigen::Vector3d ray = sheet.vertices.col(target.vertex) / kDistance;
    // The ring is of whole pixels: its mean is within a pixel, 2.03/130 m, of the exact ray.
    EXPECT_LT((mean.cast<double>() - 2.03 * ray).norm(), 2.03 / 130.0);
  }
}

/// The depth plane is parallel to the sheet: its foot is 30 mm away along the sheet's normal, while
/// rays lead outwards.
TEST(DepthTargets, AlongNormalsTheyAreFeetOnTheMeasuredPlane) {
  const avatar::TriangleMesh sheet = sheetAt(kDistance);
  const GarmentView view = viewOf(sheet, nothing());
  const GarmentTargets rays =
      depthTargets({.mesh = sheet, .view = view}, smallCamera(), planeCloud(smallCamera(), 2.03F));
  const GarmentTargets feet = alongNormals(rays, sheet);
  ASSERT_EQ(feet.targets.size(), rays.targets.size());
  for (const bullet_ext::DepthTarget& target : feet.targets) {
    const Eigen::Vector3d wanted =
        sheet.vertices.col(target.vertex) + Eigen::Vector3d(0.0, 0.0, 0.03);
    EXPECT_EQ(target.numPoints, 1);
    EXPECT_EQ(target.weights.sum(), 1.0F);
    EXPECT_LT((target.points.col(0).cast<double>() - wanted).norm(), 1e-6);  // floats at 2 m
  }
}

TEST(DepthTargets, OccludedVerticesGetNone) {
  const avatar::TriangleMesh sheet = sheetAt(kDistance);
  const avatar::TriangleMesh arm = sheetAt(1.5, 0.3);  // hides 0.4 m of the sheet's middle
  const GarmentView view = viewOf(sheet, arm);
  for (Eigen::Index v = 0; v < sheet.numVertices(); ++v) {
    const double reach = sheet.vertices.col(v).head<2>().cwiseAbs().maxCoeff();
    if (reach < 0.17) {
      EXPECT_EQ(view.visible[static_cast<std::size_t>(v)], 0) << v;
    }
    // A pixel is 2/130 m there; the sheet's own border is at 0.5 m.
    if (reach > 0.2 + 2.0 * 2.0 / 130.0 && reach < 0.43) {
      EXPECT_EQ(view.visible[static_cast<std::size_t>(v)], 1) << v;
    }
  }
  const GarmentTargets found =
      depthTargets({.mesh = sheet, .view = view}, smallCamera(), planeCloud(smallCamera(), 2.0F));
  for (const bullet_ext::DepthTarget& target : found.targets)
    EXPECT_EQ(view.visible[static_cast<std::size_t>(target.vertex)], 1);
}

TEST(DepthTargets, BlendFadesTowardsTheSilhouette) {
  const avatar::TriangleMesh sheet = sheetAt(kDistance);
  LayerViewer viewer(smallCamera(), {.blendRadius = 0.2});
  const GarmentView view = viewer(nothing(), {avatar::MeshView(sheet)}).front();
  const double pixel = kDistance / smallCamera().fx;
  for (Eigen::Index v = 0; v < sheet.numVertices(); ++v) {
    const double toEdge = 0.5 - sheet.vertices.col(v).head<2>().cwiseAbs().maxCoeff();
    if (view.visible[static_cast<std::size_t>(v)] == 0)
      continue;
    const double u = std::clamp(toEdge / 0.2, 0.0, 1.0);
    const double expected = u * u * (3.0 - 2.0 * u);
    // smoothstep's slope is 1.5/R at most; rasterized edges and rounding cost a pixel each. The
    // distance in a 5 × 5 mask is within 3 % of Euclid's.
    EXPECT_NEAR(static_cast<double>(view.blend[v]), expected, 1.5 / 0.2 * 2.0 * pixel) << v;
  }
}

TEST(DepthTargets, OtherLayersPixelsAreRejected) {
  const avatar::TriangleMesh sheet = sheetAt(kDistance);
  const GarmentView view = viewOf(sheet, nothing());
  DepthCloud cloud = planeCloud(smallCamera(), 2.0F);
  cloud.labels.assign(cloud.depth.size(), kUpper);
  for (int y = 0; y < cloud.height; ++y)
    for (int x = 80; x < cloud.width; ++x)
      cloud.labels[cloud.index(x, y)] = kLower;
  const GarmentTargets found =
      depthTargets({.mesh = sheet, .view = view, .label = kUpper}, smallCamera(), cloud);
  EXPECT_GT(found.rejected.otherLayer, 50);
  ASSERT_GT(found.targets.size(), 50U);
  for (const bullet_ext::DepthTarget& target : found.targets) {
    EXPECT_LE(sheet.vertices(0, target.vertex), 0.5 * kDistance / 130.0 + 1e-9);
    for (int i = 0; i < target.numPoints; ++i)  // of pixel column 79 and less
      EXPECT_LT(target.points(0, i), 0.0F);
  }
}

TEST(DepthTargets, BlockOfWrongDepthIsRejectedAndCounted) {
  const avatar::TriangleMesh sheet = sheetAt(kDistance);
  const GarmentView view = viewOf(sheet, nothing());
  const avatar::Camera camera = smallCamera();
  DepthCloud cloud = planeCloud(camera, 2.0F);
  const DepthCloud wrong = planeCloud(camera, 1.9F);
  int inBlock = 0;
  for (int y = 50; y < 70; ++y) {
    for (int x = 70; x < 90; ++x) {
      cloud.depth[cloud.index(x, y)] = 1.9F;
      cloud.points.col(static_cast<Eigen::Index>(cloud.index(x, y))) =
          wrong.points.col(static_cast<Eigen::Index>(wrong.index(x, y)));
    }
  }
  for (Eigen::Index v = 0; v < sheet.numVertices(); ++v) {
    const Eigen::Vector3d seen = avatar::project(camera, sheet.vertices.col(v));
    const auto x = std::lround(seen.x());
    const auto y = std::lround(seen.y());
    inBlock += x >= 70 && x < 90 && y >= 50 && y < 70 ? 1 : 0;
  }
  const GarmentTargets found = depthTargets({.mesh = sheet, .view = view}, camera, cloud);
  EXPECT_GT(inBlock, 20);
  EXPECT_EQ(found.rejected.tooFar, inBlock);
  for (const bullet_ext::DepthTarget& target : found.targets)
    EXPECT_NEAR(target.points.leftCols(target.numPoints).row(2).minCoeff(), 2.0F, 1e-5F);
}

TEST(SteadyTargets, NoiseIsDampedAndMotionIsNot) {
  const avatar::TriangleMesh sheet = sheetAt(kDistance);
  const GarmentView view = viewOf(sheet, nothing());
  const avatar::Camera camera = smallCamera();
  SteadyTargets steady(sheet.numVertices(), {.gain = 0.1, .noise = 0.001});
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0.0F, 0.004F);  // = noise · z²
  double raw = 0.0;
  double filtered = 0.0;
  std::vector<float> before;
  std::vector<float> rawBefore;
  for (int frame = 0; frame < 40; ++frame) {
    // All of a frame's pixels are off alike, so that the ring doesn't average it out.
    GarmentTargets found = depthTargets(
        {.mesh = sheet, .view = view}, camera, planeCloud(camera, 2.0F + noise(random)));
    const std::vector<float> measured = found.residuals;
    steady.steady(found, sheet.vertices, camera);
    steady.endFrame();
    if (frame >= 20) {
      raw += std::pow(measured.front() - rawBefore.front(), 2);
      filtered += std::pow(found.residuals.front() - before.front(), 2);
    }
    before = found.residuals;
    rawBefore = measured;
  }
  EXPECT_LT(std::sqrt(filtered / raw), 0.2);  // gain 0.1 leaves 0.07 of the first difference
  // A step of 4 cm is ten times the noise.
  GarmentTargets found =
      depthTargets({.mesh = sheet, .view = view}, camera, planeCloud(camera, 2.04F));
  steady.steady(found, sheet.vertices, camera);
  EXPECT_NEAR(found.residuals.front(), 0.04F, 1e-4F);
}

}  // namespace
}  // namespace simulcap
