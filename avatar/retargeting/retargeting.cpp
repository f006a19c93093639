#include "avatar/retargeting/retargeting.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/garment_binding.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/retargeting/edge_equations.h"
#include "avatar/retargeting/size_keeping_fit.h"
#include "avatar/retargeting/surface_registration.h"
#include "avatar/wardrobe/dressing_body.h"
#include "avatar/wardrobe/layers_below.h"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

PosedBody posed(const AvatarBody& body, const BodyPose& pose) {
  PosedBody result{posedVertices(body, pose), Eigen::Matrix3Xd(3, body.joints.cols())};
  const std::vector<Eigen::Isometry3d> joints = worldFromJoints(body, pose);
  for (std::size_t j = 0; j < joints.size(); ++j)
    result.joints.col(static_cast<Eigen::Index>(j)) = joints[j].translation();
  return result;
}

bool haveSameFaces(const TriangleMesh& a, const TriangleMesh& b) {
  return a.numVertices() == b.numVertices() && a.numFaces() == b.numFaces() && a.faces == b.faces;
}

/// How a garment's vertices lie over the skin.
struct SkinContact {
  Eigen::Matrix3Xd displacement;  // 3 × V [m]: of the skin nearest to each vertex
  Eigen::VectorXd distance;       // V [m], negative inside
};

SkinContact skinUnder(
    const Eigen::Matrix3Xd& vertices, const MeshView& skin, const Eigen::Matrix3Xd& displacement) {
  const SignedDistance surface(skin);
  SkinContact contact{Eigen::Matrix3Xd(3, vertices.cols()), Eigen::VectorXd(vertices.cols())};
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    const SignedDistanceResult nearest = surface(vertices.col(v));
    contact.distance[v] = nearest.distance;
    contact.displacement.col(v).setZero();
    for (int corner = 0; corner < 3; ++corner)
      contact.displacement.col(v) += nearest.closest.weights[corner] *
                                     displacement.col(skin.faces(corner, nearest.closest.face));
  }
  return contact;
}

