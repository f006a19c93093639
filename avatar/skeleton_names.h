#pragma once

#include "avatar/recorded_motion.h"

#include <array>
#include <string>
#include <vector>

namespace avatar {

/// Limb joints that carry a name of their own in every convention; spine and neck are found from
/// the tree instead. Per side, left first.
enum LimbJoint : int {
  kThigh,
  kShin,
  kAnkle,
  kToe,
  kClavicle,
  kUpperArm,
  kForearm,
  kWrist,
  kNumLimbJoints
};

/// Which joints of a foreign skeleton play which part; indices into RecordedMotion::joints.
struct SkeletonMatch {
  std::string convention;  ///< such as "CMU" or "Mixamo, MotionBuilder"
  int hips = -1;
  int head = -1;                                           ///< −1: none
  std::array<std::array<int, kNumLimbJoints>, 2> limbs{};  ///< [left, right]; −1: none
  std::vector<int> spine;  ///< above the hips up to the joint that carries both arms; may be empty
  std::vector<int> neck;   ///< from there up to below the head; may be empty

  bool isComplete() const { return missing.empty(); }

  std::vector<std::string> missing;  ///< required parts that no joint was found for
};

/// Compares the joint names with the known conventions (CMU ASF names, MotionBuilder and Mixamo
/// with any prefix, cgspeed, Poser/DAZ, Biped, Unreal, SMPL) and returns the one that explains most
/// joints. Toes, clavicles, head, spine and neck may be missing; the rest is required.
SkeletonMatch matchSkeleton(const std::vector<RecordedJoint>& joints);

}  // namespace avatar
