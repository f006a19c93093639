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

/// The normal as the header says, pixel by pixel and in double: differences over ±reach, averaged
/// over a window of ±reach, those of one surface only.
Eigen::Vector3d obviousNormal(const DepthCloud& cloud, int column, int line, int reach) {
  const auto inverse = [&](int x, int y) {
    const bool inside = x >= 0 && y >= 0 && x < cloud.width && y < cloud.height;
    return inside && cloud.person[cloud.index(x, y)] != 0
               ? 1.0 / static_cast<double>(cloud.depth[cloud.index(x, y)])
               : 0.0;
  };
  const auto meanDifference = [&](int dx, int dy, double focal) {
    double sum = 0.0;
    int count = 0;
    for (int y = line - reach; y <= line + reach; ++y) {
      for (int x = column - reach; x <= column + reach; ++x) {
        const double w = inverse(x, y);
        const double after = inverse(x + dx, y + dy);
        const double before = inverse(x - dx, y - dy);
        const double noise = 5.0 * (0.0012 + 0.0019 * std::pow(1.0 / w - 0.4, 2)) * w * w;
        const double limit = noise + 2.5 * reach / focal * w;
        if (!(w > 0.0 && after > 0.0 && before > 0.0) || std::abs(after - w) > limit ||
            std::abs(w - before) > limit)
          continue;
        sum += after - before;
        ++count;
      }
    }
    return count > 0 ? 0.5 * focal / reach * sum / count : std::nan("");
  };
  const double du = meanDifference(reach, 0, kCamera.fx);
  const double dv = meanDifference(0, reach, kCamera.fy);
  const Eigen::Vector3d ray = rayInCamera(kCamera, column, line);
  const Eigen::Vector3d normal(-du, -dv, ray.x() * du + ray.y() * dv - inverse(column, line));
  return normal.allFinite() ? Eigen::Vector3d(normal.normalized()) : Eigen::Vector3d::Zero();
}

TEST(DepthSurface, AgreesWithTheObviousWay) {
  DepthCloud cloud = cloudOf([](const Eigen::Vector3d& ray) {
    const double z = ball(ray);
    return z > 0.0 ? z : (ray.x() > 0.1 ? 1.7 + 0.2 * ray.y() : 0.0);  // a wall behind on the right
  });
  std::mt19937 random(11);
  for (std::size_t i = 0; i < cloud.depth.size(); ++i) {
    if (random() % 20 == 0)
      cloud.person[i] = 0;  // holes
    cloud.depth[i] *= 1.0F + 0.002F * static_cast<float>(random() % 1000) / 1000.0F;
  }
  const DepthCloud surface = withSurface(cloud, kCamera);
  constexpr int kReach = 2;  // half of 2.5 cm at 1.5 m and 260 px: 2.2
  double worst = 0.0;
  for (int y = 0; y < cloud.height; ++y) {
    for (int x = 0; x < cloud.width; ++x) {
      const std::size_t i = cloud.index(x, y);
      const Eigen::Vector3d expected =
          cloud.person[i] != 0 ? obviousNormal(cloud, x, y, kReach) : Eigen::Vector3d::Zero();
      const Eigen::Vector3d found = surface.normals.col(i).cast<double>();
      worst = std::max(worst, (found - expected).norm());
    }
  }
  // Running sums in float of some 0.05 per row lose 1e-6 over 120 rows; a normal is the difference
  // times 260 px / 4 over 0.7.
  EXPECT_LT(worst, 1e-3);
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
