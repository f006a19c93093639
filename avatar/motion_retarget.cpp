#include "avatar/motion_retarget.h"

#include "avatar/axis_angle.h"
#include "avatar/skeleton_names.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace avatar {
namespace {

using Rotations = std::vector<Eigen::Quaterniond>;

struct WorldFrame {
  Rotations rotations;
  Eigen::Matrix3Xd positions;
};

WorldFrame forwardKinematics(const std::vector<RecordedJoint>& joints, const RecordedFrame& frame) {
  WorldFrame world{frame.rotations, frame.positions};
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const int parent = joints[j].parent;
    if (parent >= 0) {
      const auto column = static_cast<Eigen::Index>(j);
      world.rotations[j] = world.rotations[parent] * frame.rotations[j];
      world.positions.col(column) =
          world.positions.col(parent) + world.rotations[parent] * frame.positions.col(column);
    }
  }
  return world;
}

Eigen::Matrix3Xd restPositions(const std::vector<RecordedJoint>& joints) {
  RecordedFrame rest;
  rest.rotations.assign(joints.size(), Eigen::Quaterniond::Identity());
  rest.positions.resize(3, static_cast<Eigen::Index>(joints.size()));
  for (std::size_t j = 0; j < joints.size(); ++j) {
    rest.positions.col(static_cast<Eigen::Index>(j)) = joints[j].offset;
  }
  return forwardKinematics(joints, rest).positions;
}

/// The coordinate axis, with sign, that is nearest to a direction.
Eigen::Vector3d nearestAxis(const Eigen::Vector3d& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::copysign(1.0, direction[axis]) * Eigen::Vector3d::Unit(axis);
}