/// The displacement u of a garment that minimises
///   Σ_i (h/ℓ_i)² |u_i − s_i|² + Σ_edges |u_i − u_j|²,
/// s the skin's under it, h the mean edge length: what is shorter than ℓ_i, which grows with the
/// distance from the skin, is averaged out. Cloth that hangs between two limbs follows both.
Eigen::Matrix3Xd gradedDisplacement(
    const SkinContact& contact, const Adjacency& adjacency, double edgeLength) {
  constexpr double kOnSkin = 0.01;  // ℓ of cloth that lies on the skin [m]
  const Eigen::Index count = contact.distance.size();
  Eigen::VectorXd weights(count);
  for (Eigen::Index v = 0; v < count; ++v) {
    const double length = kOnSkin + std::max(0.0, contact.distance[v]);
    weights[v] = std::pow(edgeLength / length, 2);
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(
      pulledLaplacian(weights, adjacency));
  const Eigen::MatrixXd pulls = (contact.displacement * weights.asDiagonal()).transpose();
  return factors.solve(pulls).transpose();
}

/// The garments worn so far as they follow the body into a pose.
std::vector<Garment> wornIn(const LayeredAvatar& avatar, const BodyPose& pose) {
  std::vector<Garment> worn = avatar.garments;
  for (Garment& garment : worn) {
    garment.mesh.vertices = posedVertices(garment, avatar.body, pose);
    garment.bindPose = pose;
  }
  return worn;
}

/// Mean and 95th percentile of how far a garment's distances from the skin have changed.
void measureEase(RetargetedGarment& report, Eigen::VectorXd changes) {
  if (changes.size() == 0)
    return;
  report.meanEaseChange = changes.mean();
  const Eigen::Index rank = (changes.size() - 1) * 95 / 100;
  std::nth_element(changes.begin(), changes.begin() + rank, changes.end());
  report.p95EaseChange = changes[rank];
}

class Retargeter {
 public:
  Retargeter(
      const LayeredAvatar& source,
      const BodyModel& model,
      const Eigen::VectorXd& betas,
      GarmentSize size)
      : source_(source), model_(model), betas_(betas), size_(size) {
    result_.avatar.body = makeAvatarBody(model, betas);
    const AvatarBody& target = result_.avatar.body;
    if (source.body.joints.cols() != target.joints.cols())
      throw std::invalid_argument(
          "retargeting: the avatar's skeleton has " + std::to_string(source.body.joints.cols()) +
          " joints, the other body's " + std::to_string(target.joints.cols()));
    result_.sameTopology = haveSameFaces(source.body.mesh, target.mesh);
  }

  void putOn(const Garment& garment) {
    const PosedBody from = posed(source_.body, garment.bindPose);
    const Eigen::Matrix3Xd to = correspondence(from, garment.bindPose);
    const Adjacency adjacency = buildAdjacency(garment.mesh.faces, garment.mesh.numVertices());
    const double edgeLength = meanEdgeLength(garment.mesh.vertices, adjacency);
    const SkinContact contact = skinUnder(
        garment.mesh.vertices, {from.vertices, source_.body.mesh.faces}, to - from.vertices);
    Eigen::Matrix3Xd fitted =
        garment.mesh.vertices + gradedDisplacement(contact, adjacency, edgeLength);
    if (size_ == GarmentSize::kKept)
      fitted = sizeKeepingFit(garment.mesh.vertices, adjacency, fitted);

    const DressingBody body = standForDressing(model_, betas_, garment.bindPose);
    const ClearanceResult clear =
        LayersBelow(body.mesh(), wornIn(result_.avatar, garment.bindPose))
            .cleared({fitted, garment.mesh.faces}, garment.cloth.thickness);
    Garment worn = garment;
    worn.mesh.vertices = roundedToFloat(clear.vertices);
    worn.skinningWeights = bindToBody(worn.mesh, body.mesh(), model_.skinningWeights);
    worn.maxDistance *= meanEdgeLength(worn.mesh.vertices, adjacency) / edgeLength;
    report(worn, contact, body.mesh(), clear);
    result_.garments.back().p95EdgeChange =
        p95EdgeChange(garment.mesh.vertices, worn.mesh.vertices, adjacency);
    result_.avatar.garments.push_back(std::move(worn));
  }

  RetargetedAvatar take() { return std::move(result_); }

 private:
  /// Where each vertex of the source's skin goes on the target's, in a pose.
  Eigen::Matrix3Xd correspondence(const PosedBody& from, const BodyPose& pose) {
    const AvatarBody& target = result_.avatar.body;
    const PosedBody to = posed(target, pose);
    if (result_.sameTopology)
      return to.vertices;
    const TriangleMesh start{
        movedWithJoints(source_.body, from, to.joints), source_.body.mesh.faces};
    const MeshView surface(to.vertices, target.mesh.faces);
    Eigen::Matrix3Xd registered = registerSurfaces(start, surface);
    result_.registration = symmetricSurfaceDistance({registered, source_.body.mesh.faces}, surface);
    return registered;
  }

  void report(
      const Garment& worn,
      const SkinContact& before,
      const MeshView& skin,
      const ClearanceResult& clear) {
    RetargetedGarment garment{.name = worn.name};
    garment.movedVertices = clear.movedVertices;
    garment.verticesBelow = clear.verticesBelow;
    const SignedDistance surface(skin);
    Eigen::VectorXd changes(before.distance.size());
    for (Eigen::Index v = 0; v < changes.size(); ++v)
      changes[v] = std::abs(surface(worn.mesh.vertices.col(v)).distance - before.distance[v]);
    measureEase(garment, std::move(changes));
    result_.garments.push_back(std::move(garment));
  }

  const LayeredAvatar& source_;
  const BodyModel& model_;
  const Eigen::VectorXd& betas_;
  GarmentSize size_;
  RetargetedAvatar result_;
};

}  // namespace

RetargetedAvatar retargeted(
    const LayeredAvatar& source,
    const BodyModel& model,
    const Eigen::VectorXd& betas,
    GarmentSize size) {
  Retargeter retargeter(source, model, betas, size);
  for (const Garment& garment : source.garments)
    retargeter.putOn(garment);
  return retargeter.take();
}

}  // namespace avatar
