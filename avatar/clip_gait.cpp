#include "avatar/clip_gait.h"

#include "avatar/axis_angle.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace avatar {
namespace {

constexpr double kStance = 0.62;  // share of the cycle (Perry & Burnfield 2010)
// The body passes over the flat foot before the middle of the stance, which ends on the toes.
constexpr double kPrintTime = 0.38;  // share of the stance

/// Pitch of the foot over its own cycle, 0 at heel strike, toes down positive (Winter 2009): heel
/// strike at −18°, flat at 8 %, heel off at 35 %, toe off at 62 % with 58°.
double footPitch(double phase) {
  static const std::vector<Eigen::Vector2d> keys = {
      {0.0, -18.0},
      {0.08, 0.0},
      {0.33, 0.0},
      {0.5, 22.0},
      {0.62, 58.0},
      {0.68, 62.0},
      {0.84, 12.0},
      {0.94, -16.0},
      {1.0, -18.0}};
  return kDegree * keyedPeriodic(keys, phase);
}

double smoothStep(double u) {
  const double x = std::clamp(u, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

}  // namespace

Gait::Gait(const ClipBody& body, GaitPlan plan) : body_(body), plan_(std::move(plan)) {
  for (int side = 0; side < 2; ++side) {
    planSide(body, side);
  }
  // The highest mean height at which no leg is stretched beyond 99.5 % in a steady cycle.
  const double share = 0.995;
  pelvisHeight_ = std::numeric_limits<double>::infinity();
  const double steady = plan_.start + 3.0 * plan_.period;
  constexpr int kSamples = 100;
  for (int i = 0; i < kSamples; ++i) {
    const double time = steady + plan_.period * i / kSamples;
    ClipFrame sample = body.standing();
    for (int side = 0; side < 2; ++side) {
      sample.feet.at(side) = foot(side, time, sample.feet.at(side));
    }
    sample.pelvis.y() = 0.0;
    poseRoot(time, 1.0, sample);
    pelvisHeight_ = std::min(pelvisHeight_, body.highestPelvis(sample, share) - sample.pelvis.y());
  }
}

double Gait::phase(double time) const {
  const double cycles = (time - plan_.start) / plan_.period + kStance;
  return cycles - std::floor(cycles);
}

double Gait::ease(double time) const {
  const double in = smoothStep((time - 0.5 * plan_.start) / (0.8 * plan_.period));
  return in * smoothStep((plan_.end + plan_.period - time) / plan_.period);
}

FootPlacement Gait::print(const ClipBody& body, int side, double time) const {
  FootPlacement result;
  const double standing = body.standing().feet.at(side).print.x();
  const double across = plan_.halfTrack < 0.0 ? standing : std::copysign(plan_.halfTrack, standing);
  const double yaw = plan_.heading(time);
  const double along = body.standing().feet.at(side).print.y();
  result.print << across * std::cos(yaw) + along * std::sin(yaw),
      plan_.travel(time) - across * std::sin(yaw) + along * std::cos(yaw);
  result.yaw = yaw;
  return result;
}

void Gait::planSide(const ClipBody& body, int side) {
  const double swing = (1.0 - kStance) * plan_.period;
  FootPlacement at = body.standing().feet.at(side);
  double lift = plan_.start + 0.5 * plan_.period * side;
  constexpr double kLongest = 2000.0;  // [s]; more than any clip lasts
  while (lift < std::min(plan_.end, kLongest)) {
    const double land = lift + swing;
    const double nextLift = lift + plan_.period;
    const bool isLast = nextLift >= plan_.end;
    const FootPlacement to =
        print(body, side, isLast ? plan_.end : land + kPrintTime * (nextLift - land));
    steps_.at(side).push_back({lift, land, at, to});
    at = to;
    lift = nextLift;
  }
}

FootPlacement Gait::foot(int side, double time, const FootPlacement& standing) const {
  FootPlacement result = standing;
  double swing = 0.0;
  for (const Step& step : steps_.at(side)) {
    if (time < step.lift) {
      break;
    }
    swing = std::clamp((time - step.lift) / (step.land - step.lift), 0.0, 1.0);
    const double u = smoothStep(swing);
    result.print = (1.0 - u) * step.from.print + u * step.to.print;
    result.yaw = step.from.yaw + u * (step.to.yaw - step.from.yaw);
  }
  const double own = phase(time) + (side == 0 ? 0.0 : 0.5);
  result.pitch = plan_.amplitude * ease(time) * footPitch(own - std::floor(own));
  const double lifted = 4.0 * swing * (1.0 - swing);
  result.height += plan_.clearance * lifted * lifted;
  result.isSwinging = swing > 0.0 && swing < 1.0;
  result.heelPivot = smoothStep((swing - 0.3) / 0.7);
  return result;
}

/// Pelvis over the feet (Perry & Burnfield 2010): highest in mid-stance, lowest in double support
/// (±2 cm), 2 cm towards the standing leg, list 4° down on the swinging side, rotation 4° forward
/// with the leading leg.
void Gait::poseRoot(double time, double ease, ClipFrame& frame) const {
  const double amplitude = ease * plan_.amplitude;
  const double angle = 2.0 * std::numbers::pi * phase(time);
  const double yaw = plan_.heading(time);
  // Left mid-stance is at phase 0.30.
  const double midStance = 2.0 * std::numbers::pi * 0.30;
  const double overLeft = std::cos(angle - midStance);
  const double sway = 0.02 * amplitude * overLeft;
  frame.pelvis.x() = sway * std::cos(yaw);
  frame.pelvis.z() = plan_.travel(time) - sway * std::sin(yaw);
  frame.pelvis.y() += 0.018 * amplitude * std::cos(2.0 * (angle - midStance));
  const double list = -4.0 * kDegree * amplitude * std::cos(angle - 2.0 * std::numbers::pi * 0.14);
  const double rotation = -4.0 * kDegree * amplitude * std::cos(angle);
  frame.pelvisRotation = rotationAbout(yaw + rotation, Eigen::Vector3d::UnitY()) *
                         rotationAbout(-list, Eigen::Vector3d::UnitZ()) *
                         rotationAbout(3.0 * kDegree * amplitude, Eigen::Vector3d::UnitX());
}

ClipFrame Gait::frame(double time, const ClipFrame& base) const {
  ClipFrame result = base;
  const double e = ease(time);
  for (int side = 0; side < 2; ++side) {
    result.feet.at(side) = foot(side, time, base.feet.at(side));
  }
  const double lowered = minimumJerk(time / plan_.start);
  result.pelvis.y() += lowered * (pelvisHeight_ - result.pelvis.y());
  poseRoot(time, e, result);
  return result;
}

}  // namespace avatar
