#include "src/tracking/outer_layer.h"

#include "avatar/avatar_pose.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"

#include <algorithm>

namespace simulcap {
namespace {

/// 0 where the skin has cloth before it, 1 where it hasn't, in between where the cloth's edge is so
/// near that it may have slipped over.
Eigen::VectorXd barenessOf(const avatar::TriangleMesh& body, const OuterLayer& layer) {
  if (layer.faces.cols() == 0)
    return Eigen::VectorXd::Ones(body.numVertices());
  constexpr double kFarthest = 0.2;  // cloth farther away covers something else [m]
  constexpr double kSlip = 0.04;     // [m]
  const Eigen::Matrix3Xd normals = avatar::vertexNormals(body);
  const avatar::TriangleBvh cloth({layer.restVertices, layer.faces});
  Eigen::VectorXd bareness(body.numVertices());
  for (Eigen::Index v = 0; v < bareness.size(); ++v) {
    const Eigen::Vector3d point = body.vertices.col(v);
    const bool covered =
        cloth.anyHit({.origin = point, .direction = normals.col(v), .tMax = kFarthest});
    bareness[v] =
        covered ? 0.0 : std::min(1.0, (cloth.closestPoint(point).point - point).norm() / kSlip);
  }
  return bareness;
}

}  // namespace

OuterLayer outerLayer(const avatar::LayeredAvatar& avatar) {
  Eigen::Index numVertices = 0;
  Eigen::Index numFaces = 0;
  for (const avatar::Garment& garment : avatar.garments) {
    numVertices += garment.mesh.numVertices();
    numFaces += garment.mesh.numFaces();
  }
  OuterLayer layer;
  layer.restVertices.resize(3, numVertices);
  layer.faces.resize(3, numFaces);
  std::vector<Eigen::Triplet<double>> weights;
  Eigen::Index vertex = 0;
  Eigen::Index face = 0;
  for (const avatar::Garment& garment : avatar.garments) {
    const Eigen::Index count = garment.mesh.numVertices();
    layer.restVertices.middleCols(vertex, count) = avatar::unposedVertices(garment, avatar.body);
    layer.faces.middleCols(face, garment.mesh.numFaces()) =
        garment.mesh.faces.array() + static_cast<int>(vertex);
    for (Eigen::Index v = 0; v < count; ++v)
      for (decltype(layer.skinningWeights)::InnerIterator it(garment.skinningWeights, v); it; ++it)
        weights.emplace_back(static_cast<int>(vertex + v), static_cast<int>(it.col()), it.value());
    vertex += count;
    face += garment.mesh.numFaces();
  }
  layer.skinningWeights.resize(numVertices, static_cast<Eigen::Index>(avatar.body.parents.size()));
  layer.skinningWeights.setFromTriplets(weights.begin(), weights.end());
  layer.skinningWeights.makeCompressed();
  layer.bareness = barenessOf(avatar.body.mesh, layer);
  return layer;
}

}  // namespace simulcap
