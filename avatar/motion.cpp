#include "avatar/motion.h"

#include "avatar/axis_angle.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace avatar {
namespace {

void requireRate(double framesPerSecond) {
  if (!(framesPerSecond > 0.0) || !std::isfinite(framesPerSecond)) {
    throw std::invalid_argument("motion: the frame rate must be positive and finite");
  }
}

int numJoints(const BodyPose& pose) {
  return static_cast<int>(pose.jointRotations.size() / 3);
}

bool isValid(const BodyPose& pose) {
  return pose.jointRotations.size() == 3 * kNumSmplJoints && pose.jointRotations.allFinite() &&
         pose.translation.allFinite();
}

/// Floor of a clip: the height that the soles come down to. A tenth of the frames may be lower, so
/// that noise and single bad frames don't lift the whole clip.
double floorLevel(const RestSkeleton& body, const Motion& motion) {
  std::vector<double> heights;
  heights.reserve(motion.frames.size());
  for (const BodyPose& pose : motion.frames) {
    heights.push_back(lowestSole(body, pose));
  }
  const auto tenth = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 10);
  std::nth_element(heights.begin(), tenth, heights.end());
  return *tenth;
}

/// Rotation applied to the whole world.
Motion rotated(
    const Motion& motion, const Eigen::Quaterniond& rotation, const Eigen::Vector3d& restPelvis) {
  Motion result = motion;
  for (BodyPose& pose : result.frames) {
    setJointRotation(pose, kPelvis, rotation * jointRotation(pose, kPelvis));
    pose.translation = rotation * (restPelvis + pose.translation) - restPelvis;
  }
  return result;
}

BodyPose blendStart(const Motion& motion, const APoseBlendOptions& options) {
  BodyPose start = aPose();
  const BodyPose& first = motion.frames.front();
  if (options.keepHeading) {
    setJointRotation(
        start,
        kPelvis,
        Eigen::Quaterniond(Eigen::AngleAxisd(heading(first), Eigen::Vector3d::UnitY())));
  }
  start.translation = first.translation;
  start.translation.y() += floorLevel(options.body, motion) - lowestSole(options.body, start);
  return start;
}

/// The first frame moved back along its own velocity by `frames` frames (a negative number).
BodyPose extrapolatedStart(const Motion& motion, double frames) {
  if (motion.frames.size() < 2) {
    return motion.frames.front();
  }
  return interpolated(motion.frames[0], motion.frames[1], frames);
}

}  // namespace

double duration(const Motion& motion) {
  return motion.frames.empty()
             ? 0.0
             : static_cast<double>(motion.frames.size() - 1) / motion.framesPerSecond;
}

double minimumJerk(double u) {
  const double x = std::clamp(u, 0.0, 1.0);
  return x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
}

BodyPose interpolated(const BodyPose& from, const BodyPose& to, double u) {
  if (from.jointRotations.size() != to.jointRotations.size()) {
    throw std::invalid_argument("interpolated: the poses have different joint counts");
  }
  if (u == 0.0) {
    return from;
  }
  if (u == 1.0) {
    return to;
  }
  BodyPose result = from;
  for (int joint = 0; joint < numJoints(from); ++joint) {
    setJointRotation(
        result, joint, shortestSlerp(jointRotation(from, joint), jointRotation(to, joint), u));
  }
  result.translation += u * (to.translation - from.translation);
  return result;
}

BodyPose poseAt(const Motion& motion, double seconds) {
  if (motion.frames.empty()) {
    throw std::invalid_argument("poseAt: the motion has no frames");
  }
  requireRate(motion.framesPerSecond);
  const double last = static_cast<double>(motion.frames.size() - 1);
  const double position = std::clamp(seconds * motion.framesPerSecond, 0.0, last);
  const double nearest = std::round(position);
  constexpr double kSameFrame = 1e-9;  // rounding of seconds · rate, in frames per frame index
  if (std::abs(position - nearest) <= kSameFrame * (1.0 + position)) {
    return motion.frames[static_cast<std::size_t>(nearest)];
  }
  const double lower = std::floor(position);
  const auto index = static_cast<std::size_t>(lower);
  return interpolated(motion.frames[index], motion.frames[index + 1], position - lower);
}

std::vector<BodyPose> posesAt(const Motion& motion, const std::vector<double>& seconds) {
  std::vector<BodyPose> poses;
  poses.reserve(seconds.size());
  for (const double time : seconds) {
    if (!std::isfinite(time)) {
      throw std::invalid_argument("posesAt: every time must be finite");
    }
    poses.push_back(poseAt(motion, time));
  }
  return poses;
}

