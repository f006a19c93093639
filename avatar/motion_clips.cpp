#include "avatar/motion_clips.h"

#include "avatar/axis_angle.h"
#include "avatar/clip_body.h"
#include "avatar/clip_gait.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace avatar {
namespace {

const Eigen::Vector3d kX = Eigen::Vector3d::UnitX();
const Eigen::Vector3d kY = Eigen::Vector3d::UnitY();
const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

/// The same rotation on both sides, the right one mirrored in x.
void setPair(BodyPose& pose, int leftJoint, const Eigen::Quaterniond& left) {
  setJointRotation(pose, leftJoint, left);
  setJointRotation(
      pose, mirroredJoint(leftJoint), Eigen::Quaterniond(left.w(), left.x(), -left.y(), -left.z()));
}

/// Trunk and head bent or turned by `total`, spread over the three spine joints.
void setSpine(BodyPose& pose, const Eigen::Quaterniond& total) {
  const Eigen::Quaterniond third = shortestSlerp(Eigen::Quaterniond::Identity(), total, 1.0 / 3.0);
  for (const int joint : {kSpine1, kSpine2, kSpine3}) {
    setJointRotation(pose, joint, third);
  }
}

/// Arms out to the side, `elevation` above the horizontal; the collar bone takes its third of what
/// is above the A-pose (scapulohumeral rhythm 2 : 1, Inman 1944).
void abductArms(BodyPose& pose, double elevation) {
  const double collar = std::max(0.0, elevation + 45.0 * kDegree) / 3.0 * 0.8;
  setPair(pose, kLeftCollar, rotationAbout(collar, kZ));
  setPair(pose, kLeftShoulder, rotationAbout(elevation - collar, kZ));
}

/// Cycles that fit the wanted length, and how long each then takes.
struct Cycles {
  int count = 1;
  double period = 1.0;  ///< [s]
};

Cycles cyclesFor(const ClipOptions& options, double naturalSeconds, double naturalPeriod) {
  const double seconds = options.seconds > 0.0 ? options.seconds : naturalSeconds;
  const int count = std::max(1, static_cast<int>(std::lround(seconds / naturalPeriod)));
  return {count, seconds / count};
}

/// The A-pose's stance, the feet put flat within the blend.
ClipFrame plantedFrame(const ClipBody& body, double blend) {
  ClipFrame frame = body.standing();
  for (FootPlacement& foot : frame.feet) {
    foot.roll *= 1.0 - blend;
    foot.height *= 1.0 - blend;
  }
  // Knees a little soft: at full stretch inverse kinematics has infinite speeds.
  frame.pelvis.y() -= 0.006 * body.legLength() * blend;
  return frame;
}

/// Angle of a turn by 2π with constant speed and smooth ends: the speed rises and falls by cosines
/// over a tenth of the time each.
double turnAngle(double u) {
  constexpr double kRamp = 0.1;
  const auto risen = [](double x) {  // ∫ (1 − cos(π x/r))/2 dx
    return 0.5 * x - 0.5 * kRamp / std::numbers::pi * std::sin(std::numbers::pi * x / kRamp);
  };
  const double x = std::clamp(u, 0.0, 1.0);
  const double whole = 1.0 - kRamp;  // area under the speed profile
  if (x < kRamp) {
    return 2.0 * std::numbers::pi * risen(x) / whole;
  }
  if (x > 1.0 - kRamp) {
    return 2.0 * std::numbers::pi * (1.0 - risen(1.0 - x) / whole);
  }
  return 2.0 * std::numbers::pi * (x - 0.5 * kRamp) / whole;
}

Motion turn(const ClipOptions& options, const ClipBody& body) {
  const double seconds = options.seconds > 0.0 ? options.seconds : 6.0;
  Motion motion;
  motion.framesPerSecond = options.framesPerSecond;
  const double total = options.blendSeconds + seconds;
  const int count = static_cast<int>(std::floor(total * options.framesPerSecond + 1e-6)) + 1;
  for (int i = 0; i < count; ++i) {
    const double time = i / options.framesPerSecond;
    const double last = (count - 1) / options.framesPerSecond;
    const double turnTime = last - options.blendSeconds;
    BodyPose pose = body.standing().upper;
    const double angle = turnAngle((time - options.blendSeconds) / turnTime);
    setJointRotation(pose, kPelvis, rotationAbout(angle, kY));
    motion.frames.push_back(pose);
  }
  return motion;
}

Motion turnSteps(const ClipOptions& options, const ClipBody& body) {
  const double seconds = options.seconds > 0.0 ? options.seconds : 6.0;
  GaitPlan plan;
  plan.period = 0.9;
  plan.start = options.blendSeconds;
  plan.end = options.blendSeconds + seconds;
  plan.heading = [=](double t) { return turnAngle((t - options.blendSeconds) / seconds); };
  plan.amplitude = 0.25;
  plan.clearance = 0.04;
  const Gait gait(body, plan);
  const double settle = plan.period;
  return builtClip(options, body, plan.end + settle, [&](double t) {
    return gait.frame(t, plantedFrame(body, minimumJerk(t / options.blendSeconds)));
  });
}

/// Upper body of a walk (Murray 1967: shoulder −24° … +8°, elbow 15° … 45°; Perry & Burnfield 2010:
/// trunk turning against the pelvis). `phase` 0 at left heel strike.
BodyPose walkingUpper(double phase) {
  BodyPose pose;
  const double swing = std::cos(2.0 * std::numbers::pi * phase);  // +1: left leg in front
  const auto arm = [&](int collarSide, double forward) {
    const int shoulder = collarSide == 0 ? kLeftShoulder : kRightShoulder;
    const int elbow = collarSide == 0 ? kLeftElbow : kRightElbow;
    const double sign = collarSide == 0 ? 1.0 : -1.0;
    const double flexion = (2.0 + 20.0 * forward) * kDegree;
    setJointRotation(
        pose, shoulder, rotationAbout(-flexion, kX) * rotationAbout(-sign * 76.0 * kDegree, kZ));
    setJointRotation(pose, elbow, rotationAbout(-sign * (24.0 + 11.0 * forward) * kDegree, kY));
  };
  arm(0, -swing);
  arm(1, swing);
  // The left shoulder goes back with the left leg in front: turn to the left (+y).
  setSpine(pose, rotationAbout(9.0 * kDegree * swing, kY) * rotationAbout(4.0 * kDegree, kX));
  setJointRotation(
      pose, kNeck, rotationAbout(-5.0 * kDegree * swing, kY) * rotationAbout(-2.0 * kDegree, kX));
  return pose;
}

/// Step length from the walk ratio, 0.0065 m per step/min (Sekiya 1997), scaled with the leg.
double stridePeriod(const ClipOptions& options, const ClipBody& body) {
  const double walkRatio = 0.0065 * 60.0 * body.legLength() / 0.84;  // [m·s]
  const double stepLength = std::sqrt(walkRatio * options.walkingSpeed);
  return 2.0 * stepLength / options.walkingSpeed;
}

Motion walk(const ClipOptions& options, const ClipBody& body, bool inPlace) {
  const double seconds = options.seconds > 0.0 ? options.seconds : 6.0;
  GaitPlan plan;
  plan.period = stridePeriod(options, body);
  plan.start = 0.5 * options.blendSeconds;
  // Still walking at the end, and long enough for the steady cycle that sets the pelvis height.
  plan.end = std::max(options.blendSeconds + seconds, plan.start + 4.0 * plan.period) + plan.period;
  const double ramp = 1.2 * plan.period;
  plan.travel = [=](double t) {
    // ∫ of a smoothstep speed, v·r·(u³ − u⁴/2), then constant speed.
    const double u = std::clamp((t - plan.start) / ramp, 0.0, 1.0);
    const double risen = options.walkingSpeed * ramp * (u * u * u - 0.5 * u * u * u * u);
    return risen + options.walkingSpeed * std::max(0.0, t - plan.start - ramp);
  };
  plan.halfTrack = 0.055;
  const Gait gait(body, plan);
  return builtClip(options, body, options.blendSeconds + seconds, [&](double t) {
    const double blend = minimumJerk(t / options.blendSeconds);
    ClipFrame frame = plantedFrame(body, blend);
    frame.upper = walkingUpper(gait.phase(t));
    frame = gait.frame(t, frame);
    if (inPlace) {
      const double back = plan.travel(t);
      frame.pelvis.z() -= back;
      frame.feet[0].print.y() -= back;
      frame.feet[1].print.y() -= back;
    }
    return frame;
  });
}

Motion armRaise(const ClipOptions& options, const ClipBody& body) {
  const Cycles cycles = cyclesFor(options, 7.0, 3.5);
  const double total = options.blendSeconds + cycles.count * cycles.period;
  return builtClip(options, body, total, [&](double t) {
    ClipFrame frame = plantedFrame(body, minimumJerk(t / options.blendSeconds));
    const double u = std::max(0.0, t - options.blendSeconds) / cycles.period;
    const double raised = keyedPeriodic({{0.0, 0.0}, {0.45, 1.0}, {0.55, 1.0}, {1.0, 0.0}}, u);
    abductArms(frame.upper, (-45.0 + 118.0 * raised) * kDegree);
    setPair(frame.upper, kLeftElbow, rotationAbout(-8.0 * kDegree * raised, kY));
    setSpine(frame.upper, rotationAbout(-5.0 * kDegree * raised, kX));
    return frame;
  });
}

Motion squat(const ClipOptions& options, const ClipBody& body) {
  const Cycles cycles = cyclesFor(options, 6.4, 3.2);
  const double total = options.blendSeconds + cycles.count * cycles.period;
  return builtClip(options, body, total, [&](double t) {
    ClipFrame frame = plantedFrame(body, minimumJerk(t / options.blendSeconds));
    const double u = std::max(0.0, t - options.blendSeconds) / cycles.period;
    const double depth =
        keyedPeriodic({{0.0, 0.0}, {0.45, 1.0}, {0.55, 1.0}, {0.92, 0.0}, {1.0, 0.0}}, u);
    const double leg = body.legLength();
    // A knee bends like the root of the way down: 1 − cos keeps its speed finite at the start.
    const double down = 1.0 - std::cos(0.5 * std::numbers::pi * depth);
    frame.pelvis.y() -= 0.40 * leg * down;
    // Down with the hips behind: 0.4 thighs at full depth keeps the trunk's weight
    // over the feet.
    frame.pelvis.z() -= 0.20 * leg * down;
    frame.pelvisRotation = rotationAbout(28.0 * kDegree * depth, kX);
    setSpine(frame.upper, rotationAbout(14.0 * kDegree * depth, kX));
    setJointRotation(frame.upper, kNeck, rotationAbout(-16.0 * kDegree * depth, kX));
    setJointRotation(frame.upper, kHead, rotationAbout(-10.0 * kDegree * depth, kX));
    const Eigen::Quaterniond forward =
        rotationAbout(-34.0 * kDegree, kX) * rotationAbout(-80.0 * kDegree, kY);
    setPair(
        frame.upper,
        kLeftShoulder,
        shortestSlerp(rotationAbout(-45.0 * kDegree, kZ), forward, depth));
    return frame;
  });
}

Motion twist(const ClipOptions& options, const ClipBody& body) {
  const Cycles cycles = cyclesFor(options, 5.6, 2.8);
  const double total = options.blendSeconds + cycles.count * cycles.period;
  return builtClip(options, body, total, [&](double t) {
    ClipFrame frame = plantedFrame(body, minimumJerk(t / options.blendSeconds));
    const double acting = std::max(0.0, t - options.blendSeconds);
    const double left = cycles.count * cycles.period - acting;
    const double fade = minimumJerk(acting / 0.7) * minimumJerk(left / 0.7);
    const double turned = fade * std::sin(2.0 * std::numbers::pi * acting / cycles.period);
    frame.pelvisRotation = rotationAbout(15.0 * kDegree * turned, kY);
    setSpine(frame.upper, rotationAbout(36.0 * kDegree * turned, kY));
    setJointRotation(frame.upper, kNeck, rotationAbout(12.0 * kDegree * turned, kY));
    // Arms a little higher than in the A-pose, trailing behind the turn.
    abductArms(frame.upper, (-45.0 + 20.0 * fade) * kDegree);
    for (const int elbow : {kLeftElbow, kRightElbow}) {
      const double bend = (elbow == kLeftElbow ? -1.0 : 1.0) * 18.0 * fade;
      setJointRotation(frame.upper, elbow, rotationAbout(bend * kDegree, kY));
    }
    return frame;
  });
}

/// One hop of a jumping jack, u = 0 … 1 from deepest knee bend to deepest knee bend; in the air for
/// 0.3 < u < 0.7.
struct Hop {
  double wideness = 0.0;  ///< of the stance, 0 closed, 1 wide
  double raised = 0.0;    ///< arms, 0 down, 1 up
  double pelvis = 0.0;    ///< height against standing on flat feet [m]
  double pitch = 0.0;     ///< of the feet [rad]
  double height = 0.0;    ///< of the soles [m]
};

Hop hopAt(double acting, double period, int count) {
  const double hops = std::clamp(acting / period, 0.0, static_cast<double>(count));
  const int index = std::min(count - 1, static_cast<int>(hops));
  const double u = hops - index;
  const double air = std::clamp((u - 0.3) / 0.4, 0.0, 1.0);
  Hop hop;
  const double across = minimumJerk(air);
  hop.wideness = index % 2 == 0 ? across : 1.0 - across;
  // Feet can move only in the air; arms have nearly the whole hop, or hands would fly at 12 m/s.
  const double swung = minimumJerk((u - 0.06) / 0.88);
  hop.raised = index % 2 == 0 ? swung : 1.0 - swung;
  hop.pelvis =
      keyedPeriodic({{0.0, -0.07}, {0.3, 0.015}, {0.5, 0.06}, {0.7, 0.015}, {1.0, -0.07}}, u);
  hop.pitch =
      kDegree *
      keyedPeriodic(
          {{0.0, 0.0}, {0.12, 0.0}, {0.3, 28.0}, {0.5, 34.0}, {0.7, 26.0}, {0.88, 0.0}, {1.0, 0.0}},
          u);
  hop.height = 0.045 * std::pow(4.0 * air * (1.0 - air), 1.5);
  return hop;
}

Motion jumpingJack(const ClipOptions& options, const ClipBody& body) {
  const Cycles cycles = cyclesFor(options, 6.0, 1.2);
  const double period = 0.5 * cycles.period;
  const double hopping = cycles.count * cycles.period;
  constexpr double kSettle = 0.5;  // standing up after the last landing [s]
  const double leg = body.legLength();
  return builtClip(options, body, options.blendSeconds + hopping + kSettle, [&](double t) {
    const double blend = minimumJerk(t / options.blendSeconds);
    const double acting = std::max(0.0, t - options.blendSeconds);
    const Hop hop = hopAt(acting, period, 2 * cycles.count);
    ClipFrame frame = plantedFrame(body, blend);
    const double narrow = std::abs(frame.feet[0].print.x());
    // The first hop leaves the A-pose's stance, all later ones the closed stance.
    const double closed = acting < period ? narrow : std::min(narrow, 0.12 * leg);
    const double track = closed + (0.5 * leg - closed) * hop.wideness;
    ClipFrame flat = frame;
    for (int side = 0; side < 2; ++side) {
      FootPlacement& foot = frame.feet.at(side);
      foot.print.x() = side == 0 ? track : -track;
      flat.feet.at(side).print.x() = foot.print.x();
      foot.pitch = blend * hop.pitch;
      foot.height += hop.height;
    }
    const double standing = body.highestPelvis(flat, 0.995);
    const double settled = minimumJerk((acting - hopping) / kSettle);
    frame.pelvis.y() += blend * (standing + (1.0 - settled) * hop.pelvis - frame.pelvis.y());
    const double swing = acting < period ? -45.0 : -68.0;
    abductArms(frame.upper, (swing + (62.0 - swing) * hop.raised) * kDegree);
    setPair(frame.upper, kLeftElbow, rotationAbout(-(12.0 + 14.0 * hop.raised) * kDegree, kY));
    return frame;
  });
}

}  // namespace

