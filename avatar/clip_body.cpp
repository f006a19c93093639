#include "avatar/clip_body.h"

#include "avatar/axis_angle.h"

#include <algorithm>
#include <cmath>

namespace avatar {
namespace {

constexpr double kHeelBehindAnkle = 0.05;  // [m]

constexpr std::array<int, 8> kLegJoints = {
    kLeftHip, kRightHip, kLeftKnee, kRightKnee, kLeftAnkle, kRightAnkle, kLeftFoot, kRightFoot};

Eigen::Quaterniond about(double angle, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
}

/// Three-point derivative at key i, limited so that the cubic stays monotone.
double slopeAt(const std::vector<Eigen::Vector2d>& keys, std::size_t i, bool periodic) {
  const std::size_t last = keys.size() - 1;
  const bool isEnd = i == 0 || i == last;
  if (isEnd && !periodic) {
    return 0.0;
  }
  const Eigen::Vector2d before =
      isEnd ? Eigen::Vector2d(keys[last] - keys[last - 1]) : Eigen::Vector2d(keys[i] - keys[i - 1]);
  const Eigen::Vector2d after =
      isEnd ? Eigen::Vector2d(keys[1] - keys[0]) : Eigen::Vector2d(keys[i + 1] - keys[i]);
  const double s0 = before.y() / before.x();
  const double s1 = after.y() / after.x();
  if (s0 * s1 <= 0.0) {
    return 0.0;
  }
  const double mean = (s0 * after.x() + s1 * before.x()) / (before.x() + after.x());
  const double limit = 3.0 * std::min(std::abs(s0), std::abs(s1));
  return std::clamp(mean, -limit, limit);
}

double keyedValue(const std::vector<Eigen::Vector2d>& keys, double time, bool periodic) {
  if (time <= keys.front().x()) {
    return keys.front().y();
  }
  if (time >= keys.back().x()) {
    return keys.back().y();
  }
  std::size_t i = 0;
  while (time > keys[i + 1].x()) {
    ++i;
  }
  const double width = keys[i + 1].x() - keys[i].x();
  const double u = (time - keys[i].x()) / width;
  const double m0 = width * slopeAt(keys, i, periodic);
  const double m1 = width * slopeAt(keys, i + 1, periodic);
  const double u2 = u * u;
  const double u3 = u2 * u;
  return (2 * u3 - 3 * u2 + 1) * keys[i].y() + (u3 - 2 * u2 + u) * m0 +
         (3 * u2 - 2 * u3) * keys[i + 1].y() + (u3 - u2) * m1;
}

}  // namespace

double keyed(const std::vector<Eigen::Vector2d>& keys, double time) {
  return keyedValue(keys, time, false);
}

double keyedPeriodic(const std::vector<Eigen::Vector2d>& keys, double time) {
  const double start = keys.front().x();
  const double period = keys.back().x() - start;
  return keyedValue(keys, time - period * std::floor((time - start) / period), true);
}

ClipBody::ClipBody(const RestSkeleton& body) : body_(body) {
  BodyPose pose = aPose();
  pose.translation = -body.joints.col(kPelvis);
  pose.translation.y() -= lowestSole(body, pose);
  const PosedSkeleton posed = posedSkeleton(body.joints, pose);
  standing_.pelvis = posed.joints.col(kPelvis);
  standing_.upper = pose;
  for (int side = 0; side < 2; ++side) {
    const int ankle = side == 0 ? kLeftAnkle : kRightAnkle;
    FootPlacement& foot = standing_.feet.at(side);
    foot.print << posed.joints(0, ankle), posed.joints(2, ankle);
    foot.roll = axisAngleFromQuaternion(posed.rotations.at(ankle)).z();
    const double flat = body.joints(1, ankle) - body.floorHeight;
    foot.height = posed.joints(1, ankle) - flat;
  }
  legLength_ = 0.5 * (legReach(body, 0) + legReach(body, 1));
}

FootTarget ClipBody::target(const FootPlacement& foot, int side) const {
  const Eigen::Vector3d ankle = body_.joints.col(side == 0 ? kLeftAnkle : kRightAnkle);
  const Eigen::Vector3d ball = body_.joints.col(side == 0 ? kLeftFoot : kRightFoot);
  const double flatHeight = ankle.y() - body_.floorHeight;
  const Eigen::Vector3d fromBall = ankle - ball;
  const Eigen::Vector3d fromHeel(0.0, flatHeight, kHeelBehindAnkle);
  const Eigen::Quaterniond pitch = about(foot.pitch, Eigen::Vector3d::UnitX());
  const Eigen::Quaterniond yaw = about(foot.yaw, Eigen::Vector3d::UnitY());
  const double heel = foot.isSwinging ? foot.heelPivot : (foot.pitch < 0.0 ? 1.0 : 0.0);
  const Eigen::Vector3d shift =
      (1.0 - heel) * (pitch * fromBall - fromBall) + heel * (pitch * fromHeel - fromHeel);
  FootTarget result;
  result.ankle =
      Eigen::Vector3d(foot.print.x(), flatHeight + foot.height, foot.print.y()) + yaw * shift;
  result.foot = yaw * pitch * about(foot.roll, Eigen::Vector3d::UnitZ());
  return result;
}

Eigen::Vector3d ClipBody::hipOffset(const ClipFrame& frame, int side) const {
  const int hip = side == 0 ? kLeftHip : kRightHip;
  return frame.pelvisRotation * (body_.joints.col(hip) - body_.joints.col(kPelvis));
}

double ClipBody::highestPelvis(const ClipFrame& frame, double share) const {
  double highest = std::numeric_limits<double>::infinity();
  for (int side = 0; side < 2; ++side) {
    const Eigen::Vector3d ankle = target(frame.feet.at(side), side).ankle;
    const Eigen::Vector3d hip = hipOffset(frame, side);
    const double dx = frame.pelvis.x() + hip.x() - ankle.x();
    const double dz = frame.pelvis.z() + hip.z() - ankle.z();
    const double reach = share * legReach(body_, side);
    const double rise = std::sqrt(std::max(0.0, reach * reach - dx * dx - dz * dz));
    highest = std::min(highest, ankle.y() + rise - hip.y());
  }
  return highest;
}

BodyPose ClipBody::pose(const ClipFrame& frame) const {
  BodyPose result = frame.upper;
  setJointRotation(result, kPelvis, frame.pelvisRotation);
  Eigen::Vector3d pelvis = frame.pelvis;
  pelvis.y() = std::min(pelvis.y(), highestPelvis(frame, 1.0));
  result.translation = pelvis - body_.joints.col(kPelvis);
  for (int side = 0; side < 2; ++side) {
    const FootPlacement& foot = frame.feet.at(side);
    FootTarget footTarget = target(foot, side);
    // The knee points between where the pelvis and where the foot point.
    const Eigen::Quaterniond footYaw = about(foot.yaw, Eigen::Vector3d::UnitY());
    footTarget.kneeAxis =
        shortestSlerp(frame.pelvisRotation, footYaw, 0.5) * Eigen::Vector3d::UnitX();
    solveLeg(result, body_, side, footTarget);
    // The toes stay level while the heel is up.
    const int toes = side == 0 ? kLeftFoot : kRightFoot;
    setJointRotation(result, toes, about(-std::max(0.0, foot.pitch), Eigen::Vector3d::UnitX()));
  }
  return result;
}

namespace {

/// The blend from the A-pose. Legs are planted already; of them only what inverse kinematics leaves
/// at frame 0 (`described` there) fades out.
BodyPose fadedIn(
    const BodyPose& pose, const BodyPose& start, const BodyPose& described, double blend) {
  BodyPose result = pose;
  for (int joint = 1; joint < kNumSmplJoints; ++joint) {
    const bool isLeg = std::find(kLegJoints.begin(), kLegJoints.end(), joint) != kLegJoints.end();
    const Eigen::Quaterniond now = jointRotation(pose, joint);
    const Eigen::Quaterniond from =
        isLeg ? now * jointRotation(described, joint).conjugate() * jointRotation(start, joint)
              : jointRotation(start, joint);
    setJointRotation(result, joint, shortestSlerp(from, now, blend));
  }
  return result;
}

}  // namespace

Motion builtClip(
    const ClipOptions& options,
    const ClipBody& body,
    double seconds,
    const std::function<ClipFrame(double)>& frameAt) {
  Motion motion;
  motion.framesPerSecond = options.framesPerSecond;
  const auto count = static_cast<int>(std::floor(seconds * options.framesPerSecond + 1e-6)) + 1;
  const BodyPose start = body.standing().upper;
  const BodyPose described = body.pose(frameAt(0.0));
  motion.frames.push_back(start);
  for (int i = 1; i < count; ++i) {
    const double time = i / options.framesPerSecond;
    const double blend = minimumJerk(time / options.blendSeconds);
    motion.frames.push_back(fadedIn(body.pose(frameAt(time)), start, described, blend));
  }
  return motion;
}

}  // namespace avatar
