#include "src/input/depth_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace simulcap {
namespace {

const avatar::Camera kCamera{
    .width = 160, .height = 120, .fx = 260.0, .fy = 262.0, .cx = 79.5, .cy = 59.5};

/// A cloud whose pixels with depth are all the person's.
DepthCloud cloudOf(const std::function<double(const Eigen::Vector3d&)>& depthAlong) {
  DepthCloud cloud{.width = kCamera.width, .height = kCamera.height};
  for (int y = 0; y < cloud.height; ++y) {
    for (int x = 0; x < cloud.width; ++x) {
      const auto z = static_cast<float>(depthAlong(rayInCamera(kCamera, x, y)));
      cloud.depth.push_back(z);
      cloud.person.push_back(z > 0.0F ? 1 : 0);
    }
  }
  return cloud;
}

double degrees(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return static_cast<double>(std::acos(std::clamp(a.dot(b), -1.0F, 1.0F))) * 57.29577951;
}

TEST(DepthSurface, PointsLieOnTheRaysAtTheirDepth) {
  const DepthCloud cloud = withSurface(cloudOf([](const auto&) { return 2.0; }), kCamera);
  const Eigen::Vector3d expected = 2.0 * rayInCamera(kCamera, 10, 100);
  const Eigen::Vector3f point = cloud.points.col(cloud.index(10, 100));
  EXPECT_LT((point.cast<double>() - expected).norm(), 1e-6);  // float
}

TEST(DepthSurface, NormalsOfAPlaneAreExact) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.4, -0.5, -0.8).normalized();
  const auto plane = [&](const Eigen::Vector3d& ray) { return -1.6 / normal.dot(ray); };
  const DepthCloud cloud = withSurface(cloudOf(plane), kCamera);
  double worst = 0.0;
  for (Eigen::Index i = 0; i < cloud.normals.cols(); ++i)
    worst = std::max(worst, degrees(cloud.normals.col(i), normal.cast<float>()));
  EXPECT_LT(worst, 0.1);  // float differences of 1/z near 0.5 over a few pixels
}

/// A ball of 0.25 m at 1.5 m: the sizes of a torso.
double ball(const Eigen::Vector3d& ray) {
  const Eigen::Vector3d centre(0.0, 0.0, 1.5);
  const double a = ray.squaredNorm();
  const double b = ray.dot(centre);
  const double root = b * b - a * (centre.squaredNorm() - 0.25 * 0.25);
  return root > 0.0 ? (b - std::sqrt(root)) / a : 0.0;
}

double meanBallError(const DepthCloud& cloud, double maxSlope) {
  double sum = 0.0;
  double count = 0.0;
  for (int y = 0; y < cloud.height; ++y) {
    for (int x = 0; x < cloud.width; ++x) {
      const double z = ball(rayInCamera(kCamera, x, y));
      if (z <= 0.0)
        continue;
      const Eigen::Vector3d point = z * rayInCamera(kCamera, x, y);
      const Eigen::Vector3d normal = (point - Eigen::Vector3d(0.0, 0.0, 1.5)) / 0.25;
      if (normal.dot(-point.normalized()) < std::cos(maxSlope))
        continue;
      sum += degrees(cloud.normals.col(cloud.index(x, y)), normal.cast<float>());
      count += 1.0;
    }
  }
  return sum / count;
}

TEST(DepthSurface, NormalsOfABallFollowItsCurvature) {
  // Up to 60° from the ray; a window of 2.5 cm on 25 cm radius averages over 6°.
  EXPECT_LT(meanBallError(withSurface(cloudOf(ball), kCamera), 1.05), 1.5);
}

TEST(DepthSurface, NoiseIsAveraged) {
  DepthCloud cloud = cloudOf(ball);
  std::mt19937 random(7);
  for (float& z : cloud.depth) {
    const double uniform = static_cast<double>(random()) / 4294967296.0 - 0.5;
    if (z > 0.0F)
      z += static_cast<float>(0.0036 * std::sqrt(12.0) * uniform);  // σ of a Kinect at 1.5 m
  }
  // A single difference over 2.5 cm would err by atan(3.6 mm · √2 / 25 mm) = 11.5° in each of two
  // directions.
  EXPECT_LT(meanBallError(withSurface(std::move(cloud), kCamera), 1.05), 6.0);
}

TEST(DepthSurface, NormalsDoNotBendAtAJump) {
  const auto steps = [](const Eigen::Vector3d& ray) { return ray.x() < 0.0 ? 1.5 : 1.8; };
  const DepthCloud cloud = withSurface(cloudOf(steps), kCamera);
  for (int x = 0; x < cloud.width; ++x) {
    const Eigen::Vector3f normal = cloud.normals.col(cloud.index(x, 60));
    ASSERT_LT(degrees(normal, -Eigen::Vector3f::UnitZ()), 0.1) << x;
  }
}

TEST(DepthSurface, WithoutAPersonThereIsNothing) {
  const DepthCloud cloud = withSurface(cloudOf([](const auto&) { return 0.0; }), kCamera);
  EXPECT_EQ(cloud.points.norm(), 0.0F);
  EXPECT_EQ(cloud.normals.norm(), 0.0F);
}

TEST(DepthSurface, ALonePixelHasNoNormal) {
  DepthCloud cloud = cloudOf([](const auto&) { return 0.0; });
  cloud.depth[cloud.index(50, 50)] = 1.0F;
  cloud.person[cloud.index(50, 50)] = 1;
  cloud = withSurface(std::move(cloud), kCamera);
  EXPECT_GT(cloud.points.col(cloud.index(50, 50)).norm(), 0.9F);
  EXPECT_EQ(cloud.normals.norm(), 0.0F);
}

}  // namespace
}  // namespace simulcap
