#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"

#include <random>

namespace avatar::test {

struct RandomBodyOptions {
  int numVertices = 40;
  int numBetas = 4;
  bool poseDirections = true;
  unsigned seed = 1;
};

/// A valid body of SMPL's kinematic tree with random rest data of about a metre in size: nothing
/// like a person, but every term of the skinning function is in play.
inline BodyModel randomBody(const RandomBodyOptions& options = {}) {
  std::mt19937 random(options.seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto fill = [&](Eigen::Index rows, Eigen::Index cols, double scale) {
    return Eigen::MatrixXd(
        Eigen::MatrixXd::NullaryExpr(rows, cols, [&]() { return scale * uniform(random); }));
  };
  const int numVertices = options.numVertices;
  BodyModel model;
  model.name = "random";
  model.templateVertices = fill(3, numVertices, 0.8);
  model.faces.resize(3, numVertices - 2);
  for (int f = 0; f < numVertices - 2; ++f)
    model.faces.col(f) << f, f + 1, f + 2;
  model.shapeDirections = fill(3 * numVertices, options.numBetas, 0.05);
  model.parents.assign(kSmplParents.begin(), kSmplParents.end());
  model.poseDirections.resize(kNumSmplJoints - 1);
  // Every other joint has directions, on a third of the vertices.
  for (int joint = 0; options.poseDirections && joint < kNumSmplJoints - 1; joint += 2) {
    Eigen::MatrixXf& block = model.poseDirections[static_cast<std::size_t>(joint)];
    block = Eigen::MatrixXf::Zero(3 * numVertices, 9);
    for (int v = joint % 3; v < numVertices; v += 3) {
      block.middleRows<3>(3 * v) = fill(3, 9, 0.02).cast<float>();
    }
  }
  model.jointRegressor.resize(kNumSmplJoints, numVertices);
  model.skinningWeights.resize(numVertices, kNumSmplJoints);
  for (int joint = 0; joint < kNumSmplJoints; ++joint) {
    for (int k = 0; k < 3; ++k) {
      model.jointRegressor.coeffRef(joint, (7 * joint + 5 * k) % numVertices) += 1.0 / 3.0;
    }
  }
  for (int v = 0; v < numVertices; ++v) {
    const double share = 0.5 + 0.4 * uniform(random);
    model.skinningWeights.coeffRef(v, v % kNumSmplJoints) += share;
    model.skinningWeights.coeffRef(v, (5 * v + 3) % kNumSmplJoints) += 1.0 - share;
  }
  model.jointRegressor.makeCompressed();
  model.skinningWeights.makeCompressed();
  return model;
}

/// Joint rotations of up to about `scale` radians per axis, and a translation.
inline BodyPose randomPose(unsigned seed, double scale = 1.0) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  BodyPose pose;
  for (double& angle : pose.jointRotations)
    angle = scale * uniform(random);
  for (double& t : pose.translation)
    t = uniform(random);
  return pose;
}

}  // namespace avatar::test
