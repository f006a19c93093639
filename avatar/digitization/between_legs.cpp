#include "avatar/digitization/between_legs.h"

#include <cstddef>
#include <vector>

namespace avatar {
namespace {

TriangleBvh skinOf(BodyRegion region, const DressingBody& body) {
  const std::vector<int>& faces = body.regionFaces[static_cast<std::size_t>(region)];
  return TriangleBvh(TriangleMesh{body.vertices, body.model->faces(Eigen::all, faces)});
}

}  // namespace

BetweenLegs::BetweenLegs(const DressingBody& body)
    : legs_{skinOf(BodyRegion::kLeftLeg, body), skinOf(BodyRegion::kRightLeg, body)} {}

bool BetweenLegs::contains(const Eigen::Vector3d& point) const {
  constexpr double kReach = 0.15;     // farther from a thigh, clothes don't hang between them [m]
  constexpr double kOpposite = -0.5;  // cosine: by 120° or more
  std::array<Eigen::Vector3d, 2> toSkin;
  for (std::size_t leg = 0; leg < 2; ++leg) {
    const ClosestPoint nearest = legs_[leg].closestPoint(point, kReach);
    if (nearest.face < 0)
      return false;
    toSkin[leg] = (nearest.point - point).normalized();
  }
  return toSkin[0].dot(toSkin[1]) < kOpposite;
}

}  // namespace avatar
