#include "avatar/digitization/seen_skin.h"

#include "avatar/garment_binding.h"
#include "avatar/geometry/measures.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <numeric>

namespace avatar {
namespace {

std::vector<int> clothVertices(const std::vector<std::uint8_t>& labels) {
  std::vector<int> vertices;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (labels[v] != kSkinLabel)
      vertices.push_back(static_cast<int>(v));
  }
  return vertices;
}

TriangleMesh skinFaces(const OuterSurface& surface, const std::vector<std::uint8_t>& labels) {
  std::vector<Eigen::Index> faces;
  for (Eigen::Index f = 0; f < surface.mesh.numFaces(); ++f) {
    const auto corners = surface.mesh.faces.col(f);
    if (std::all_of(corners.begin(), corners.end(), [&](int v) {
          const auto i = static_cast<std::size_t>(v);
          return labels[i] == kSkinLabel && surface.seen[i];
        }))
      faces.push_back(f);
  }
  return {surface.mesh.vertices, surface.mesh.faces(Eigen::all, faces)};
}

/// V: fades out towards where the surface was seldom seen. There it is what reconstructions make
/// of the edge of what they know (dark hair has no depth), and sticks out or caves in.
Eigen::VectorXd evidence(const OuterSurface& surface, const std::vector<std::uint8_t>& labels) {
  std::vector<int> counts;
  std::vector<int> ofSkin;
  counts.reserve(labels.size());
  for (std::size_t v = 0; v < labels.size(); ++v) {
    const LabelCounts& seen = surface.labels[v];
    counts.push_back(std::accumulate(seen.begin(), seen.end(), 0));
    if (labels[v] == kSkinLabel && counts.back() > 0)
      ofSkin.push_back(counts.back());
  }
  if (ofSkin.empty())
    return Eigen::VectorXd::Zero(surface.mesh.numVertices());
  const auto middle = ofSkin.begin() + std::ssize(ofSkin) / 2;
  std::nth_element(ofSkin.begin(), middle, ofSkin.end());
  constexpr double kSeldom = 0.2;  // of the median
  std::vector<int> weak;
  for (std::size_t v = 0; v < counts.size(); ++v) {
    if (counts[v] < kSeldom * *middle)
      weak.push_back(static_cast<int>(v));
  }
  constexpr double kFade = 0.03;  // [m]
  return (edgeDistances(surface.mesh, weak) / kFade).cwiseMin(1.0);
}

}  // namespace

SeenSkin::SeenSkin(const OuterSurface& surface, const std::vector<std::uint8_t>& labels)
    : surface_(surface),
      part_(skinFaces(surface, labels)),
      bvh_(part_),
      fromCloth_(edgeDistances(surface.mesh, clothVertices(labels))),
      evidence_(evidence(surface, labels)) {}

SeenSkin::Match SeenSkin::nearest(
    const Eigen::Vector3d& point,
    const Eigen::Vector3d& normal,
    double reach,
    double minCosine) const {
  const ClosestPoint found = bvh_.closestPoint(point, reach);
  if (found.face < 0)
    return {};
  Match match;
  match.point = found.point;
  match.normal = doubleAreaVector(part_, found.face).stableNormalized();
  match.color = surface_.colors(Eigen::all, part_.faces.col(found.face)) * found.weights;
  match.evidence = evidence_(part_.faces.col(found.face)).dot(found.weights);
  match.found = match.evidence > 0.0 && match.normal.dot(normal) >= minCosine;
  constexpr double kMixed = 0.03;  // [m]: colours are means of what is near, and edges blur
  match.isPure = (fromCloth_(part_.faces.col(found.face)).array() > kMixed).all();
  return match;
}

}  // namespace avatar
