#include "avatar/default_body/primitives.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace avatar {
namespace {

double distance(const RoundCone& cone, const Eigen::Vector3d& point) {
  // Minimise D − radius(x) over the position x on the axis, D = hypot(along − x, radial): with the
  // taper sin φ = (ra − rb)/length that is x = along − radial·tan φ.
  const Eigen::Vector3d axis = cone.b - cone.a;
  const double length = axis.norm();
  const Eigen::Vector3d q = point - cone.a;
  if (length < 1e-12)
    return q.norm() - std::max(cone.radiusA, cone.radiusB);
  const double along = q.dot(axis) / length;
  const double radial = std::sqrt(std::max(0.0, q.squaredNorm() - along * along));
  const double sine = std::clamp((cone.radiusA - cone.radiusB) / length, -0.999, 0.999);
  const double cosine = std::sqrt(1.0 - sine * sine);
  const double t = std::clamp((along - radial * sine / cosine) / length, 0.0, 1.0);
  return (q - t * axis).norm() - (cone.radiusA + t * (cone.radiusB - cone.radiusA));
}

double distance(const Ellipsoid& ellipsoid, const Eigen::Vector3d& point) {
  const Eigen::Vector3d q = ellipsoid.axes.transpose() * (point - ellipsoid.center);
  const Eigen::Vector3d unit = q.cwiseQuotient(ellipsoid.radii);
  const double k = unit.norm();
  if (k < 1e-9)
    return -ellipsoid.radii.minCoeff();
  const double gradient = unit.cwiseQuotient(ellipsoid.radii).norm() / k;
  return (k - 1.0) / gradient;
}

/// Derivative of a monotone cubic through three neighbouring samples (Fritsch & Butland 1984).
double monotoneSlope(double h0, double h1, double d0, double d1) {
  if (d0 * d1 <= 0.0)
    return 0.0;
  const double w0 = 2.0 * h1 + h0;
  const double w1 = h1 + 2.0 * h0;
  return (w0 + w1) / (w0 / d0 + w1 / d1);
}

using SectionArray = std::array<double, 6>;

SectionArray toArray(const LoftSection& s) {
  return {s.uPlus, s.uMinus, s.vPlus, s.vMinus, s.uCenter, s.vCenter};
}

LoftSection interpolate(const std::vector<LoftSection>& sections, double position) {
  const std::size_t last = sections.size() - 1;
  std::size_t i = 0;
  while (i + 1 < last && position > sections[i + 1].position)
    ++i;
  const double h = sections[i + 1].position - sections[i].position;
  const double t = std::clamp((position - sections[i].position) / h, 0.0, 1.0);
  const SectionArray y0 = toArray(sections[i]);
  const SectionArray y1 = toArray(sections[i + 1]);
  const SectionArray before = toArray(sections[i > 0 ? i - 1 : 0]);
  const SectionArray after = toArray(sections[std::min(i + 2, last)]);
  const double hBefore = i > 0 ? sections[i].position - sections[i - 1].position : h;
  const double hAfter = i + 2 <= last ? sections[i + 2].position - sections[i + 1].position : h;
  SectionArray result{};
  for (std::size_t c = 0; c < result.size(); ++c) {
    const double d = (y1[c] - y0[c]) / h;
    const double m0 = i > 0 ? monotoneSlope(hBefore, h, (y0[c] - before[c]) / hBefore, d) : d;
    const double m1 = i + 2 <= last ? monotoneSlope(h, hAfter, d, (after[c] - y1[c]) / hAfter) : d;
    const double t2 = t * t;
    const double t3 = t2 * t;
    result[c] = (2 * t3 - 3 * t2 + 1) * y0[c] + (t3 - 2 * t2 + t) * h * m0 +
                (-2 * t3 + 3 * t2) * y1[c] + (t3 - t2) * h * m1;
  }
  return {position, result[0], result[1], result[2], result[3], result[4], result[5]};
}

struct SuperellipseValue {
  double value;   // (|a|ⁿ + |b|ⁿ)^(1/n): 1 on the superellipse
  double du, dv;  // its derivatives by |a| and |b|
};

SuperellipseValue superellipse(double a, double b, double n) {
  a = std::abs(a);
  b = std::abs(b);
  if (n == 2.0) {
    const double value = std::hypot(a, b);
    return value < 1e-9 ? SuperellipseValue{value, 1.0, 0.0}
                        : SuperellipseValue{value, a / value, b / value};
  }
  const double value = std::pow(std::pow(a, n) + std::pow(b, n), 1.0 / n);
  if (value < 1e-9)
    return {value, 1.0, 0.0};
  return {value, std::pow(a / value, n - 1.0), std::pow(b / value, n - 1.0)};
}

double distance(const Loft& loft, const Eigen::Vector3d& point) {
  const Eigen::Vector3d q = loft.axes.transpose() * (point - loft.origin);
  const double begin = loft.sections.front().position;
  const double end = loft.sections.back().position;
  const LoftSection s = interpolate(loft.sections, std::clamp(q.z(), begin, end));
  const double u = q.x() - s.uCenter;
  const double v = q.y() - s.vCenter;
  const double halfU = u > 0.0 ? s.uPlus : s.uMinus;
  const double halfV = v > 0.0 ? s.vPlus : s.vMinus;
  const SuperellipseValue section = superellipse(u / halfU, v / halfV, loft.exponent);
  const double overshoot =
      q.z() < begin ? (begin - q.z()) / loft.startCap : std::max(0.0, (q.z() - end) / loft.endCap);
  const double capLength = q.z() < begin ? loft.startCap : loft.endCap;
  const double k = std::hypot(section.value, overshoot);
  if (k < 1e-9)
    return -std::min(halfU, halfV);
  // |∇k|: the section's part by the chain rule, the cap's part along the axis.
  const double sectionGradient = std::hypot(section.du / halfU, section.dv / halfV);
  const double gradient =
      std::hypot(section.value / k * sectionGradient, overshoot / k / capLength);
  return (k - 1.0) / gradient;
}

double distance(const HalfSpace& halfSpace, const Eigen::Vector3d& point) {
  return halfSpace.normal.dot(point) - halfSpace.offset;
}

}  // namespace

double signedDistance(const Primitive& primitive, const Eigen::Vector3d& point) {
  return std::visit([&](const auto& p) { return distance(p, point); }, primitive);
}

double smoothMin(double a, double b, double radius) {
  const double overlap = radius - std::abs(a - b);
  const double nearest = std::min(a, b);
  return overlap > 0.0 ? nearest - overlap * overlap / (4.0 * radius) : nearest;
}

}  // namespace avatar
