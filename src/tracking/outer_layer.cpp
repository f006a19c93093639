#include "src/tracking/outer_layer.h"

#include "avatar/avatar_pose.h"
#include "avatar/garment_openings.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"
#include "avatar/hanging_cloth.h"
#include "src/tracking/cloth_shapes.h"

#include <algorithm>
#include <array>

namespace simulcap {
namespace {

/// The faces whose corners are all marked.
Eigen::Matrix3Xi facesOf(const avatar::TriangleMesh& mesh, const std::vector<bool>& marked) {
  Eigen::Matrix3Xi faces(3, mesh.numFaces());
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    const Eigen::Vector3i corners = mesh.faces.col(f);
    if (std::all_of(corners.begin(), corners.end(), [&](int v) {
          return marked[static_cast<std::size_t>(v)];
        }))
      faces.col(count++) = corners;
  }
  return faces.leftCols(count);
}

/// The cloth and the skin that has it before it.
avatar::TriangleBvh clothAndCovered(
    const OuterLayer& layer, const avatar::TriangleMesh& body, const std::vector<bool>& covered) {
  const Eigen::Matrix3Xi under = facesOf(body, covered);
  Eigen::Matrix3Xd vertices(3, layer.restVertices.cols() + body.numVertices());
  vertices << layer.restVertices, body.vertices;
  Eigen::Matrix3Xi faces(3, layer.faces.cols() + under.cols());
  faces << layer.faces, (under.array() + static_cast<int>(layer.restVertices.cols())).matrix();
  return avatar::TriangleBvh({vertices, faces});
}

/// 0 where the skin has cloth before it, 1 where it hasn't, in between where cloth or what has it
/// before it is so near that it may have slipped over: from under a wide hem the cloth is far.
Eigen::VectorXd barenessOf(const avatar::TriangleMesh& body, const OuterLayer& layer) {
  if (layer.faces.cols() == 0)
    return Eigen::VectorXd::Ones(body.numVertices());
  constexpr double kFarthest = 0.2;  // cloth farther away covers something else [m]
  constexpr double kSlip = 0.04;     // [m]
  const Eigen::Matrix3Xd normals = avatar::vertexNormals(body);
  const avatar::TriangleBvh cloth({layer.restVertices, layer.faces});
  std::vector<bool> covered;
  for (Eigen::Index v = 0; v < body.numVertices(); ++v)
    covered.push_back(cloth.anyHit(
        {.origin = body.vertices.col(v), .direction = normals.col(v), .tMax = kFarthest}));
  const avatar::TriangleBvh near = clothAndCovered(layer, body, covered);
  Eigen::VectorXd bareness(body.numVertices());
  for (Eigen::Index v = 0; v < bareness.size(); ++v) {
    const Eigen::Vector3d point = body.vertices.col(v);
    const double distance = (near.closestPoint(point).point - point).norm();
    bareness[v] = covered[static_cast<std::size_t>(v)] ? 0.0 : std::min(1.0, distance / kSlip);
  }
  return bareness;
}

/// Does a hem of the garment go round both legs? Not known where faces don't agree on their edges.
bool coversLegsTogether(const avatar::Garment& garment, const avatar::AvatarBody& body) {
  const avatar::TriangleMesh& mesh = garment.mesh;
  const avatar::Topology shape = avatar::topology(mesh.faces, mesh.numVertices());
  if (!shape.edgeManifold || !shape.oriented)
    return false;
  Eigen::Matrix3Xd joints(3, body.joints.cols());
  Eigen::Index j = 0;
  for (const Eigen::Isometry3d& frame : avatar::worldFromJoints(body, garment.bindPose))
    joints.col(j++) = frame.translation();
  const auto passes = [](const avatar::GarmentOpening& opening, int joint) {
    return std::binary_search(opening.joints.begin(), opening.joints.end(), joint);
  };
  constexpr std::array<std::array<int, 2>, 2> kPairs = {
      {{avatar::kLeftKnee, avatar::kRightKnee}, {avatar::kLeftAnkle, avatar::kRightAnkle}}};
  for (const avatar::GarmentOpening& opening : avatar::garmentOpenings(mesh, joints, body.parents))
    for (const auto& [left, right] : kPairs)
      if (passes(opening, left) && passes(opening, right))
        return true;
  return false;
}

/// Per vertex, of the legs' share of it, how much hangs.
Eigen::VectorXd hangingShares(const avatar::Garment& garment, const avatar::AvatarBody& body) {
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(garment.mesh.numVertices());
  if (!coversLegsTogether(garment, body))
    return shares;
  const Eigen::Matrix3Xd skin = avatar::posedVertices(body, garment.bindPose);
  const avatar::TriangleBvh bvh({skin, body.mesh.faces});
  for (Eigen::Index v = 0; v < shares.size(); ++v) {
    const Eigen::Vector3d vertex = garment.mesh.vertices.col(v);
    shares[v] = avatar::hangingShare((bvh.closestPoint(vertex).point - vertex).norm());
  }
  return shares;
}

using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// V × (J + 1).
SkinningWeights layerWeights(const avatar::Garment& garment, const avatar::AvatarBody& body) {
  const SkinningWeights& from = garment.skinningWeights;
  const Eigen::VectorXd shares = hangingShares(garment, body);
  SkinningWeights result(from.rows(), from.cols() + 1);
  for (Eigen::Index v = 0; v < from.rows(); ++v) {
    result.startVec(v);
    double hanging = 0.0;
    for (SkinningWeights::InnerIterator it(from, v); it; ++it) {
      const double hung =
          avatar::isOfLeg(static_cast<int>(it.col())) ? shares[v] * it.value() : 0.0;
      hanging += hung;
      if (it.value() > hung)
        result.insertBack(v, it.col()) = it.value() - hung;
    }
    if (hanging > 0.0)
      result.insertBack(v, from.cols()) = hanging;
  }
  result.finalize();
  return result;
}

/// J + 1 transforms from rest to a pose.
std::vector<Eigen::Isometry3d> posedFromRest(
    const avatar::AvatarBody& body, const avatar::BodyPose& pose) {
  std::vector<Eigen::Isometry3d> transforms = avatar::worldFromJoints(body, pose);
  const Eigen::Vector3d hips = transforms[avatar::kPelvis].translation();
  for (std::size_t j = 0; j < transforms.size(); ++j)
    transforms[j] =
        transforms[j] * Eigen::Translation3d(-body.joints.col(static_cast<Eigen::Index>(j)));
  transforms.push_back(avatar::plumbFromRest(body.joints.col(avatar::kPelvis), hips, pose));
  return transforms;
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
  layer.skinningWeights.resize(numVertices, std::ssize(avatar.body.parents) + 1);
  layer.looseness.resize(numVertices);
  Eigen::Index vertex = 0;
  Eigen::Index face = 0;
  for (const avatar::Garment& garment : avatar.garments) {
    const Eigen::Index count = garment.mesh.numVertices();
    const SkinningWeights own = layerWeights(garment, avatar.body);
    const Eigen::Matrix3Xd rest =
        avatar::unblended(own, posedFromRest(avatar.body, garment.bindPose), garment.mesh.vertices);
    layer.restVertices.middleCols(vertex, count) = rest;
    layer.looseness.segment(vertex, count) = clothLooseness(rest, own, avatar.body.mesh);
    layer.faces.middleCols(face, garment.mesh.numFaces()) =
        garment.mesh.faces.array() + static_cast<int>(vertex);
    for (Eigen::Index v = 0; v < count; ++v) {
      layer.skinningWeights.startVec(vertex + v);
      for (SkinningWeights::InnerIterator it(own, v); it; ++it)
        layer.skinningWeights.insertBack(vertex + v, it.col()) = it.value();
    }
    vertex += count;
    face += garment.mesh.numFaces();
  }
  layer.skinningWeights.finalize();
  layer.bareness = barenessOf(avatar.body.mesh, layer);
  return layer;
}

}  // namespace simulcap
