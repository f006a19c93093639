#pragma once

#include <cmath>

namespace bullet_ext {

/// Angle [rad] in [−π, π] with the given sine and cosine, like atan2(sine, cosine). Needs s² + c² =
/// 1 only as nearly as rounding keeps it. (0, 0) has the angle 0.
inline double signedAngle(double sine, double cosine) {
  return std::atan2(sine, cosine);
}

/// Largest tangent the polynomial below is made for: tan(π/8).
inline constexpr float kAtanReach = 0.41421356F;
/// atan(x) ≈ x + x³ (c0 + c1 x² + c2 x⁴ + c3 x⁶), relative error below 2e-8 within ±kAtanReach
/// (Cephes, atanf).
inline constexpr float kAtanCoefficients[4] = {
    -3.33329491539e-1F, 1.99777106478e-1F, -1.38776856032e-1F, 8.05374449538e-2F};
inline constexpr float kQuarterPi = 0.78539816339744831F;
inline constexpr float kPi = 3.14159265358979324F;

/// The same in float, and by +, ×, ÷ alone: the result is the same with any math library, and the
/// wide kernels compute it the same way. Error below 5e-7.
///
/// With |α| or, for a negative cosine, π − |α| called γ, tan(γ/2) = |s| / (1 + |c|) is in [0, 1]
/// and has no cancellation anywhere; beyond tan(π/8), atan u = π/4 + atan((u − 1)/(u + 1)).
inline float signedAngle(float sine, float cosine) {
  const float top = std::abs(sine);
  const float bottom = 1.0F + std::abs(cosine);
  const bool wide = top > kAtanReach * bottom;
  const float x = wide ? (top - bottom) / (top + bottom) : top / bottom;
  const float z = x * x;
  const float* c = kAtanCoefficients;
  const float atan = x + x * z * (c[0] + z * (c[1] + z * (c[2] + z * c[3])));
  const float acute = 2.0F * (wide ? kQuarterPi + atan : atan);
  return std::copysign(cosine < 0.0F ? kPi - acute : acute, sine);
}

/// α − α0 [rad] the shorter way around, in [−π, π], for angles in [−π, π].
template <typename Scalar>
Scalar angleDifference(Scalar angle, Scalar restAngle) {
  constexpr auto kHalfTurn = Scalar(3.14159265358979324);
  const Scalar difference = angle - restAngle;
  return std::abs(difference) > kHalfTurn
             ? difference - std::copysign(Scalar(2) * kHalfTurn, difference)
             : difference;
}

}  // namespace bullet_ext
