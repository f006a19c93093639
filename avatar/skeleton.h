#pragma once

#include "avatar/body_pose.h"

#include <Eigen/Geometry>

#include <array>

namespace avatar {

/// 3 × 24 [m]: the joints of a body in its rest pose (T-pose, Y up, facing +Z), SMPL's order.
using JointPositions = Eigen::Matrix<double, 3, kNumSmplJoints>;

/// What a motion has to know of the body that performs it.
struct RestSkeleton {
  JointPositions joints;
  double floorHeight = 0.0;  ///< y of the lowest template vertex (the soles) [m]
};

/// An adult of 1.75 m with the segment lengths of Drillis & Contini 1966 (as in Winter 2009),
/// pelvis joint at the origin.
RestSkeleton defaultRestSkeleton();

/// Throws std::invalid_argument unless all joints are finite, both legs and arms have a length, and
/// the ankles are above the floor and below the hips.
void validate(const RestSkeleton& skeleton);

/// World rotation and position of every joint; SMPL's convention: the root turns about its own rest
/// position and the translation is added afterwards.
struct PosedSkeleton {
  std::array<Eigen::Quaterniond, kNumSmplJoints> rotations;
  JointPositions joints;  ///< [m]
};

PosedSkeleton posedSkeleton(const JointPositions& restJoints, const BodyPose& pose);

/// Height of the lowest point of the soles [m]: heels 5 cm behind the ankles, balls under the foot
/// joints, tips of the toes 7 cm before them (a foot is 0.152 statures long, Drillis & Contini).
double lowestSole(const RestSkeleton& body, const BodyPose& pose);

/// Rotation of one joint relative to its parent.
Eigen::Quaterniond jointRotation(const BodyPose& pose, int joint);
void setJointRotation(BodyPose& pose, int joint, const Eigen::Quaterniond& rotation);

}  // namespace avatar
