#include "avatar/default_body/body_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace avatar {
namespace {

Eigen::Vector3d mirror(const Eigen::Vector3d& point) {
  return {-point.x(), point.y(), point.z()};
}

double combine(double before, double next, const FieldElement& element) {
  switch (element.operation) {
    case FieldOperation::kUnion:
      return smoothMin(before, next, element.blendRadius);
    case FieldOperation::kSubtract:
      return -smoothMin(-before, next, element.blendRadius);
    case FieldOperation::kIntersect:
      return -smoothMin(-before, -next, element.blendRadius);
  }
  return before;
}

bool isOffCentre(const Primitive& primitive) {
  if (const auto* cone = std::get_if<RoundCone>(&primitive)) {
    return cone->a.x() != 0.0 || cone->b.x() != 0.0;
  }
  const auto* ellipsoid = std::get_if<Ellipsoid>(&primitive);
  return ellipsoid != nullptr && ellipsoid->center.x() != 0.0;
}

}  // namespace

BodyField::BodyField(std::vector<FieldGroup> groups, const JointPositions& joints)
    : groups_(std::move(groups)), joints_(joints) {}

double BodyField::distance(const Eigen::Vector3d& point) const {
  return evaluate(point, nullptr);
}

double BodyField::distance(
    const Eigen::Vector3d& point, const BoneTransforms& restFromPosed) const {
  return evaluate(point, &restFromPosed);
}

int BodyField::dominantBone(const Eigen::Vector3d& point) const {
  int bone = kPelvis;
  double nearest = std::numeric_limits<double>::max();
  const auto consider = [&](const FieldElement& element) {
    const double distance = signedDistance(element.primitive, point);
    if (element.operation != FieldOperation::kUnion || distance >= nearest)
      return;
    nearest = distance;
    bone = element.bone;
  };
  for (const FieldGroup& group : groups_) {
    std::for_each(group.elements.begin(), group.elements.end(), consider);
  }
  return bone;
}

// One side (or the midline) of a group: its elements in order, each in its bone's rest frame.
double BodyField::sideDistance(
    const FieldGroup& group,
    const Eigen::Vector3d& point,
    const BoneTransforms* restFromPosed) const {
  double result = std::numeric_limits<double>::max();
  for (const FieldElement& element : group.elements) {
    const Eigen::Vector3d atRest =
        restFromPosed == nullptr ? point : (*restFromPosed)[element.bone] * point;
    double next = signedDistance(element.primitive, atRest);
    if (!group.isPaired && isOffCentre(element.primitive)) {
      next = smoothMin(next, signedDistance(element.primitive, mirror(point)), element.blendRadius);
    }
    result = combine(result, next, element);
  }
  return result;
}

double BodyField::evaluate(
    const Eigen::Vector3d& point, const BoneTransforms* restFromPosed) const {
  // Where the two sides of a pair meet they have a crease of their own: thighs must not grow
  // together.
  constexpr double kMidlineBlend = 0.008;
  double result = std::numeric_limits<double>::max();
  const auto isFar = [&](const FieldGroup& group, const Eigen::Vector3d& at) {
    return (at - group.boundCenter).norm() - group.boundRadius > result + group.blendRadius;
  };
  for (const FieldGroup& group : groups_) {
    const Eigen::Vector3d other = mirror(point);
    double next = std::numeric_limits<double>::max();
    if (restFromPosed != nullptr || !isFar(group, point)) {
      next = sideDistance(group, point, restFromPosed);
    }
    if (group.isPaired && !isFar(group, other)) {
      next = smoothMin(next, sideDistance(group, other, nullptr), kMidlineBlend);
    }
    result = smoothMin(result, next, group.blendRadius);
  }
  return result;
}

}  // namespace avatar
