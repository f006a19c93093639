#include "src/output/named_pose.h"

#include "avatar/axis_angle.h"

#include <array>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

using avatar::BodyPose;
using avatar::SmplJoint;

/// Turns joints on top of what is set. In the T-pose all joint frames are the world's: x left, y
/// up, z forward. So +x bends a knee, −x lifts a thigh forward, −z lowers the left arm.
class PoseMaker {
 public:
  PoseMaker& turn(int joint, const Eigen::Vector3d& axis, double degrees) {
    const double angle = degrees * std::numbers::pi / 180.0;
    auto rotation = pose_.jointRotations.segment<3>(3 * joint);
    rotation = avatar::axisAngleFromQuaternion(
        Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)) *
        avatar::quaternionFromAxisAngle(rotation));
    return *this;
  }

  /// The joint on the left and its mirror image on the right.
  PoseMaker& turnBoth(int leftJoint, const Eigen::Vector3d& axis, double degrees) {
    turn(leftJoint, axis, degrees);
    // A mirror in x = 0 keeps rotations about x and reverses those about y and z.
    return turn(avatar::mirroredJoint(leftJoint), axis, axis.x() != 0.0 ? degrees : -degrees);
  }

  BodyPose pose() const { return pose_; }

 private:
  BodyPose pose_;
};

const Eigen::Vector3d kX = Eigen::Vector3d::UnitX();
const Eigen::Vector3d kY = Eigen::Vector3d::UnitY();
const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

BodyPose squat() {
  return PoseMaker()
      .turnBoth(SmplJoint::kLeftHip, kX, -100)
      .turnBoth(SmplJoint::kLeftHip, kY, 15)
      .turnBoth(SmplJoint::kLeftKnee, kX, 120)
      .turnBoth(SmplJoint::kLeftAnkle, kX, -30)
      .turn(SmplJoint::kPelvis, kX, 15)
      .turn(SmplJoint::kSpine1, kX, 15)
      .turn(SmplJoint::kHead, kX, -15)
      .turnBoth(SmplJoint::kLeftShoulder, kY, -75)
      .turnBoth(SmplJoint::kLeftCollar, kY, -10)
      .pose();
}

BodyPose walk() {
  return PoseMaker()
      .turnBoth(SmplJoint::kLeftShoulder, kZ, -75)
      .turn(SmplJoint::kLeftShoulder, kX, 25)
      .turn(SmplJoint::kRightShoulder, kX, -25)
      .turnBoth(SmplJoint::kLeftElbow, kY, -25)
      .turn(SmplJoint::kLeftHip, kX, -25)
      .turn(SmplJoint::kLeftKnee, kX, 8)
      .turn(SmplJoint::kLeftAnkle, kX, -5)
      .turn(SmplJoint::kRightHip, kX, 18)
      .turn(SmplJoint::kRightKnee, kX, 25)
      .turn(SmplJoint::kRightAnkle, kX, 10)
      .turn(SmplJoint::kRightFoot, kX, -20)
      .turn(SmplJoint::kPelvis, kY, -6)
      .turn(SmplJoint::kSpine3, kY, 10)
      .pose();
}

BodyPose armsUp() {
  return PoseMaker()
      .turnBoth(SmplJoint::kLeftCollar, kZ, 25)
      .turnBoth(SmplJoint::kLeftShoulder, kZ, 55)
      .pose();
}

BodyPose bend() {
  return PoseMaker()
      .turnBoth(SmplJoint::kLeftElbow, kY, -120)
      .turnBoth(SmplJoint::kLeftKnee, kX, 120)
      .pose();
}

BodyPose twist() {
  return PoseMaker()
      .turnBoth(SmplJoint::kLeftWrist, kX, 80)
      .turn(SmplJoint::kSpine1, kY, 15)
      .turn(SmplJoint::kSpine2, kY, 15)
      .turn(SmplJoint::kSpine3, kY, 15)
      .turn(SmplJoint::kHead, kY, 35)
      .pose();
}

BodyPose sit() {
  return PoseMaker()
      .turnBoth(SmplJoint::kLeftShoulder, kZ, -70)
      .turnBoth(SmplJoint::kLeftElbow, kY, -60)
      .turnBoth(SmplJoint::kLeftHip, kX, -90)
      .turnBoth(SmplJoint::kLeftKnee, kX, 90)
      .pose();
}

using Entry = std::pair<std::string, std::function<BodyPose()>>;

const std::array<Entry, 8> kPoses = {
    Entry{"tpose", [] { return BodyPose(); }},
    Entry{"apose", avatar::aPose},
    Entry{"squat", squat},
    Entry{"walk", walk},
    Entry{"armsup", armsUp},
    Entry{"bend", bend},
    Entry{"twist", twist},
    Entry{"sit", sit}};

}  // namespace

const std::vector<std::string>& namedPoses() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    names.reserve(kPoses.size());
    for (const Entry& entry : kPoses)
      names.push_back(entry.first);
    return names;
  }();
  return kNames;
}

avatar::BodyPose namedPose(const std::string& name) {
  for (const Entry& entry : kPoses) {
    if (entry.first == name)
      return entry.second();
  }
  throw std::invalid_argument("namedPose: no pose is called " + name);
}

}  // namespace simulcap
