#include "src/synthesis/soft_tissue.h"

#include "avatar/body_pose.h"
#include "avatar/geometry/measures.h"
#include "src/synthesis/noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

constexpr std::array kRigidParts = {
    avatar::kLeftHand,
    avatar::kRightHand,
    avatar::kLeftWrist,
    avatar::kRightWrist,
    avatar::kLeftFoot,
    avatar::kRightFoot,
    avatar::kLeftAnkle,
    avatar::kRightAnkle,
    avatar::kHead,
    avatar::kNeck};

/// V: 1 where flesh is soft, 0 on hands, feet and head.
Eigen::VectorXd softness(const avatar::BodyModel& model) {
  const Eigen::MatrixXd weights = model.skinningWeights.leftCols(avatar::kNumSmplJoints);
  Eigen::VectorXd soft = Eigen::VectorXd::Ones(model.numVertices());
  for (const int joint : kRigidParts)
    soft -= weights.col(joint);
  return soft.cwiseMax(0.0);
}

/// V, in [−1, 1]: the mean of waves of one length in random directions.
Eigen::VectorXd waves(const Eigen::Matrix3Xd& points, double wavelength, const Noise& noise) {
  constexpr std::uint64_t kWaves = 12;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(points.cols());
  for (std::uint64_t k = 0; k < kWaves; ++k) {
    const Eigen::Vector3d direction(
        noise.gaussian(4 * k), noise.gaussian(4 * k + 1), noise.gaussian(4 * k + 2));
    const Eigen::Vector3d wave = 2.0 * std::numbers::pi / wavelength * direction.stableNormalized();
    const double phase = 2.0 * std::numbers::pi * noise.uniform(100 + k);
    sum.array() += ((points.transpose() * wave).array() + phase).cos();
  }
  return sum / std::max(1e-12, sum.cwiseAbs().maxCoeff());
}

}  // namespace

void SoftTissueOptions::validate() const {
  if (!(largest >= 0.0 && wavelength > 0.0 && poseShare >= 0.0 && poseShare <= 1.0))
    throw std::invalid_argument(
        "SoftTissueOptions: largest must not be negative, wavelength positive, poseShare in "
        "[0, 1]");
}

SoftTissue makeSoftTissue(
    const avatar::BodyModel& model,
    const avatar::ShapedBody& shaped,
    const SoftTissueOptions& options) {
  options.validate();
  const Noise noise({options.seed, 0x7155});
  const Eigen::VectorXd soft = softness(model);
  const Eigen::Matrix3Xd normals =
      avatar::vertexNormals(avatar::MeshView(shaped.vertices, model.faces)) * soft.asDiagonal();
  const Eigen::VectorXd steady = (1.0 - options.poseShare) * options.largest *
                                 waves(shaped.vertices, options.wavelength, noise);
  // 4 w (1 − w) is 1 where a joint's influence begins and 0 where it ends: about the joint.
  const Eigen::MatrixXd weights = model.skinningWeights.leftCols(avatar::kNumSmplJoints);
  Eigen::MatrixXd bulges = 4.0 * weights.array() * (1.0 - weights.array());
  for (int joint = 0; joint < avatar::kNumSmplJoints; ++joint)
    bulges.col(joint) *=
        noise.uniform(std::uint64_t{1000} + static_cast<std::uint64_t>(joint), -1.0, 1.0);
  const double bulgeHeight = options.poseShare * options.largest;
  return [normals, steady, bulges = std::move(bulges), bulgeHeight](const avatar::BodyPose& pose) {
    Eigen::VectorXd bent = Eigen::VectorXd::Zero(avatar::kNumSmplJoints);
    for (int joint = 1; joint < avatar::kNumSmplJoints; ++joint)
      bent[joint] = std::min(1.0, pose.jointRotations.segment<3>(3 * joint).norm());
    const Eigen::VectorXd bulge = (bulges * bent).cwiseMax(-1.0).cwiseMin(1.0);
    return Eigen::Matrix3Xd(normals * (steady + bulgeHeight * bulge).asDiagonal());
  };
}

}  // namespace simulcap
