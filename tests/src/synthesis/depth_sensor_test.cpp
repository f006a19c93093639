#include "src/synthesis/depth_sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

namespace simulcap {
namespace {

avatar::Camera smallCamera() {
  return {.width = 160, .height = 120, .fx = 131.0, .fy = 131.0, .cx = 79.5, .cy = 59.5};
}

/// A plane through (0, 0, z) whose normal is turned by `angle` about the y axis.
std::vector<float> plane(const avatar::Camera& camera, double z, double angle = 0.0) {
  std::vector<float> depth;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double u = avatar::rayInCamera(camera, x, y).x();
      depth.push_back(static_cast<float>(z / (1.0 + std::tan(angle) * u)));
    }
  }
  return depth;
}

struct Spread {
  double mean = 0.0, deviation = 0.0;
  double measured = 0.0;  ///< share of pixels
};

Spread spreadAbout(const std::vector<float>& exact, const std::vector<float>& measured) {
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    if (!(measured[i] > 0.0F))
      continue;
    const double error = static_cast<double>(measured[i]) - static_cast<double>(exact[i]);
    sum += error;
    squares += error * error;
    count += 1.0;
  }
  const double mean = sum / count;
  return {
      mean, std::sqrt(squares / count - mean * mean), count / static_cast<double>(exact.size())};
}

SensedFrame sensed(SensorModel model, std::uint32_t seed = 3, std::uint32_t frame = 0) {
  return {{model, seed}, frame};
}

TEST(DepthSensor, IdealDepthIsExact) {
  const std::vector<float> depth = plane(smallCamera(), 2.0, 0.4);
  EXPECT_EQ(applySensor(depth, smallCamera(), sensed(SensorModel::kIdeal)), depth);
}

TEST(DepthSensor, KinectNoiseFollowsThePublishedCurve) {
  const avatar::Camera camera = smallCamera();
  for (const double z : {0.6, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0}) {
    // Planes at several depths within two steps, so that rounding errors spread evenly.
    double squares = 0.0;
    constexpr int kPlanes = 8;
    for (int i = 0; i < kPlanes; ++i) {
      const std::vector<float> exact = plane(camera, z + 2.0 * kinectDepthStep(z) * i / kPlanes);
      const Spread spread = spreadAbout(
          exact,
          applySensor(
              exact, camera, sensed(SensorModel::kKinectV1, 3, static_cast<std::uint32_t>(i))));
      squares += spread.deviation * spread.deviation + spread.mean * spread.mean;
    }
    const double published = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
    // 150000 samples: 0.2 %; the planes' own depths change the curve by up to 1.5 %.
    EXPECT_NEAR(std::sqrt(squares / kPlanes), published, 0.03 * published) << z;
  }
}

/// Nguyen et al. 2012, eq. 3, by hand.
TEST(DepthSensor, KinectNoiseHasThePublishedFigures) {
  constexpr double kPi = std::numbers::pi;
  EXPECT_NEAR(kinectAxialNoise(0.4, 0.0), 0.0012, 1e-12);
  EXPECT_NEAR(kinectAxialNoise(2.4, 0.0), 0.0012 + 0.0019 * 4.0, 1e-12);
  // At 60°, θ / (π/2 − θ) = 2.
  EXPECT_NEAR(kinectAxialNoise(1.0, kPi / 3.0), 0.001884 + 0.0004, 1e-12);
  EXPECT_NEAR(kinectAxialNoise(0.25, kPi / 3.0), 0.0012 + 0.0019 * 0.0225 + 0.0008, 1e-12);
  EXPECT_NEAR(kinectDepthStep(2.0), 4.0 / 348.0, 1e-12);  // z² / (8 · 580 px · 75 mm)
}

TEST(DepthSensor, KinectDepthsAreEighthsOfAPixelOfDisparity) {
  const avatar::Camera camera = smallCamera();
  for (const float z :
       applySensor(plane(camera, 2.0, 0.5), camera, sensed(SensorModel::kKinectV1))) {
    if (z > 0.0F) {
      const double steps = 8.0 * 580.0 * 0.075 / static_cast<double>(z);
      EXPECT_NEAR(steps, std::round(steps), 1e-4);  // float: 6e-8 of about 200
    }
  }
}

