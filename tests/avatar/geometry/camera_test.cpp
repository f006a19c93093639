#include "avatar/geometry/camera.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace avatar {
namespace {

Camera obliqueCamera() {
  Camera camera;
  camera.width = 320;
  camera.height = 200;
  camera.fx = 300.0;
  camera.fy = 260.0;
  camera.cx = 120.5;
  camera.cy = 130.25;
  camera.cameraFromWorld = lookAt({1.0, 2.0, 3.0}, {0.2, 0.5, -0.3}, {0.1, 1.0, 0.2});
  return camera;
}

TEST(Camera, UnprojectInvertsProject) {
  const Camera camera = obliqueCamera();
  const Eigen::Vector3d point(0.4, 0.3, 0.2);
  const Eigen::Vector3d back = unproject(camera, project(camera, point));
  EXPECT_LT((back - point).norm(), 1e-14);  // a few roundings of doubles of size 4
}

TEST(Camera, LookAtCentresTheTargetAndShowsUpUpwards) {
  const Eigen::Vector3d eye(1.0, 2.0, 3.0);
  const Eigen::Vector3d target(0.2, 0.5, -0.3);
  Camera camera;
  camera.cameraFromWorld = lookAt(eye, target);
  const Eigen::Vector3d pixel = project(camera, target);
  EXPECT_NEAR(pixel.x(), camera.cx, 1e-10);
  EXPECT_NEAR(pixel.y(), camera.cy, 1e-10);
  EXPECT_NEAR(pixel.z(), (target - eye).norm(), 1e-14);
  EXPECT_LT((centre(camera) - eye).norm(), 1e-14);
  const Eigen::Vector3d above = project(camera, target + 0.1 * Eigen::Vector3d::UnitY());
  EXPECT_NEAR(above.x(), camera.cx, 1e-10);
  EXPECT_LT(above.y(), camera.cy);
  EXPECT_NEAR(camera.cameraFromWorld.linear().determinant(), 1.0, 1e-14);
}

TEST(Camera, LookAtRejectsViewsWithoutADirection) {
  EXPECT_THROW(lookAt({0, 0, 0}, {0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(lookAt({0, 0, 0}, {0, 2, 0}), std::invalid_argument);
}

TEST(Camera, FrameBoxTouchesTheMarginAndCutsNothing) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.5, 0.0, -0.2), Eigen::Vector3d(0.6, 1.8, 0.3));
  FramingOptions options;
  options.viewDirection = {-0.4, -0.3, -1.0};
  options.margin = 0.1;
  const Camera camera = frameBox(obliqueCamera(), box, options);
  Eigen::AlignedBox2d image;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p =
        project(camera, box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
    EXPECT_GT(p.z(), 0.0);
    image.extend(p.head<2>());
  }
  // The image's borders are half a pixel outside the outermost pixel centres.
  const Eigen::Array2d size(camera.width, camera.height);
  const Eigen::Array2d low = (image.min().array() + 0.5) / size;
  const Eigen::Array2d high = (image.max().array() + 0.5) / size;
  EXPECT_GE(low.minCoeff(), 0.1 - 1e-9);
  EXPECT_LE(high.maxCoeff(), 0.9 + 1e-9);
  EXPECT_NEAR((high - low).maxCoeff(), 0.8, 1e-9) << "one side fills the free part";
}

TEST(Camera, ScaledResolutionKeepsTheViewAtThePixelsBorders) {
  const Camera camera = obliqueCamera();
  const Camera fine = scaledResolution(camera, 4);
  const Eigen::Vector3d point(0.4, 0.3, 0.2);
  const Eigen::Vector3d coarsePixel = project(camera, point);
  const Eigen::Vector3d finePixel = project(fine, point);
  EXPECT_NEAR(finePixel.x() + 0.5, 4.0 * (coarsePixel.x() + 0.5), 1e-9);
  EXPECT_NEAR(finePixel.y() + 0.5, 4.0 * (coarsePixel.y() + 0.5), 1e-9);
}

}  // namespace
}  // namespace avatar