/// Retargets the frames of one recording; holds what depends on the two rest poses alone.
class Retargeter {
 public:
  Retargeter(const RecordedMotion& recording, const RetargetOptions& options)
      : recording_(recording),
        body_(options.body),
        match_(matchSkeleton(recording.joints)),
        rest_(restPositions(recording.joints)) {
    requireMatch();
    const Eigen::Matrix3d basis = bodyFromRecording();
    bodyFromRecording_ = Eigen::Quaterniond(basis);
    worldFromRecording_ = bodyFromRecording_;
    if (options.up != UpAxis::kAuto) {
      const double angle = options.up == UpAxis::kZ ? -0.5 * std::numbers::pi : 0.0;
      worldFromRecording_ = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX());
    }
    unitInMetres_ = bodyLegLength() / recordedLegLength();
    for (int side = 0; side < 2; ++side) {
      alignLimbs(side);
    }
  }

  const std::string& convention() const { return match_.convention; }

  double unitInMetres() const { return unitInMetres_; }

  BodyPose pose(const RecordedFrame& frame) const {
    const WorldFrame recorded = forwardKinematics(recording_.joints, frame);
    std::array<Eigen::Quaterniond, kNumSmplJoints> world;
    world.fill(Eigen::Quaterniond::Identity());
    poseTorso(recorded.rotations, world);
    for (int side = 0; side < 2; ++side) {
      poseLimbs(recorded.rotations, side, world);
    }
    BodyPose result;
    setJointRotation(result, kPelvis, world[kPelvis]);
    for (int joint = 1; joint < kNumSmplJoints; ++joint) {
      setJointRotation(
          result, joint, world.at(kSmplParents.at(joint)).conjugate() * world.at(joint));
    }
    result.translation = translation(recorded.positions, world[kPelvis]);
    return result;
  }

 private:
  static constexpr std::array<std::array<int, kNumLimbJoints>, 2> kLimbs = {
      {{kLeftHip,
        kLeftKnee,
        kLeftAnkle,
        kLeftFoot,
        kLeftCollar,
        kLeftShoulder,
        kLeftElbow,
        kLeftWrist},
       {kRightHip,
        kRightKnee,
        kRightAnkle,
        kRightFoot,
        kRightCollar,
        kRightShoulder,
        kRightElbow,
        kRightWrist}}};

  int limb(int side, int part) const { return match_.limbs.at(side).at(part); }

  void requireMatch() const {
    if (match_.isComplete()) {
      return;
    }
    std::string parts;
    for (const std::string& part : match_.missing) {
      parts += (parts.empty() ? "" : ", ") + part;
    }
    throw std::invalid_argument(
        recording_.name + ": unknown skeleton (nearest: " + match_.convention +
        "), no joint found for: " + parts + "; rename the joints to one of the known conventions");
  }

  Eigen::Vector3d between(int from, int to) const { return rest_.col(to) - rest_.col(from); }

  Eigen::Vector3d midpoint(const Eigen::Matrix3Xd& positions, int part) const {
    return 0.5 * (positions.col(limb(0, part)) + positions.col(limb(1, part)));
  }

  /// Rows: the recording's axes for left (+x), up (+y) and forward (+z).
  Eigen::Matrix3d bodyFromRecording() const {
    const Eigen::Vector3d up = nearestAxis(midpoint(rest_, kUpperArm) - midpoint(rest_, kAnkle));
    Eigen::Vector3d across = between(limb(1, kThigh), limb(0, kThigh));
    across -= across.dot(up) * up;
    if (!(across.norm() > 1e-9)) {
      throw std::invalid_argument(
          recording_.name + ": the rest skeleton doesn't stand upright with its hips side by side");
    }
    const Eigen::Vector3d left = nearestAxis(across);
    Eigen::Matrix3d basis;
    basis.row(0) = left;
    basis.row(1) = up;
    basis.row(2) = left.cross(up);
    return basis;
  }

  double bodyLegLength() const {
    const JointPositions& joints = body_.joints;
    return (joints.col(kLeftKnee) - joints.col(kLeftHip)).norm() +
           (joints.col(kLeftAnkle) - joints.col(kLeftKnee)).norm();
  }

  double recordedLegLength() const {
    double sum = 0.0;
    for (int side = 0; side < 2; ++side) {
      sum += between(limb(side, kThigh), limb(side, kShin)).norm() +
             between(limb(side, kShin), limb(side, kAnkle)).norm();
    }
    if (!(sum > 1e-6)) {
      throw std::invalid_argument(
          recording_.name + ": the legs of the rest skeleton have no length");
    }
    return 0.5 * sum;
  }

  /// Mean rest position of what hangs below a joint, for the last bone of a limb.
  Eigen::Vector3d tipDirection(int joint) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::vector<bool> below(recording_.joints.size(), false);
    below[joint] = true;
    for (std::size_t j = 0; j < recording_.joints.size(); ++j) {
      const int parent = recording_.joints[j].parent;
      if (parent >= 0 && below[parent]) {
        below[j] = true;
        sum += between(joint, static_cast<int>(j));
      }
    }
    return sum;
  }

  /// A: body rest bone → recorded rest bone, both in the body's axes; `fallback` without a bone.
  Eigen::Quaterniond alignment(
      const Eigen::Vector3d& bodyBone,
      const Eigen::Vector3d& recordedBone,
      const Eigen::Quaterniond& fallback) const {
    const double shortest = 1e-3 * recordedLegLength();
    if (recordedBone.norm() < shortest || bodyBone.norm() < 1e-6) {
      return fallback;
    }
    return Eigen::Quaterniond::FromTwoVectors(bodyBone, bodyFromRecording_ * recordedBone);
  }

  void alignLimbs(int side) {
    const std::array<int, kNumLimbJoints>& smpl = kLimbs.at(side);
    std::array<Eigen::Quaterniond, kNumLimbJoints>& align = alignments_.at(side);
    align.fill(Eigen::Quaterniond::Identity());
    const auto bodyBone = [&](int part) -> Eigen::Vector3d {
      return body_.joints.col(smpl.at(part + 1)) - body_.joints.col(smpl.at(part));
    };
    for (const LimbJoint part : {kThigh, kShin, kUpperArm, kForearm}) {
      align.at(part) = alignment(
          bodyBone(part),
          between(limb(side, part), limb(side, part + 1)),
          Eigen::Quaterniond::Identity());
    }
    const int toe = limb(side, kToe);
    const int ankle = limb(side, kAnkle);
    align[kAnkle] = alignment(
        bodyBone(kAnkle),
        toe >= 0 ? between(ankle, toe) : tipDirection(ankle),
        Eigen::Quaterniond::Identity());
    align[kToe] = align[kAnkle];
    const Eigen::Vector3d hand =
        body_.joints.col(side == 0 ? kLeftHand : kRightHand) - body_.joints.col(smpl[kWrist]);
    align[kWrist] = alignment(hand, tipDirection(limb(side, kWrist)), align[kForearm]);
  }

  Eigen::Quaterniond inWorld(const Eigen::Quaterniond& recorded) const {
    return worldFromRecording_ * recorded * bodyFromRecording_.conjugate();
  }

  /// Orientation at a fraction of a chain; 0 is `base`, 1 the chain's last joint.
  static Eigen::Quaterniond alongChain(
      const Rotations& recorded, int base, const std::vector<int>& chain, double fraction) {
    const double position = fraction * static_cast<double>(chain.size());
    const auto lower = static_cast<std::size_t>(std::floor(position + 1e-9));
    const int from = lower == 0 ? base : chain[lower - 1];
    const int to = lower < chain.size() ? chain[lower] : from;
    return shortestSlerp(recorded[from], recorded[to], position - static_cast<double>(lower));
  }

  void poseTorso(
      const Rotations& recorded, std::array<Eigen::Quaterniond, kNumSmplJoints>& world) const {
    world[kPelvis] = inWorld(recorded[match_.hips]);
    world[kSpine1] = inWorld(alongChain(recorded, match_.hips, match_.spine, 1.0 / 3.0));
    world[kSpine2] = inWorld(alongChain(recorded, match_.hips, match_.spine, 2.0 / 3.0));
    const int chest = match_.spine.empty() ? match_.hips : match_.spine.back();
    world[kSpine3] = inWorld(recorded[chest]);
    std::vector<int> neckAndHead = match_.neck;
    if (match_.head >= 0) {
      neckAndHead.push_back(match_.head);
    }
    world[kNeck] = inWorld(alongChain(recorded, chest, neckAndHead, 0.5));
    world[kHead] = inWorld(alongChain(recorded, chest, neckAndHead, 1.0));
  }

  /// The joint that turns the segment as a whole: the last one before the next limb joint, so that
  /// roll joints (ASF's wrist, LeftForeArmRoll) twist the segment they lie in.
  int segmentJoint(int side, int part) const {
    const bool hasNext = part == kThigh || part == kShin || part == kUpperArm || part == kForearm;
    return hasNext ? recording_.joints[limb(side, part + 1)].parent : limb(side, part);
  }

  void poseLimbs(
      const Rotations& recorded,
      int side,
      std::array<Eigen::Quaterniond, kNumSmplJoints>& world) const {
    for (int part = 0; part < kNumLimbJoints; ++part) {
      const int joint = kLimbs.at(side).at(part);
      if (limb(side, part) < 0) {
        world.at(joint) = world.at(kSmplParents.at(joint));
        continue;
      }
      world.at(joint) = inWorld(recorded[segmentJoint(side, part)]) * alignments_.at(side).at(part);
    }
    const int wrist = kLimbs.at(side)[kWrist];
    world.at(side == 0 ? kLeftHand : kRightHand) = world.at(wrist);
  }

  Eigen::Vector3d translation(
      const Eigen::Matrix3Xd& recorded, const Eigen::Quaterniond& pelvis) const {
    const Eigen::Vector3d restPelvis = body_.joints.col(kPelvis);
    const Eigen::Vector3d restHips =
        0.5 * (body_.joints.col(kLeftHip) + body_.joints.col(kRightHip));
    const Eigen::Vector3d hips = unitInMetres_ * (worldFromRecording_ * midpoint(recorded, kThigh));
    return hips - pelvis * (restHips - restPelvis) - restPelvis;
  }

  const RecordedMotion& recording_;
  RestSkeleton body_;
  SkeletonMatch match_;
  Eigen::Matrix3Xd rest_;
  Eigen::Quaterniond bodyFromRecording_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond worldFromRecording_ = Eigen::Quaterniond::Identity();
  double unitInMetres_ = 1.0;
  std::array<std::array<Eigen::Quaterniond, kNumLimbJoints>, 2> alignments_;
};

}  // namespace

RetargetResult retargeted(const RecordedMotion& recording, const RetargetOptions& options) {
  validate(options.body);
  const Retargeter retargeter(recording, options);
  RetargetResult result;
  result.convention = retargeter.convention();
  result.unitInMetres = retargeter.unitInMetres();
  result.motion.framesPerSecond = recording.framesPerSecond;
  result.motion.frames.reserve(recording.frames.size());
  for (const RecordedFrame& frame : recording.frames) {
    result.motion.frames.push_back(retargeter.pose(frame));
  }
  if (options.placeOnFloor) {
    result.motion = placedOnFloor(result.motion, options.body);
  }
  return result;
}

}  // namespace avatar