TEST(DepthSensor, KinectLosesGrazingSurfacesOnly) {
  const avatar::Camera camera = smallCamera();
  // The plane runs to the left so that the projector on the right sees it too. The middle of the
  // picture, where the angle is the given one within 4°.
  const auto kept = [&](double degrees) {
    const std::vector<float> exact = plane(camera, 2.0, -degrees / 180.0 * std::numbers::pi);
    const std::vector<float> measured = applySensor(exact, camera, sensed(SensorModel::kKinectV1));
    int count = 0;
    for (int y = 0; y < camera.height; ++y)
      count += measured[static_cast<std::size_t>(y * camera.width + 80)] > 0.0F ? 1 : 0;
    return static_cast<double>(count) / camera.height;
  };
  EXPECT_DOUBLE_EQ(kept(0.0), 1.0);
  EXPECT_DOUBLE_EQ(kept(60.0), 1.0);
  EXPECT_LT(kept(80.0), 0.6);
}

TEST(DepthSensor, ShadowIsAsWideAsTheProjectorsParallax) {
  avatar::Camera camera{.width = 640, .height = 4};
  camera.cy = 1.5;
  const double near = 1.0;
  const double far = 3.0;
  std::vector<float> depth(4 * 640, static_cast<float>(far));
  for (int y = 0; y < 4; ++y)
    std::fill_n(depth.begin() + y * 640 + 300, 100, static_cast<float>(near));
  const std::vector<std::uint8_t> shadow = projectorShadow(depth, camera, 0.075);
  // f·b·(1/near − 1/far) = 26.25 px, to the left of what stands before: the projector is at right.
  const int width = std::accumulate(shadow.begin(), shadow.begin() + 640, 0);
  EXPECT_NEAR(width, 26.25, 1.0);
  EXPECT_EQ(shadow[299], 1);
  EXPECT_EQ(shadow[300 - 28], 0);
  EXPECT_EQ(shadow[400], 0);
}

TEST(DepthSensor, SilhouettesJitterBetweenFrames) {
  const avatar::Camera camera = smallCamera();
  std::vector<float> depth = plane(camera, 2.0);
  for (int y = 0; y < camera.height; ++y)
    std::fill_n(depth.begin() + y * camera.width, 80, 0.0F);  // nothing on the left
  const auto first = applySensor(depth, camera, sensed(SensorModel::kKinectV1, 1, 0));
  const auto second = applySensor(depth, camera, sensed(SensorModel::kKinectV1, 1, 1));
  int differentAtEdge = 0;
  int differentInside = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto i = static_cast<std::size_t>(y * camera.width + x);
      const bool differs = (first[i] > 0.0F) != (second[i] > 0.0F);
      (std::abs(x - 79.5) < 4.0 ? differentAtEdge : differentInside) += differs ? 1 : 0;
    }
  }
  EXPECT_GT(differentAtEdge, 40);  // of 120 rows
  EXPECT_EQ(differentInside, 0);   // five standard deviations away
}

/// A normal distribution of 0.8 px across the edge: pixel k beside it shows the other side when the
/// rounded offset is more than k.
TEST(DepthSensor, SilhouettesJitterByThePublishedLateralNoise) {
  const avatar::Camera camera = smallCamera();
  std::vector<float> depth = plane(camera, 2.0);
  for (int y = 0; y < camera.height; ++y)
    std::fill_n(depth.begin() + y * camera.width, 80, 0.0F);  // nothing on the left
  constexpr int kFrames = 20;
  double swapped[3] = {};
  for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
    const auto measured = applySensor(depth, camera, sensed(SensorModel::kKinectV1, 1, frame));
    for (int y = 0; y < camera.height; ++y) {
      for (int k = 0; k < 3; ++k)
        swapped[k] += measured[static_cast<std::size_t>(y * camera.width + 79 - k)] > 0.0F ? 1 : 0;
    }
  }
  for (int k = 0; k < 3; ++k) {
    const double expected = 0.5 * std::erfc((k + 0.5) / 0.8 / std::numbers::sqrt2);
    // 2400 trials: three standard errors of a share of 0.27.
    EXPECT_NEAR(swapped[k] / (kFrames * camera.height), expected, 0.027) << k;
  }
}

