#include "avatar/surface_attachment.h"

#include "tests/support/primitive_meshes.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <stdexcept>

namespace avatar {
namespace {

TEST(SurfaceAttachment, PointsRideOnARigidMotion) {
  const TriangleMesh body = test::icosphere(0.5, 3);
  const Eigen::Matrix3Xd points = 1.04 * body.vertices.leftCols(50);
  const SurfaceAttachment attachment(points, body);
  EXPECT_LT((attachment.points(body) - points).cwiseAbs().maxCoeff(), 1e-14);
  const Eigen::Isometry3d motion = Eigen::Translation3d(0.3, -1.0, 2.0) *
                                   Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  const Eigen::Matrix3Xd moved = motion * body.vertices;
  const Eigen::Matrix3Xd expected = motion * points;
  EXPECT_LT((attachment.points({moved, body.faces}) - expected).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(SurfaceAttachment, PointsKeepTheirDistanceWhenTheSurfaceGrows) {
  const TriangleMesh body = test::icosphere(0.5, 4);
  const Eigen::Matrix3Xd points = (0.51 / 0.5) * body.vertices.leftCols(20);
  const SurfaceAttachment attachment(points, body);
  const Eigen::Matrix3Xd larger = 1.5 * body.vertices;
  const Eigen::Matrix3Xd moved = attachment.points({larger, body.faces});
  for (Eigen::Index i = 0; i < moved.cols(); ++i)
    EXPECT_NEAR(moved.col(i).norm(), 0.75 + 0.01, 1e-3);  // 1 cm off; faces are nearly tangential
}

TEST(SurfaceAttachment, NeedsASurface) {
  EXPECT_THROW(
      SurfaceAttachment(Eigen::Matrix3Xd::Zero(3, 1), TriangleMesh{}), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
