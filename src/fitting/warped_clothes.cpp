#include "src/fitting/warped_clothes.h"

#include "avatar/avatar_pose.h"
#include "avatar/geometry/measures.h"

#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

using SkinningWeights = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Layers one after the other as one mesh.
class MergedLayers {
 public:
  void add(
      const Eigen::Matrix3Xd& vertices,
      const Eigen::Matrix3Xi& faces,
      const SkinningWeights& weights) {
    const Eigen::Index begin = mesh_.vertices.cols();
    const Eigen::Index firstFace = mesh_.faces.cols();
    mesh_.vertices.conservativeResize(3, begin + vertices.cols());
    mesh_.vertices.rightCols(vertices.cols()) = vertices;
    mesh_.faces.conservativeResize(3, firstFace + faces.cols());
    mesh_.faces.rightCols(faces.cols()) = faces.array() + static_cast<int>(begin);
    for (Eigen::Index v = 0; v < weights.rows(); ++v) {
      for (SkinningWeights::InnerIterator it(weights, v); it; ++it)
        weights_.emplace_back(static_cast<int>(begin + v), static_cast<int>(it.col()), it.value());
    }
  }

  const avatar::TriangleMesh& mesh() const { return mesh_; }

  const std::vector<Eigen::Triplet<double>>& weights() const { return weights_; }

 private:
  avatar::TriangleMesh mesh_;
  std::vector<Eigen::Triplet<double>> weights_;
};

}  // namespace

void WarpOptions::validate() const {
  graph.validate();
  view.validate();
  if (iterations < 1 || iterations > 100)
    throw std::invalid_argument("WarpOptions: iterations must be within [1, 100]");
}

WarpedClothes::WarpedClothes(
    const avatar::LayeredAvatar& avatar,
    const avatar::Camera& camera,
    const std::vector<PixelLabel>& labels,
    WarpedParts parts,
    const WarpOptions& options)
    : avatar_(avatar),
      camera_(camera),
      parts_(parts),
      options_(options),
      viewer_(camera, options.view) {
  options.validate();
  if (labels.size() != avatar.garments.size())
    throw std::invalid_argument("WarpedClothes: one label per garment is expected");
  Eigen::Index begin = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const Eigen::Index count = avatar.garments[i].mesh.numVertices();
    if (parts == WarpedParts::kGarments) {
      garments_.push_back({i, 0, count});
      surfaces_.push_back(surfaceOf(avatar.garments[i], labels[i]));
    } else {
      garments_.push_back({0, begin, count});
      begin += count;
    }
  }
  if (parts == WarpedParts::kWholePerson && !garments_.empty())
    surfaces_.push_back(wholePerson());
}

WarpedClothes::Surface WarpedClothes::surfaceOf(
    const avatar::Garment& garment, PixelLabel label) const {
  return {
      .bound = garment.mesh,
      .skinningWeights = garment.skinningWeights,
      .bindPose = garment.bindPose,
      .label = label,
      .nodes = avatar::EmbeddedDeformation(garment.mesh.vertices, options_.graph)};
}

/// All layers in the bind pose of the first garment; garments before the body.
WarpedClothes::Surface WarpedClothes::wholePerson() const {
  const avatar::BodyPose& bindPose = avatar_.garments.front().bindPose;
  MergedLayers layers;
  for (const avatar::Garment& garment : avatar_.garments)
    layers.add(
        avatar::posedVertices(garment, avatar_.body, bindPose),
        garment.mesh.faces,
        garment.skinningWeights);
  const avatar::AvatarBody& body = avatar_.body;
  layers.add(avatar::posedVertices(body, bindPose), body.mesh.faces, body.skinningWeights);
  Surface person{
      .bound = layers.mesh(),
      .skinningWeights = {},
      .bindPose = bindPose,
      .nodes = avatar::EmbeddedDeformation(layers.mesh().vertices, options_.graph)};
  person.skinningWeights.resize(layers.mesh().numVertices(), body.skinningWeights.cols());
  person.skinningWeights.setFromTriplets(layers.weights().begin(), layers.weights().end());
  return person;
}

void WarpedClothes::Surface::pose() {
  vertices = nodes.vertices();
  for (Eigen::Index v = 0; v < vertices.cols(); ++v)
    vertices.col(v) =
        posedFromBound[static_cast<std::size_t>(v)] * Eigen::Vector3d(vertices.col(v));
}