TEST(DepthSensor, SeedAndFrameDecide) {
  const avatar::Camera camera = smallCamera();
  const std::vector<float> depth = plane(camera, 2.0, 0.3);
  for (const SensorModel model : {SensorModel::kKinectV1, SensorModel::kTimeOfFlight}) {
    const auto first = applySensor(depth, camera, sensed(model, 1, 0));
    EXPECT_EQ(first, applySensor(depth, camera, sensed(model, 1, 0)));
    EXPECT_NE(first, applySensor(depth, camera, sensed(model, 2, 0)));
    EXPECT_NE(first, applySensor(depth, camera, sensed(model, 1, 1)));
  }
}

TEST(DepthSensor, ViewingAngleIsThatOfThePlane) {
  const avatar::Camera camera = smallCamera();
  const std::vector<float> angles = viewingAngles(plane(camera, 2.0, 0.7), camera);
  for (const int x : {20, 80, 140}) {
    const Eigen::Vector3d ray = avatar::rayInCamera(camera, x, 60).normalized();
    const Eigen::Vector3d normal(std::sin(0.7), 0.0, std::cos(0.7));
    // Differences of float depths over a pixel: 1e-7 · 2 m against 15 mm per pixel.
    EXPECT_NEAR(
        static_cast<double>(angles[static_cast<std::size_t>(60 * 160 + x)]),
        std::acos(normal.dot(ray)),
        2e-3);
  }
}

TEST(TimeOfFlight, NoiseFollowsItsCurve) {
  const avatar::Camera camera = smallCamera();
  for (const double z : {0.8, 2.0, 4.0}) {
    const std::vector<float> exact = plane(camera, z);
    const Spread spread =
        spreadAbout(exact, applySensor(exact, camera, sensed(SensorModel::kTimeOfFlight)));
    // The term of the angle at the picture's corners (37°) adds up to a few per cent.
    EXPECT_NEAR(spread.deviation, timeOfFlightNoise(z, 0.0), 0.06 * timeOfFlightNoise(z, 0.0));
    EXPECT_LT(std::abs(spread.mean), 1e-4);  // a plane lights itself in no way
  }
}

/// Fankhauser et al. 2015, by hand.
TEST(TimeOfFlight, NoiseHasThePublishedFigures) {
  EXPECT_NEAR(timeOfFlightNoise(1.0, 0.0), 0.0013, 1e-12);
  EXPECT_NEAR(timeOfFlightNoise(4.0, 0.0), 0.0043, 1e-12);
  EXPECT_NEAR(timeOfFlightNoise(1.0, std::numbers::pi / 4.0), 0.0014, 1e-12);
  EXPECT_NEAR(timeOfFlightNoise(4.0, std::numbers::pi / 3.0), 0.0043 + 0.0001 * 8.0 * 4.0, 1e-12);
}

/// Amplitude falls with z², and no noise grows faster than its inverse: within Kinect v2's range.
TEST(TimeOfFlight, NoiseGrowsNoFasterThanTheLightFalls) {
  for (const double z : {0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0})
    EXPECT_LE(timeOfFlightNoise(1.1 * z, 0.0), 1.21 * timeOfFlightNoise(z, 0.0)) << z;
}

TEST(TimeOfFlight, PixelsFlyBetweenTheDepthsAtAJump) {
  const avatar::Camera camera = smallCamera();
  std::vector<float> depth = plane(camera, 3.0);
  for (int y = 0; y < camera.height; ++y)
    std::fill_n(depth.begin() + y * camera.width, 80, 1.5F);
  const auto measured = applySensor(depth, camera, sensed(SensorModel::kTimeOfFlight));
  const std::size_t row = static_cast<std::size_t>(60 * camera.width);
  // Light from 1.5 m is four times as strong: 0.1 · 4 against 0.9 of that from 3 m.
  EXPECT_GT(measured[row + 80], 1.8F);
  EXPECT_LT(measured[row + 80], 2.9F);
  EXPECT_NEAR(measured[row + 82], 3.0F, 0.05F);
}