Motion resampled(const Motion& motion, double framesPerSecond) {
  requireRate(framesPerSecond);
  Motion result;
  result.framesPerSecond = framesPerSecond;
  result.betas = motion.betas;
  if (motion.frames.empty()) {
    return result;
  }
  constexpr double kSlack = 1e-6;  // a last frame that rounding puts just behind the end counts
  const auto count =
      static_cast<std::size_t>(std::floor(duration(motion) * framesPerSecond + kSlack)) + 1;
  result.frames.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    result.frames.push_back(poseAt(motion, static_cast<double>(i) / framesPerSecond));
  }
  return result;
}

Motion concatenated(const Motion& first, const Motion& second) {
  Motion result = first;
  const Motion rest = second.framesPerSecond == first.framesPerSecond
                          ? second
                          : resampled(second, first.framesPerSecond);
  result.frames.insert(result.frames.end(), rest.frames.begin(), rest.frames.end());
  return result;
}

void APoseBlendOptions::validate() const {
  if (!(seconds >= 0.0 && seconds <= 60.0)) {
    throw std::invalid_argument("APoseBlendOptions: seconds must be within 0 … 60");
  }
  avatar::validate(body);
}

Motion blendedFromAPose(const Motion& motion, const APoseBlendOptions& options) {
  options.validate();
  requireRate(motion.framesPerSecond);
  const auto count =
      static_cast<std::size_t>(std::lround(options.seconds * motion.framesPerSecond));
  if (motion.frames.empty() || count == 0) {
    return motion;
  }
  const BodyPose start = blendStart(motion, options);
  Motion result = motion;
  result.frames.clear();
  const double n = static_cast<double>(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double u = static_cast<double>(i) / n;
    // The target comes along the clip's initial velocity: g(u) = −(1−u)u² has g(1) = 0, g'(1) = 1
    // and g'(0) = 0, so position and velocity are continuous at both ends.
    const BodyPose target = extrapolatedStart(motion, -n * (1.0 - u) * u * u);
    result.frames.push_back(interpolated(start, target, minimumJerk(u)));
  }
  result.frames.insert(result.frames.end(), motion.frames.begin(), motion.frames.end());
  return result;
}

Motion fromZUp(const Motion& motion, const Eigen::Vector3d& restPelvis) {
  const Eigen::AngleAxisd turn(-0.5 * std::numbers::pi, Eigen::Vector3d::UnitX());
  return rotated(motion, Eigen::Quaterniond(turn), restPelvis);
}

Motion translated(const Motion& motion, const Eigen::Vector3d& offset) {
  Motion result = motion;
  for (BodyPose& pose : result.frames) {
    pose.translation += offset;
  }
  return result;
}

Motion turned(const Motion& motion, double yaw, const Eigen::Vector3d& restPelvis) {
  const Eigen::AngleAxisd turn(yaw, Eigen::Vector3d::UnitY());
  return rotated(motion, Eigen::Quaterniond(turn), restPelvis);
}

double heading(const BodyPose& pose) {
  const Eigen::Vector3d forward = jointRotation(pose, kPelvis) * Eigen::Vector3d::UnitZ();
  return std::atan2(forward.x(), forward.z());
}

Eigen::Vector3d lean(const BodyPose& pose) {
  return axisAngleFromQuaternion(
      rotationAbout(-heading(pose), Eigen::Vector3d::UnitY()) * jointRotation(pose, kPelvis));
}

Motion placedOnFloor(const Motion& motion, const RestSkeleton& body) {
  if (motion.frames.empty()) {
    return motion;
  }
  return translated(motion, Eigen::Vector3d(0.0, -floorLevel(body, motion), 0.0));
}

MotionCheck checked(const Motion& motion) {
  MotionCheck check;
  for (const BodyPose& pose : motion.frames) {
    const bool valid = isValid(pose);
    check.frameIsValid.push_back(valid);
    check.numInvalid += valid ? 0 : 1;
  }
  if (check.numInvalid > 0) {
    check.warnings.push_back(
        std::to_string(check.numInvalid) + " of " + std::to_string(motion.frames.size()) +
        " frames are not finite or don't have 72 joint parameters");
  }
  return check;
}

Motion repaired(const Motion& motion) {
  const std::vector<bool> good = checked(motion).frameIsValid;
  const int count = static_cast<int>(good.size());
  const auto firstGood = std::find(good.begin(), good.end(), true);
  if (count > 0 && firstGood == good.end()) {
    throw std::invalid_argument("repaired: no frame of the motion is valid");
  }
  Motion result = motion;
  int previous = static_cast<int>(firstGood - good.begin());
  for (int i = 0; i < count; ++i) {
    if (good[i]) {
      previous = i;
      continue;
    }
    int next = std::max(i, previous);
    while (next < count && !good[next]) {
      ++next;
    }
    const bool isBetween = previous < i && next < count;
    const double u = isBetween ? static_cast<double>(i - previous) / (next - previous) : 0.0;
    const BodyPose& from = motion.frames[previous];
    result.frames[i] = isBetween ? interpolated(from, motion.frames[next], u) : from;
  }
  return result;
}

}  // namespace avatar
