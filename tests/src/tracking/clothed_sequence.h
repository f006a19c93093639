#pragma once

#include "avatar/geometry/measures.h"
#include "avatar/geometry/rasterizer.h"
#include "avatar/skeleton.h"
#include "avatar/skinning.h"
#include "src/input/depth_cleaning.h"
#include "src/input/depth_surface.h"
#include "src/synthesis/depth_sensor.h"
#include "src/synthesis/noise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace simulcap::test {

/// Somebody in loose clothes, as far as depth is concerned: the skin of trunk, upper arms and legs
/// lies under a surface that stands off by a seeded field of folds and moves with the bones.
class ClothedPerson {
 public:
  /// Clothes stand off by `looseness` [m] on average, between a quarter and twice of it. Betas are
  /// drawn with standard deviation `shapeSpread`.
  ClothedPerson(
      const avatar::BodyModel& model, std::uint32_t seed, double looseness, double shapeSpread)
      : model_(model), skinning_(model), betas_(Eigen::VectorXd::Zero(model.numBetas())) {
    const Noise noise({seed, 0x626f6479});
    for (Eigen::Index b = 0; b < betas_.size(); ++b)
      betas_[b] = shapeSpread * noise.gaussian(static_cast<std::uint64_t>(b));
    body_ = skinning_.shape(betas_);
    clothed_ = body_;
    const Eigen::Matrix3Xd normals = avatar::vertexNormals({body_.vertices, model.faces});
    labels_.assign(static_cast<std::size_t>(model.numVertices()), kSkin);
    for (Eigen::Index v = 0; v < model.numVertices(); ++v) {
      const PixelLabel label = clothOf(carryingJoint(v));
      labels_[static_cast<std::size_t>(v)] = label;
      if (label != kSkin)
        clothed_.vertices.col(v) += looseness * fold(noise, body_.vertices.col(v)) * normals.col(v);
    }
  }

  const Eigen::VectorXd& betas() const { return betas_; }

  avatar::RestSkeleton skeleton() const {
    return {body_.joints.leftCols<avatar::kNumSmplJoints>(), body_.vertices.row(1).minCoeff()};
  }

  Eigen::Matrix3Xd joints(const avatar::BodyPose& pose) const {
    return skinning_.pose(body_, pose).joints;
  }

  /// What a Kinect measures of the person before a wall, segmented and labelled by an oracle.
  DepthCloud cloud(
      const avatar::BodyPose& pose, const avatar::Camera& camera, const SensedFrame& sensed) const {
    const Eigen::Matrix3Xd vertices = skinning_.pose(clothed_, pose).vertices;
    const avatar::RasterImage image = avatar::rasterize({vertices, model_.faces}, camera);
    std::vector<float> depth = image.depth;
    constexpr float kWall = 5.0F;
    for (float& z : depth)
      z = z == 0.0F ? kWall : z;
    DepthCloud cloud{.width = camera.width, .height = camera.height};
    cloud.depth = cleanDepth(applySensor(depth, camera, sensed), camera.width, camera.height);
    cloud.person.assign(cloud.depth.size(), 0);
    cloud.labels.assign(cloud.depth.size(), kBackground);
    for (std::size_t i = 0; i < cloud.depth.size(); ++i) {
      constexpr float kBeforeWall = 1.0F;  // [m]
      if (cloud.depth[i] == 0.0F || image.triangle[i] < 0 || cloud.depth[i] > kWall - kBeforeWall)
        continue;
      cloud.person[i] = 1;
      cloud.labels[i] = labels_[static_cast<std::size_t>(model_.faces(0, image.triangle[i]))];
    }
    return withSurface(std::move(cloud), camera);
  }

 private:
  int carryingJoint(Eigen::Index vertex) const {
    Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator best(
        model_.skinningWeights, vertex);
    int joint = static_cast<int>(best.col());
    double weight = best.value();
    for (++best; best; ++best) {
      if (best.value() > weight) {
        weight = best.value();
        joint = static_cast<int>(best.col());
      }
    }
    return joint;
  }

  static PixelLabel clothOf(int joint) {
    using enum avatar::SmplJoint;
    switch (joint) {
      case kPelvis:
      case kLeftHip:
      case kRightHip:
      case kLeftKnee:
      case kRightKnee:
        return kLower;
      case kSpine1:
      case kSpine2:
      case kSpine3:
      case kLeftCollar:
      case kRightCollar:
      case kLeftShoulder:
      case kRightShoulder:
        return kUpper;
      default:
        return kSkin;
    }
  }

  /// 0.25 … 2, mean about 1: waves of 15 to 40 cm in seeded directions.
  static double fold(const Noise& noise, const Eigen::Vector3d& at) {
    constexpr int kWaves = 4;
    double sum = 0.0;
    for (std::uint64_t wave = 0; wave < kWaves; ++wave) {
      const Eigen::Vector3d direction(
          noise.gaussian(100 + 8 * wave),
          0.5 * noise.gaussian(101 + 8 * wave),
          noise.gaussian(102 + 8 * wave));
      const double frequency = 6.28 / noise.uniform(103 + 16 * wave, 0.15, 0.4);
      sum += std::sin(
          frequency * direction.normalized().dot(at) + noise.uniform(110 + 16 * wave, 0.0, 6.28));
    }
    return std::clamp(1.0 + 0.45 * sum, 0.25, 2.0);
  }

  const avatar::BodyModel& model_;
  avatar::Skinning skinning_;
  Eigen::VectorXd betas_;
  avatar::ShapedBody body_, clothed_;
  std::vector<PixelLabel> labels_;
};

}  // namespace simulcap::test
