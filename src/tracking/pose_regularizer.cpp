#include "src/tracking/pose_regularizer.h"

#include "avatar/axis_angle.h"
#include "avatar/motion.h"

#include <cmath>
#include <numbers>

namespace simulcap {
namespace {

using avatar::BodyPose;
using avatar::JointLimits;
using avatar::NormalEquations;
using avatar::PosePrior;
using enum avatar::SmplJoint;

/// Resistance of single axes to leaving 0 [per rad²]: what anatomy allows hardly at all, and what
/// depth hardly shows.
Eigen::VectorXd axisStiffness() {
  Eigen::VectorXd stiffness = Eigen::VectorXd::Zero(TrackingLayout::kTranslation);
  const auto set = [&](int joint, double x, double y, double z) {
    stiffness.segment<3>(3 * joint) << x, y, z;
  };
  // A knee bends about x, an elbow about y; forearm twist (x) is seen by the hand alone.
  for (const int knee : {kLeftKnee, kRightKnee}) {
    set(knee, 0.0, 400.0, 400.0);
  }
  for (const int elbow : {kLeftElbow, kRightElbow}) {
    set(elbow, 20.0, 0.0, 200.0);
  }
  for (const int spine : {kSpine1, kSpine2, kSpine3}) {
    set(spine, 300.0, 300.0, 300.0);
  }
  for (const int joint : {kNeck, kHead}) {
    set(joint, 30.0, 30.0, 30.0);
  }
  // A shin leans over a foot that stands: a stiff ankle would straighten the knee.
  for (const int ankle : {kLeftAnkle, kRightAnkle}) {
    set(ankle, 1.0, 30.0, 30.0);
  }
  for (const int wrist : {kLeftWrist, kRightWrist}) {
    set(wrist, 40.0, 40.0, 40.0);
  }
  for (const int foot : {kLeftFoot, kRightFoot}) {
    set(foot, 1e4, 1e4, 1e4);  // toes: not seen
  }
  return stiffness;
}

}  // namespace

const Eigen::VectorXd& temporalStiffness() {
  static const Eigen::VectorXd kStiffness = [] {
    Eigen::VectorXd stiffness = Eigen::VectorXd::Constant(TrackingLayout::kBetas, 10.0);
    for (const int joint : {kSpine1, kSpine2, kSpine3, kLeftCollar, kRightCollar})
      stiffness.segment<3>(3 * joint).setConstant(40.0);
    stiffness.segment<3>(TrackingLayout::kTranslation).setConstant(85.0);
    return stiffness;
  }();
  return kStiffness;
}

Eigen::Vector3d nearestBranch(const Eigen::Vector3d& axisAngle, const Eigen::Vector3d& reference) {
  const double angle = axisAngle.norm();
  if (angle < 1e-6) {
    return axisAngle;
  }
  const Eigen::Vector3d other = axisAngle * (1.0 - 2.0 * std::numbers::pi / angle);
  return (other - reference).squaredNorm() < (axisAngle - reference).squaredNorm() ? other
                                                                                   : axisAngle;
}

void shortenRotations(avatar::BodyPose& pose) {
  for (Eigen::Index i = 0; i < pose.jointRotations.size(); i += 3) {
    pose.jointRotations.segment<3>(i) = avatar::axisAngleFromQuaternion(
        avatar::quaternionFromAxisAngle(pose.jointRotations.segment<3>(i)));
  }
}

PoseRegularizer::PoseRegularizer(PosePrior prior, const std::optional<Eigen::Vector3d>& usualLean)
    : prior_(std::move(prior)), limits_(avatar::humanJointLimits()), usualLean_(usualLean) {}

/// Loose clothes show how the hips lean so little that a shape that isn't quite the person's makes
/// them lean one way in front views and the other in back views. The residual is the rotation from
/// the usual lean to this one, without its part about the vertical axis: headings are free.
double PoseRegularizer::addLean(const BodyPose& pose, NormalEquations& equations) const {
  if (!usualLean_)
    return 0.0;
  constexpr double kStiffness = 150.0;  // depth's own is 80 under a wide shirt [per rad²]
  const Eigen::Vector3d root = pose.jointRotations.head<3>();
  const Eigen::Quaterniond usual =
      avatar::rotationAbout(avatar::heading(pose), Eigen::Vector3d::UnitY()) *
      avatar::quaternionFromAxisAngle(*usualLean_);
  Eigen::Vector3d off =
      avatar::axisAngleFromQuaternion(avatar::quaternionFromAxisAngle(root) * usual.conjugate());
  Eigen::Matrix3d jacobian = avatar::leftJacobian(root);
  off.y() = 0.0;
  jacobian.row(1).setZero();
  equations.matrix.topLeftCorner<3, 3>() += kStiffness * jacobian.transpose() * jacobian;
  equations.gradient.head<3>() += kStiffness * jacobian.transpose() * off;
  return kStiffness * off.squaredNorm();
}

double PoseRegularizer::add(
    const BodyParameters& parameters,
    const BodyPose& predicted,
    const Weights& weights,
    NormalEquations& equations) const {
  constexpr int kTracked = TrackingLayout::kTranslation - 3;  // parameters of joints but the root
  double energy = 0.0;

  const PosePrior::Evaluation prior = prior_.evaluate(parameters.pose);
  const Eigen::MatrixXd jacobian = prior.jacobian.leftCols(kTracked);
  equations.matrix.block<kTracked, kTracked>(3, 3).noalias() +=
      weights.prior * jacobian.transpose() * jacobian;
  for (int i = 0; i < kTracked; ++i)
    equations.gradient[3 + i] += weights.prior * jacobian.col(i).dot(prior.residual);
  energy += weights.prior * prior.energy;

  constexpr double kLimit = 1000.0;  // [per rad²]
  const JointLimits::Evaluation limits = limits_.evaluate(parameters.pose);
  equations.matrix.diagonal().segment<kTracked>(3) +=
      kLimit * limits.jacobianDiagonal.head<kTracked>();
  equations.gradient.segment<kTracked>(3) += kLimit * limits.residual.head<kTracked>();
  energy += kLimit * limits.residual.head<kTracked>().squaredNorm();

  static const Eigen::VectorXd kAxes = axisStiffness();
  Eigen::VectorXd axes = kAxes;
  for (const int joint : {kLeftHip, kRightHip, kLeftKnee, kRightKnee})
    axes[3 * joint] += weights.straightLegs;
  const Eigen::VectorXd rotations =
      parameters.pose.jointRotations.head<TrackingLayout::kTranslation>();
  equations.matrix.diagonal().head<TrackingLayout::kTranslation>() += axes;
  equations.gradient.head<TrackingLayout::kTranslation>() += axes.cwiseProduct(rotations);
  energy += rotations.cwiseAbs2().dot(axes);

  energy += addLean(parameters.pose, equations);

  const Eigen::VectorXd& stiffness = temporalStiffness();
  Eigen::VectorXd off(TrackingLayout::kBetas);
  for (int joint = 0; joint < kNumTrackedJoints; ++joint) {
    const Eigen::Vector3d now = rotations.segment<3>(3 * joint);
    off.segment<3>(3 * joint) =
        now - nearestBranch(predicted.jointRotations.segment<3>(3 * joint), now);
  }
  off.tail<3>() = parameters.pose.translation - predicted.translation;
  equations.matrix.diagonal().head<TrackingLayout::kBetas>() += weights.temporal * stiffness;
  equations.gradient.head<TrackingLayout::kBetas>() +=
      weights.temporal * stiffness.cwiseProduct(off);
  energy += weights.temporal * off.cwiseAbs2().dot(stiffness);
  equations.weightedSquares += energy;
  return energy;
}

}  // namespace simulcap