TEST(TimeOfFlight, LightOverTheOtherWallMakesACornerDeeper) {
  const avatar::Camera camera = smallCamera();
  std::vector<float> corner;  // two walls that meet at right angles in x = 0, z = 3
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x)
      corner.push_back(
          static_cast<float>(3.0 / (1.0 + std::abs(avatar::rayInCamera(camera, x, y).x()))));
  }
  const std::vector<float> longer = withMultiPath(corner, camera, 0.5);
  const auto bias = [&](int x) {
    const auto i = static_cast<std::size_t>(60 * camera.width + x);
    return static_cast<double>(longer[i] - corner[i]);
  };
  EXPECT_GT(bias(100), 0.005);
  EXPECT_LT(bias(100), 0.3);
  const std::vector<float> flat = plane(camera, 3.0);
  const std::vector<float> same = withMultiPath(flat, camera, 0.5);
  for (std::size_t i = 0; i < flat.size(); ++i)
    EXPECT_NEAR(same[i], flat[i], 1e-4F);
}

/// The same integral over the other wall as it is, in steps of a centimetre, for one point.
TEST(TimeOfFlight, MultiPathAgreesWithTheIntegralOverTheOtherWall) {
  const avatar::Camera camera = smallCamera();
  constexpr double kAlbedo = 0.5;
  constexpr double kRange = 7.5;  // of light modulated with 20 MHz [m]
  // Walls z = 3 − |x|: the point is on the right one, what sends light to it on the left one.
  std::vector<float> corner;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x)
      corner.push_back(
          static_cast<float>(3.0 / (1.0 + std::abs(avatar::rayInCamera(camera, x, y).x()))));
  }
  const std::vector<float> longer = withMultiPath(corner, camera, kAlbedo);
  const Eigen::Vector3d leftNormal = Eigen::Vector3d(1.0, 0.0, -1.0).normalized();
  const Eigen::Vector3d rightNormal = Eigen::Vector3d(-1.0, 0.0, -1.0).normalized();
  const double leftmost = -avatar::rayInCamera(camera, 0, 0).x();
  for (const int column : {95, 110, 130}) {
    const auto pixel = static_cast<std::size_t>(60 * camera.width + column);
    const Eigen::Vector3d to =
        static_cast<double>(corner[pixel]) * avatar::rayInCamera(camera, column, 60);
    const double own = to.norm();
    std::complex<double> sum(-rightNormal.dot(to) / (own * own * own), 0.0);
    constexpr double kStep = 0.01;
    const double end = 3.0 * leftmost / (1.0 + leftmost);  // of the wall in the picture [m]
    for (double s = 0.5 * kStep; s < end; s += kStep) {
      const double z = 3.0 - s;
      const double top = z * avatar::rayInCamera(camera, 0, camera.height - 1).y();
      for (double y = -top; y < top; y += kStep) {
        const Eigen::Vector3d from(-s, y, z);
        const Eigen::Vector3d between = from - to;
        const double far = from.norm();
        const double light = -leftNormal.dot(from) / (far * far * far);
        const double passed = kAlbedo / std::numbers::pi * rightNormal.dot(between) *
                              -leftNormal.dot(between) / std::pow(between.squaredNorm(), 2) *
                              kStep * kStep * std::numbers::sqrt2;
        const double detour = 0.5 * (far + between.norm() - own);
        sum += std::polar(light * passed, 2.0 * std::numbers::pi * detour / kRange);
      }
    }
    const double expected = std::arg(sum) / (2.0 * std::numbers::pi) * kRange * to.z() / own;
    const double found = static_cast<double>(longer[pixel] - corner[pixel]);
    // Patches of 5 pixels, 11 cm wide, for points as near as 30 cm to the other wall.
    EXPECT_NEAR(found, expected, 0.2 * expected) << column;
    EXPECT_GT(expected, 0.005);
  }
}

}  // namespace
}  // namespace simulcap
