#include "src/evaluation/depth_error.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace simulcap {
namespace {

const avatar::Camera kTinyCamera = {
    .width = 4, .height = 3, .fx = 10, .fy = 10, .cx = 1.5, .cy = 1.0};

/// A wall of the person 2 m in front of the camera, one pixel not measured.
DepthCloud wall() {
  DepthCloud cloud;
  cloud.width = kTinyCamera.width;
  cloud.height = kTinyCamera.height;
  cloud.depth.assign(12, 2.0F);
  cloud.person.assign(12, 1);
  cloud.person[cloud.index(3, 2)] = 0;
  cloud.points.resize(3, 12);
  cloud.normals = Eigen::Matrix3Xf::Zero(3, 12);
  cloud.normals.row(2).setConstant(-1.0F);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x)
      cloud.points.col(static_cast<Eigen::Index>(cloud.index(x, y))) =
          avatar::unproject(kTinyCamera, {double(x), double(y), 2.0}).cast<float>();
  return cloud;
}

Eigen::Vector3d at(double u, double v, double z) {
  return avatar::unproject(kTinyCamera, {u, v, z});
}

TEST(DepthErrors, AreDistancesToTheDepthSurface) {
  Eigen::Matrix3Xd vertices(3, 5);
  vertices << at(1.2, 1.1, 1.99), at(0, 0, 2.03), at(2, 2, 1.5), at(3, 2, 2.0), at(9, 1, 2.0);
  const std::vector<std::uint8_t> visible = {1, 1, 0, 1, 1};
  DepthErrors errors;
  addDepthErrors(vertices, visible, kTinyCamera, wall(), errors);
  // 10 mm in front of the wall wherever in the pixel, and 30 mm behind it; the third is hidden.
  EXPECT_EQ(errors.millimetres.totalWeight(), 2.0);
  EXPECT_NEAR(errors.millimetres.mean(), 20.0, 1e-4);  // float points
  EXPECT_NEAR(errors.millimetres.max(), 30.0, 1e-4);
  EXPECT_EQ(errors.unmeasured, 2);  // the pixel without depth, and outside the image
}

TEST(DepthErrors, WithoutANormalThePointCounts) {
  DepthCloud cloud = wall();
  cloud.normals.setZero();
  DepthErrors errors;
  const std::vector<std::uint8_t> visible = {1};
  addDepthErrors(
      at(1, 1, 2.0) + Eigen::Vector3d(0.03, 0.0, 0.04), visible, kTinyCamera, cloud, errors);
  EXPECT_NEAR(errors.millimetres.mean(), 50.0, 1e-4);
}

TEST(DepthErrors, TheCameraMayStandAnywhere) {
  avatar::Camera moved = kTinyCamera;
  moved.cameraFromWorld.translate(Eigen::Vector3d(5.0, -3.0, 2.0));
  DepthErrors errors;
  const std::vector<std::uint8_t> visible = {1};
  const Eigen::Vector3d vertex = moved.cameraFromWorld.inverse() * at(1, 1, 2.01);
  addDepthErrors(vertex, visible, moved, wall(), errors);
  EXPECT_NEAR(errors.millimetres.mean(), 10.0, 1e-4);
}

TEST(DepthErrors, RefusesWhatDoesNotFit) {
  DepthErrors errors;
  const std::vector<std::uint8_t> none;
  EXPECT_THROW(
      addDepthErrors(at(1, 1, 2), none, kTinyCamera, wall(), errors), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