/// Point to plane with the surface's own normals n. With y the deformed and M y + t the skinned
/// vertex, n · (M y + t − p) = (Mᵀ n) · y − n · (p − t).
std::vector<avatar::PlaneTarget> WarpedClothes::Surface::planes(
    const GarmentTargets& targets) const {
  const Eigen::Matrix3Xd normals = avatar::vertexNormals({vertices, bound.faces});
  std::vector<avatar::PlaneTarget> planes;
  planes.reserve(targets.targets.size());
  for (const bullet_ext::DepthTarget& target : targets.targets) {
    const Eigen::Affine3d& skinning = posedFromBound[static_cast<std::size_t>(target.vertex)];
    const Eigen::Vector3d normal = normals.col(target.vertex);
    const Eigen::Vector3d point = (target.points * target.weights).cast<double>();
    planes.push_back(
        {.vertex = target.vertex,
         .direction = skinning.linear().transpose() * normal,
         .offset = normal.dot(point - skinning.translation()),
         .weight = static_cast<double>(target.blend)});
  }
  return planes;
}

void WarpedClothes::follow(const avatar::BodyPose& pose) {
  for (Surface& surface : surfaces_) {
    surface.posedFromBound =
        avatar::vertexTransforms(surface.skinningWeights, avatar_.body, surface.bindPose, pose);
    surface.pose();
  }
}

std::vector<GarmentTargets> WarpedClothes::targets(
    const std::vector<GarmentView>& views,
    const DepthCloud& cloud,
    const DepthTargetOptions& options) const {
  std::vector<GarmentTargets> targets;
  targets.reserve(surfaces_.size());
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    const avatar::MeshView mesh(surfaces_[i].vertices, surfaces_[i].bound.faces);
    targets.push_back(depthTargets(
        {.mesh = mesh, .view = views[i], .label = surfaces_[i].label}, camera_, cloud, options));
  }
  return targets;
}

GarmentTargets WarpedClothes::ofPart(
    const Part& part, const std::vector<GarmentTargets>& targets) const {
  const GarmentTargets& all = targets[part.surface];
  GarmentTargets result;
  if (part.begin == 0)
    result.rejected = all.rejected;
  for (std::size_t i = 0; i < all.targets.size(); ++i) {
    bullet_ext::DepthTarget target = all.targets[i];
    if (target.vertex < part.begin || target.vertex >= part.begin + part.count)
      continue;
    target.vertex -= static_cast<int>(part.begin);
    result.targets.push_back(target);
    result.residuals.push_back(all.residuals[i]);
  }
  return result;
}

std::vector<GarmentTargets> WarpedClothes::fit(
    const avatar::MeshView& body, const DepthCloud& cloud, const DepthTargetOptions& options) {
  const avatar::TriangleMesh nothing;
  std::vector<avatar::MeshView> meshes;
  meshes.reserve(surfaces_.size());
  for (const Surface& surface : surfaces_)
    meshes.emplace_back(surface.vertices, surface.bound.faces);
  const std::vector<GarmentView> views =
      viewer_(parts_ == WarpedParts::kGarments ? body : avatar::MeshView(nothing), meshes);
  std::vector<GarmentTargets> found = targets(views, cloud, options);
  for (int iteration = 0; iteration < options_.iterations; ++iteration) {
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
      surfaces_[i].nodes.step(surfaces_[i].planes(found[i]));
      surfaces_[i].pose();
    }
    found = targets(views, cloud, options);
  }
  std::vector<GarmentTargets> result;
  result.reserve(garments_.size());
  for (const Part& part : garments_)
    result.push_back(ofPart(part, found));
  return result;
}

Eigen::Matrix3Xd WarpedClothes::garment(std::size_t index) const {
  const Part& part = garments_.at(index);
  return surfaces_[part.surface].vertices.middleCols(part.begin, part.count);
}

std::vector<Eigen::MatrixXd> WarpedClothes::state() const {
  std::vector<Eigen::MatrixXd> state;
  state.reserve(surfaces_.size());
  for (const Surface& surface : surfaces_) {
    Eigen::MatrixXd& motions = state.emplace_back(12, surface.nodes.numNodes());
    for (int node = 0; node < surface.nodes.numNodes(); ++node)
      motions.col(node) =
          surface.nodes.motions()[static_cast<std::size_t>(node)].matrix().topRows<3>().reshaped();
  }
  return state;
}

void WarpedClothes::restore(const std::vector<Eigen::MatrixXd>& state) {
  if (state.size() != surfaces_.size())
    throw std::invalid_argument("WarpedClothes: the state is of other surfaces");
  for (std::size_t i = 0; i < state.size(); ++i) {
    if (state[i].rows() != 12)
      throw std::invalid_argument("WarpedClothes: a node has twelve values");
    std::vector<Eigen::Isometry3d> motions;
    motions.reserve(static_cast<std::size_t>(state[i].cols()));
    for (const auto& column : state[i].colwise()) {
      Eigen::Isometry3d& motion = motions.emplace_back(Eigen::Isometry3d::Identity());
      motion.matrix().topRows<3>() = column.reshaped(3, 4);
    }
    surfaces_[i].nodes.setMotions(motions);
  }
}

}  // namespace simulcap
