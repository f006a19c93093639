#pragma once

#include "avatar/body_model.h"

#include <Eigen/Geometry>

#include <vector>

/// Linear blend skinning once more: double, loops over everything, straight from the formulas.
namespace avatar::test {

struct SlowBody {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xd joints;
};

/// exp of an axis-angle vector by squaring its series: (Σ (θ/2¹⁶)ⁿ/n!)^(2¹⁶), no case for 0.
inline Eigen::Matrix3d slowRotation(const Eigen::Vector3d& axisAngle) {
  Eigen::Matrix3d cross;
  const Eigen::Vector3d v = axisAngle / 65536.0;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  // R − I is what is squared, so that its small start keeps all digits: (I + D)² − I = 2D + D².
  Eigen::Matrix3d difference = cross + cross * cross / 2 + cross * cross * cross / 6;
  for (int i = 0; i < 16; ++i)
    difference = (2 * difference + difference * difference).eval();
  return Eigen::Matrix3d::Identity() + difference;
}

/// `parameters`: 3J rotations, 3 of the translation, B betas.
inline SlowBody slowSkinning(const BodyModel& model, const Eigen::VectorXd& parameters) {
  const int J = model.numJoints();
  const Eigen::Vector3d translation = parameters.segment<3>(3 * J);
  const Eigen::VectorXd betas = parameters.tail(model.numBetas());
  std::vector<Eigen::Matrix3d> R(J);
  for (int j = 0; j < J; ++j)
    R[j] = slowRotation(parameters.segment<3>(3 * j));

  const Eigen::VectorXd shapeOffset = model.shapeDirections * betas;
  Eigen::Matrix3Xd rest = model.templateVertices;
  for (Eigen::Index v = 0; v < rest.cols(); ++v)
    rest.col(v) += shapeOffset.segment<3>(3 * v);
  const Eigen::Matrix3Xd restJoints = rest * Eigen::MatrixXd(model.jointRegressor).transpose();
  for (int j = 1; j < J; ++j) {
    const Eigen::MatrixXf& P = model.poseDirections[j - 1];
    for (Eigen::Index row = 0; row < P.rows(); ++row)
      for (int f = 0; f < 9; ++f)
        rest(row % 3, row / 3) +=
            static_cast<double>(P(row, f)) * (R[j](f / 3, f % 3) - (f / 3 == f % 3 ? 1.0 : 0.0));
  }

  std::vector<Eigen::Matrix4d> G(J);
  for (int j = 0; j < J; ++j) {
    const int parent = model.parents[j];
    Eigen::Matrix4d local = Eigen::Matrix4d::Identity();
    local.topLeftCorner<3, 3>() = R[j];
    local.topRightCorner<3, 1>() = restJoints.col(j);
    if (parent >= 0)
      local.topRightCorner<3, 1>() -= restJoints.col(parent);
    G[j] = parent < 0 ? local : Eigen::Matrix4d(G[parent] * local);
  }

  SlowBody body;
  body.vertices = Eigen::Matrix3Xd::Zero(3, rest.cols());
  body.joints.resize(3, J);
  const Eigen::MatrixXd weights = model.skinningWeights;
  for (int j = 0; j < J; ++j) {
    body.joints.col(j) = G[j].topRightCorner<3, 1>() + translation;
    for (Eigen::Index v = 0; v < rest.cols(); ++v) {
      const Eigen::Vector3d relative = rest.col(v) - restJoints.col(j);
      body.vertices.col(v) += weights(v, j) * (G[j] * relative.homogeneous()).head<3>();
    }
  }
  body.vertices.colwise() += translation;
  return body;
}

}  // namespace avatar::test