void ClipOptions::validate() const {
  const auto require = [](double value, double low, double high, const char* name) {
    if (!(value >= low && value <= high)) {
      throw std::invalid_argument(
          std::string("ClipOptions: ") + name + " must be within " + std::to_string(low) + " … " +
          std::to_string(high));
    }
  };
  require(framesPerSecond, 5.0, 1000.0, "framesPerSecond");
  require(blendSeconds, 0.2, 10.0, "blendSeconds");
  require(seconds, 0.0, 600.0, "seconds");
  require(walkingSpeed, 0.4, 1.8, "walkingSpeed");
  avatar::validate(body);
}

const std::vector<std::string_view>& clipNames() {
  static const std::vector<std::string_view> names = {
      "turn", "turn_steps", "walk", "walk_in_place", "arm_raise", "squat", "jumping_jack", "twist"};
  return names;
}

Motion makeClip(std::string_view name, const ClipOptions& options) {
  options.validate();
  const ClipBody body(options.body);
  if (name == "turn") {
    return turn(options, body);
  }
  if (name == "turn_steps") {
    return turnSteps(options, body);
  }
  if (name == "walk" || name == "walk_in_place") {
    return walk(options, body, name == "walk_in_place");
  }
  if (name == "arm_raise") {
    return armRaise(options, body);
  }
  if (name == "squat") {
    return squat(options, body);
  }
  if (name == "jumping_jack") {
    return jumpingJack(options, body);
  }
  if (name == "twist") {
    return twist(options, body);
  }
  std::string known;
  for (const std::string_view clip : clipNames()) {
    known += (known.empty() ? "" : ", ") + std::string(clip);
  }
  throw std::invalid_argument(
      "makeClip: no clip is named " + std::string(name) + "; known: " + known);
}

std::optional<NamedClip> namedClip(std::string_view text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::vector<std::string_view>& names = clipNames();
  const auto name = std::find(names.begin(), names.end(), text.substr(0, colon));
  if (name == names.end()) {
    return std::nullopt;
  }
  NamedClip clip{*name, {}};
  if (colon == text.size()) {
    return clip;
  }
  double seconds = 0.0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, seconds);
  if (error != std::errc() || stop != end || !(seconds >= 0.2 && seconds <= 600.0)) {
    return std::nullopt;
  }
  clip.options.seconds = seconds;
  clip.options.blendSeconds = std::clamp(0.25 * seconds, 0.2, clip.options.blendSeconds);
  return clip;
}

}  // namespace avatar
