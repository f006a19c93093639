#include "src/tracking/limb_contact.h"

#include "src/tracking/tree_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace simulcap {
namespace {

constexpr double kGivesWay = 0.005;     // flesh [m]
constexpr double kArmThickness = 0.08;  // deeper in, no skin is the nearest [m]

struct Arm {
  int shoulder, elbow, wrist;
};

constexpr std::array<Arm, 2> kArms = {
    Arm{avatar::kLeftShoulder, avatar::kLeftElbow, avatar::kLeftWrist},
    Arm{avatar::kRightShoulder, avatar::kRightElbow, avatar::kRightWrist}};

bool isTrunkOrThigh(int joint) {
  using enum avatar::SmplJoint;
  return joint == kPelvis || joint == kSpine1 || joint == kSpine2 || joint == kSpine3 ||
         joint == kLeftHip || joint == kRightHip;
}

/// Beyond the upper arm's middle? Nearer to the shoulder, skin of arm and chest is one.
bool isFree(const TrackedSurface& surface, const PosedSamples& posed, int sample, const Arm& arm) {
  const int joint = surface.samples()[static_cast<std::size_t>(sample)].joint;
  if (joint != arm.shoulder)
    return joint == arm.elbow || joint == arm.wrist;
  const Eigen::Vector3d shoulder = posed.restJoints.col(arm.shoulder);
  const Eigen::Vector3d bone = posed.restJoints.col(arm.elbow) - shoulder;
  return bone.dot(posed.rest.col(sample) - shoulder) > 0.5 * bone.squaredNorm();
}

/// The skin that arms don't go into.
struct Obstacle {
  std::vector<int> samples;
  Eigen::MatrixX3d places;  // N × 3 [m]: each coordinate in one piece, for the search
  Eigen::AlignedBox3d box;

  /// The index of the nearest place and its squared distance [m²].
  std::pair<std::size_t, double> nearest(const Eigen::Vector3d& point) const {
    Eigen::Index index = 0;
    const Eigen::ArrayXd squared = (places.col(0).array() - point.x()).square() +
                                   (places.col(1).array() - point.y()).square() +
                                   (places.col(2).array() - point.z()).square();
    const double least = squared.minCoeff(&index);
    return {static_cast<std::size_t>(index), least};
  }
};

Obstacle trunkAndThighs(const TrackedSurface& surface, const PosedSamples& posed) {
  Obstacle obstacle;
  const int numSkin = surface.numBodySamples();  // counts them
  for (int s = 0; s < numSkin; ++s) {
    if (isTrunkOrThigh(surface.samples()[static_cast<std::size_t>(s)].joint))
      obstacle.samples.push_back(s);
  }
  obstacle.places = posed.positions(Eigen::all, obstacle.samples).transpose();
  for (const int s : obstacle.samples)
    obstacle.box.extend(Eigen::Vector3d(posed.positions.col(s)));
  return obstacle;
}

/// JᵀJ and Jᵀr of an arm's contacts, of the turns of shoulder and elbow.
struct ArmPushes {
  Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
};

ArmPushes pushes(
    const TrackedSurface& surface,
    const PosedSamples& posed,
    const std::vector<LimbContact>& contacts,
    const Arm& arm) {
  ArmPushes sum;
  for (const LimbContact& contact : contacts) {
    if (contact.shoulder != arm.shoulder)
      continue;
    const Eigen::VectorXd movement = movementAlong(surface, posed, contact.sample, contact.normal);
    Eigen::Matrix<double, 6, 1> row;
    row << movement.segment<3>(3 * arm.shoulder), movement.segment<3>(3 * arm.elbow);
    sum.matrix += row * row.transpose();
    sum.gradient -= contact.depth * row;
  }
  return sum;
}

/// A Gauss–Newton step on the contacts' squared depths and the joints' turns away from `start`.
void turn(
    const Arm& arm,
    const ArmPushes& pushes,
    const avatar::BodyPose& start,
    avatar::BodyPose& pose) {
  constexpr double kFirmness = 1e-3;  // of the joints against depth [m²/rad²]: 3 cm are a radian
  constexpr double kMaxTurn = 0.3;    // [rad]
  Eigen::Matrix<double, 6, 1> turned;
  turned << pose.jointRotations.segment<3>(3 * arm.shoulder) -
                start.jointRotations.segment<3>(3 * arm.shoulder),
      pose.jointRotations.segment<3>(3 * arm.elbow) -
          start.jointRotations.segment<3>(3 * arm.elbow);
  const Eigen::Matrix<double, 6, 6> matrix =
      pushes.matrix + kFirmness * Eigen::Matrix<double, 6, 6>::Identity();
  Eigen::Matrix<double, 6, 1> step = -matrix.ldlt().solve(pushes.gradient + kFirmness * turned);
  step *= kMaxTurn / std::max(kMaxTurn, step.norm());
  pose.jointRotations.segment<3>(3 * arm.shoulder) += step.head<3>();
  pose.jointRotations.segment<3>(3 * arm.elbow) += step.tail<3>();
}

}  // namespace

std::vector<LimbContact> limbContacts(const TrackedSurface& surface, const PosedSamples& posed) {
  const Obstacle obstacle = trunkAndThighs(surface, posed);
  std::vector<LimbContact> contacts;
  const int numSkin = surface.numBodySamples();
  for (const Arm& arm : kArms) {
    for (int s = 0; s < numSkin; ++s) {
      const Eigen::Vector3d place = posed.positions.col(s);
      if (!obstacle.box.contains(place) || !isFree(surface, posed, s, arm))
        continue;
      const auto [nearest, squaredDistance] = obstacle.nearest(place);
      const int other = obstacle.samples[nearest];
      const Eigen::Vector3d normal = posed.normals.col(other);
      const double depth = normal.dot(posed.positions.col(other) - place) - kGivesWay;
      const bool facesIt = normal.dot(posed.normals.col(s)) < 0.0;
      if (squaredDistance < kArmThickness * kArmThickness && depth > 0.0 && facesIt)
        contacts.push_back({s, arm.shoulder, arm.elbow, normal, depth});
    }
  }
  return contacts;
}

avatar::BodyPose armsApart(const TrackedSurface& surface, const BodyParameters& parameters) {
  constexpr int kSteps = 10;
  BodyParameters moved = parameters;
  for (int step = 0; step < kSteps; ++step) {
    const PosedSamples posed = surface.pose(moved, false);
    const std::vector<LimbContact> contacts = limbContacts(surface, posed);
    constexpr double kEnough = 0.001;  // [m]
    if (std::none_of(contacts.begin(), contacts.end(), [](const LimbContact& contact) {
          return contact.depth > kEnough;
        }))
      break;
    for (const Arm& arm : kArms)
      turn(arm, pushes(surface, posed, contacts, arm), parameters.pose, moved.pose);
  }
  return moved.pose;
}

}  // namespace simulcap
