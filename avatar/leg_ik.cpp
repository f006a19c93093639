#include "avatar/leg_ik.h"

#include "avatar/axis_angle.h"

#include <algorithm>
#include <cmath>

namespace avatar {
namespace {

/// |a + Rx(φ)b|² = constant + 2·amplitude·cos(φ − straight).
struct KneeGeometry {
  Eigen::Vector3d thigh, shank;  // a, b at rest [m]
  double constant = 0.0;         // [m²]
  double amplitude = 0.0;        // [m²]
  double straight = 0.0;         // φ of the longest leg [rad]
};

KneeGeometry kneeGeometry(const RestSkeleton& body, int side) {
  const int hip = side == 0 ? kLeftHip : kRightHip;
  const int knee = side == 0 ? kLeftKnee : kRightKnee;
  const int ankle = side == 0 ? kLeftAnkle : kRightAnkle;
  KneeGeometry g;
  g.thigh = body.joints.col(knee) - body.joints.col(hip);
  g.shank = body.joints.col(ankle) - body.joints.col(knee);
  const Eigen::Vector3d& a = g.thigh;
  const Eigen::Vector3d& b = g.shank;
  const double p = a.y() * b.y() + a.z() * b.z();
  const double q = a.z() * b.y() - a.y() * b.z();
  g.constant = a.squaredNorm() + b.squaredNorm() + 2.0 * a.x() * b.x();
  g.amplitude = std::hypot(p, q);
  g.straight = std::atan2(q, p);
  return g;
}

/// Columns: along `direction`, `axis` made perpendicular to it, and their cross product.
Eigen::Matrix3d frameAlong(const Eigen::Vector3d& direction, const Eigen::Vector3d& axis) {
  Eigen::Matrix3d frame;
  frame.col(0) = direction.normalized();
  frame.col(1) = (axis - axis.dot(frame.col(0)) * frame.col(0)).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace

double legReach(const RestSkeleton& body, int side) {
  const KneeGeometry g = kneeGeometry(body, side);
  return std::sqrt(g.constant + 2.0 * g.amplitude);
}

double solveLeg(BodyPose& pose, const RestSkeleton& body, int side, const FootTarget& target) {
  const int hip = side == 0 ? kLeftHip : kRightHip;
  const KneeGeometry g = kneeGeometry(body, side);
  const Eigen::Quaterniond pelvis = jointRotation(pose, kPelvis);
  const Eigen::Vector3d hipPosition = body.joints.col(kPelvis) + pose.translation +
                                      pelvis * (body.joints.col(hip) - body.joints.col(kPelvis));
  const Eigen::Vector3d toAnkle = target.ankle - hipPosition;
  const double cosine = (toAnkle.squaredNorm() - g.constant) / (2.0 * g.amplitude);
  const double flexion = g.straight + std::acos(std::clamp(cosine, -1.0, 1.0));
  const Eigen::Quaterniond knee(Eigen::AngleAxisd(flexion, Eigen::Vector3d::UnitX()));
  const Eigen::Vector3d legAtRest = g.thigh + knee * g.shank;
  const Eigen::Matrix3d hipWorld = frameAlong(toAnkle, target.kneeAxis) *
                                   frameAlong(legAtRest, Eigen::Vector3d::UnitX()).transpose();
  const Eigen::Quaterniond hipRotation(hipWorld);
  setJointRotation(pose, hip, pelvis.conjugate() * hipRotation);
  setJointRotation(pose, hip + kLeftKnee - kLeftHip, knee);
  setJointRotation(
      pose, hip + kLeftAnkle - kLeftHip, (hipRotation * knee).conjugate() * target.foot);
  return (hipRotation * legAtRest - toAnkle).norm();
}

}  // namespace avatar
