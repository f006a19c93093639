#include "src/synthesis/surface_color.h"

#include "avatar/body_pose.h"
#include "src/synthesis/noise.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace simulcap {
namespace {

/// Which of two colours alternates along one axis; 0 or 1.
int parity(double coordinate, double period) {
  return static_cast<int>(std::floor(coordinate / period)) & 1;
}

Eigen::Vector3d fromHue(double hue, double saturation, double value) {
  const auto channel = [&](double shift) {
    const double k = std::fmod(shift + 6.0 * hue, 6.0);
    return value * (1.0 - saturation * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0));
  };
  return {channel(5.0), channel(3.0), channel(1.0)};
}

std::uint64_t cellKey(const Eigen::Vector3d& cell) {
  const auto part = [](double c) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(c));
  };
  return part(cell.x()) * 73856093ULL ^ part(cell.y()) * 19349663ULL ^ part(cell.z()) * 83492791ULL;
}

}  // namespace

Eigen::Vector3d SolidPattern::at(const Eigen::Vector3d& point) const {
  switch (kind) {
    case Kind::kPlain:
      return first;
    case Kind::kStripes:
      return parity(point.y(), 0.5 * period) == 0 ? first : second;
    case Kind::kChecks: {
      const int dark = parity(point.y(), 0.5 * period) + parity(point.x(), 0.5 * period);
      return first + 0.5 * dark * (second - first);
    }
    case Kind::kDots: {
      const Eigen::Vector3d cell = (point / period).array().floor() + 0.5;
      return (point / period - cell).norm() < 0.42 ? second : first;
    }
    default: {
      const Eigen::Vector3d cell = (point / period).array().floor();
      const double share = Noise({seed, cellKey(cell)}).uniform(0);
      return first + share * (second - first);
    }
  }
}

SolidPattern clothPattern(std::uint32_t seed, std::uint32_t index) {
  const Noise noise({seed, 0xc107, index});
  SolidPattern pattern;
  constexpr SolidPattern::Kind kKinds[] = {
      SolidPattern::Kind::kStripes,
      SolidPattern::Kind::kChecks,
      SolidPattern::Kind::kDots,
      SolidPattern::Kind::kSpeckles};
  pattern.kind = kKinds[(seed + index) % 4];
  // Neighbours in the list are far apart on the circle of hues (golden ratio).
  const double hue = std::fmod(Noise({seed, 0x40e}).uniform(0) + 0.381966 * index, 1.0);
  pattern.first = fromHue(hue, noise.uniform(1, 0.5, 0.8), noise.uniform(2, 0.5, 0.85));
  pattern.second = fromHue(
      std::fmod(hue + noise.uniform(3, 0.0, 0.12), 1.0),
      noise.uniform(4, 0.05, 0.5),
      noise.uniform(5, 0.85, 1.0));
  pattern.period = pattern.kind == SolidPattern::Kind::kSpeckles ? noise.uniform(6, 0.012, 0.02)
                                                                 : noise.uniform(6, 0.05, 0.09);
  pattern.seed = seed;
  return pattern;
}

Eigen::Matrix3Xd bodyColors(
    const avatar::BodyModel& model, const avatar::ShapedBody& shaped, std::uint32_t seed) {
  const Noise noise({seed, 0xb0d1});
  const Eigen::Vector3d light(0.96, 0.80, 0.69);
  const Eigen::Vector3d dark(0.45, 0.30, 0.22);
  const Eigen::Vector3d skin = light + noise.uniform(0, 0.0, 0.8) * (dark - light);
  const Eigen::Vector3d hair = noise.uniform(1, 0.3, 1.6) * Eigen::Vector3d(0.26, 0.17, 0.11);
  const Eigen::Vector3d shoes = fromHue(noise.uniform(2), 0.4, noise.uniform(3, 0.2, 0.6));
  const Eigen::MatrixXd weights = model.skinningWeights.leftCols(avatar::kNumSmplJoints);
  const Eigen::Vector3d headJoint = shaped.joints.col(avatar::kHead);
  const double top = shaped.vertices.row(1).maxCoeff();
  const double floor = shaped.vertices.row(1).minCoeff();
  Eigen::Matrix3Xd colors = skin.replicate(1, model.numVertices());
  for (Eigen::Index v = 0; v < model.numVertices(); ++v) {
    const Eigen::Vector3d point = shaped.vertices.col(v);
    // Hair ends above the forehead in front and at the height of the joint behind.
    const double forward = std::clamp((point.z() - headJoint.z()) / 0.12, -0.2, 0.42);
    const bool onHead = weights(v, avatar::kHead) > 0.5;
    if (onHead && point.y() > headJoint.y() + (0.3 + forward) * (top - headJoint.y()))
      colors.col(v) = hair;
    else if (point.y() < floor + 0.07)
      colors.col(v) = shoes;
  }
  return colors;
}

}  // namespace simulcap
