#pragma once

namespace simulcap {

/// Standard deviation of a structured-light camera's depth z [m]: Nguyen, Izadi & Lovell 2012.
/// Time-of-flight cameras are quieter beyond 2 m.
constexpr float depthNoise(float z) {
  return 0.0012F + 0.0019F * (z - 0.4F) * (z - 0.4F);
}

/// Neighbouring pixels farther apart in depth than this see two surfaces [m]: five times the noise,
/// which covers a Kinect's disparity steps of 0.0028 z², and the slope of a surface seen at about
/// 75° (3.7 z / f per pixel, f near 525 px).
constexpr float depthJump(float z) {
  return 5.0F * depthNoise(z) + 0.007F * z;
}

}  // namespace simulcap
