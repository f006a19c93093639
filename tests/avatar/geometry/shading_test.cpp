#include "avatar/geometry/shading.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace avatar {
namespace {

Camera shadingCamera() {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 60.0;
  camera.cx = 31.5;
  camera.cy = 23.5;
  camera.cameraFromWorld = lookAt({0.0, 0.0, 3.0}, Eigen::Vector3d::Zero());
  return camera;
}

int channel(const ColorImage& image, int x, int y, int c) {
  return image.rgb[3 * (static_cast<std::size_t>(y) * image.width + x) + c];
}

ShadingOptions headLightOnly() {
  ShadingOptions options;
  options.headLight = {0.0, 0.0, -1.0};
  options.headIntensity = 1.0;
  options.fillIntensity = 0.0;
  return options;
}

/// A lit face has colour × cos of the angle to the light, and its wrapped square for half-Lambert.
TEST(Shading, FollowsTheCosineLaw) {
  TriangleMesh plate = test::rectangle(4.0, 4.0, 1, 1);
  plate.vertices.colwise() -= Eigen::Vector3d(2.0, 2.0, 0.0);
  const double angle = test::kPi / 3.0;
  const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitY());
  plate.vertices = turn.toRotationMatrix() * plate.vertices;
  ShadingOptions options = headLightOnly();
  const ShadedMesh shaded{plate, Eigen::Vector3d(0.8, 0.4, 0.2)};
  options.wrap = 0.0;
  const ColorImage lambert = shade(shaded, shadingCamera(), options);
  options.wrap = 1.0;
  const ColorImage half = shade(shaded, shadingCamera(), options);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(channel(lambert, 32, 24, c), 255.0 * shaded.color[c] * 0.5, 1.0) << "8-bit";
    EXPECT_NEAR(channel(half, 32, 24, c), 255.0 * shaded.color[c] * 0.5625, 1.0) << "8-bit";
  }
}

TEST(Shading, ShowsTheBackgroundBesideTheMeshAndBackFacesInTheirColour) {
  TriangleMesh sphere = test::icosphere(0.5, 3);
  ShadingOptions options = headLightOnly();
  options.background = {0.0, 0.0, 1.0};
  ShadedMesh shaded{sphere, Eigen::Vector3d(1.0, 0.0, 0.0)};
  shaded.backColor = Eigen::Vector3d(0.0, 1.0, 0.0);
  const ColorImage outside = shade(shaded, shadingCamera(), options);
  EXPECT_EQ(channel(outside, 1, 1, 2), 255);
  EXPECT_GT(channel(outside, 32, 24, 0), 240);
  EXPECT_EQ(channel(outside, 32, 24, 1), 0);
  sphere.faces.row(1).swap(sphere.faces.row(2));
  const ColorImage inside = shade(shaded, shadingCamera(), options);
  EXPECT_EQ(channel(inside, 32, 24, 0), 0);
  EXPECT_GT(channel(inside, 32, 24, 1), 240);
}

TEST(Shading, InterpolatesVertexColoursAndSupersamplingKeepsTheirMean) {
  TriangleMesh plate = test::rectangle(8.0, 8.0, 1, 1);
  plate.vertices.colwise() -= Eigen::Vector3d(4.0, 4.0, 0.0);
  Eigen::Matrix3Xd colors = Eigen::Matrix3Xd::Zero(3, 4);
  for (int i = 0; i < 4; ++i) {
    colors(0, i) = (plate.vertices(0, i) + 4.0) / 8.0;  // linear in x, so any split gives the same
  }
  ShadingOptions options = headLightOnly();
  ShadedMesh shaded{plate};
  shaded.vertexColors = &colors;
  for (const int factor : {1, 3}) {
    options.supersampling = factor;
    const ColorImage image = shade(shaded, shadingCamera(), options);
    for (int x = 0; x < 64; x += 9) {
      const double worldX = 3.0 * (x - 31.5) / 60.0;
      EXPECT_NEAR(channel(image, x, 20, 0), 255.0 * (worldX + 4.0) / 8.0, 1.0) << "8-bit";
    }
  }
}

TEST(Shading, WireframeDarkensEdgesOnly) {
  TriangleMesh plate = test::rectangle(8.0, 8.0, 1, 1);
  plate.vertices.colwise() -= Eigen::Vector3d(4.0, 4.0, 0.0);
  ShadingOptions options = headLightOnly();
  options.wireColor.setZero();
  ShadedMesh shaded{plate, Eigen::Vector3d::Ones()};
  shaded.wireframe = true;
  Camera camera = shadingCamera();
  camera.cx = 32.0;  // the diagonal x = y of the plate passes exactly through pixel (32, 24)
  camera.cy = 24.0;
  const ColorImage image = shade(shaded, camera, options);
  EXPECT_EQ(channel(image, 32, 24, 0), 0);
  EXPECT_EQ(channel(image, 38, 24, 0), 255);
}

TEST(Shading, RejectsColoursOfAnotherMesh) {
  const TriangleMesh cube = test::cube();
  const Eigen::Matrix3Xd colors = Eigen::Matrix3Xd::Zero(3, 7);
  ShadedMesh shaded{cube};
  shaded.vertexColors = &colors;
  EXPECT_THROW(shade(shaded, shadingCamera()), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
