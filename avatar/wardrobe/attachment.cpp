#include "avatar/wardrobe/attachment.h"

#include "avatar/garment_binding.h"
#include "avatar/geometry/adjacency.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace avatar {
namespace {

/// The highest opening: the waist of a skirt, the neckline of a shirt; ascending.
std::vector<int> topOpening(const TriangleMesh& mesh) {
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  std::vector<int> highest;
  double height = -std::numeric_limits<double>::infinity();
  for (std::vector<int>& loop : boundaryLoops(mesh.faces, adjacency)) {
    double sum = 0.0;
    for (const int v : loop)
      sum += mesh.vertices(1, v);
    const double mean = sum / static_cast<double>(loop.size());
    if (mean > height) {
      height = mean;
      highest = std::move(loop);
    }
  }
  std::sort(highest.begin(), highest.end());
  return highest;
}

/// Pieces that hang on nothing may get as far as the farthest vertex of those that do.
Eigen::VectorXd distancesFrom(const std::vector<int>& top, const MeshView& mesh) {
  Eigen::VectorXd distances = edgeDistances(mesh, top);
  double farthest = 0.0;
  for (const double distance : distances)
    farthest = std::isfinite(distance) ? std::max(farthest, distance) : farthest;
  return distances.cwiseMin(farthest);
}

}  // namespace

void attach(Garment& garment, const DressingBody& body, Fastening fastening) {
  garment.bindPose = body.pose;
  garment.skinningWeights = bindToBody(garment.mesh, body.mesh(), body.model->skinningWeights);
  const std::vector<int> top = topOpening(garment.mesh);
  garment.pins.clear();
  garment.maxDistance.resize(0);
  if (top.empty())
    return;                       // closed: nothing carries it
  constexpr double kSlip = 0.03;  // of a neckline, which nothing fastens [m]
  garment.maxDistance = distancesFrom(top, garment.mesh);
  if (fastening == Fastening::kPinned)
    garment.pins = top;
  else
    garment.maxDistance.array() += kSlip;
}

}  // namespace avatar
