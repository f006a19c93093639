#include "avatar/garment_openings.h"

#include "avatar/geometry/adjacency.h"

#include <Eigen/Geometry>

#include <cstddef>

namespace avatar {
namespace {

Eigen::Vector3d loopCentre(const Eigen::Matrix3Xd& vertices, const std::vector<int>& loop) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int v : loop)
    sum += vertices.col(v);
  return sum / static_cast<double>(loop.size());
}

/// ±1 when the segment crosses the triangle along or against its normal, else 0: signs of the
/// volumes of five tetrahedra.
int crossing(
    const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Matrix3d& corners) {
  const auto side = [](const Eigen::Vector3d& a, const Eigen::Matrix3d& p) {
    return (p.col(1) - p.col(0)).cross(p.col(2) - p.col(0)).dot(a - p.col(0)) >= 0.0;
  };
  const bool start = side(from, corners);
  if (start == side(to, corners))
    return 0;
  int left = 0;
  for (int k = 0; k < 3; ++k) {
    Eigen::Matrix3d wall;
    wall << from, corners.col(k), corners.col((k + 1) % 3);
    left += side(to, wall) ? 1 : 0;
  }
  if (left != 0 && left != 3)
    return 0;
  return start ? -1 : 1;
}

/// How often a bone goes through a loop, by its sign.
int crossings(
    const Eigen::Vector3d& from,
    const Eigen::Vector3d& to,
    const Eigen::Matrix3Xd& vertices,
    const std::vector<int>& loop) {
  const Eigen::Vector3d centre = loopCentre(vertices, loop);
  int count = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    Eigen::Matrix3d corners;
    corners << centre, vertices.col(loop[i]), vertices.col(loop[(i + 1) % loop.size()]);
    count += crossing(from, to, corners);
  }
  return count;
}

}  // namespace

std::vector<GarmentOpening> garmentOpenings(
    const MeshView& garment, const Eigen::Matrix3Xd& joints, const std::vector<int>& parents) {
  std::vector<GarmentOpening> openings;
  const Adjacency adjacency = buildAdjacency(garment.faces, garment.numVertices());
  for (std::vector<int>& loop : boundaryLoops(garment.faces, adjacency)) {
    GarmentOpening opening{.loop = std::move(loop)};
    opening.meanHeight = loopCentre(garment.vertices, opening.loop).y();
    for (std::size_t i = 0; i < opening.loop.size(); ++i)
      opening.length += (garment.vertices.col(opening.loop[i]) -
                         garment.vertices.col(opening.loop[(i + 1) % opening.loop.size()]))
                            .norm();
    for (int joint = 1; joint < static_cast<int>(parents.size()); ++joint) {
      const int parent = parents[static_cast<std::size_t>(joint)];
      if (crossings(joints.col(parent), joints.col(joint), garment.vertices, opening.loop) != 0)
        opening.joints.push_back(joint);
    }
    openings.push_back(std::move(opening));
  }
  return openings;
}

ClosedHoles closeHoles(
    const TriangleMesh& garment, const std::vector<GarmentOpening>& openings, double maxLength) {
  ClosedHoles result{.mesh = garment};
  for (const GarmentOpening& opening : openings) {
    if (!opening.isHole() || opening.length > maxLength)
      continue;
    TriangleMesh& mesh = result.mesh;
    const auto centre = static_cast<int>(mesh.numVertices());
    const Eigen::Index firstFace = mesh.numFaces();
    const std::size_t count = opening.loop.size();
    mesh.vertices.conservativeResize(Eigen::NoChange, centre + 1);
    mesh.vertices.col(centre) = loopCentre(garment.vertices, opening.loop);
    mesh.faces.conservativeResize(Eigen::NoChange, firstFace + static_cast<Eigen::Index>(count));
    for (std::size_t i = 0; i < count; ++i)
      mesh.faces.col(firstFace + static_cast<Eigen::Index>(i)) << opening.loop[(i + 1) % count],
          opening.loop[i], centre;
    ++result.count;
  }
  return result;
}

}  // namespace avatar
