#pragma once

#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/measures.h"
#include "avatar/skeleton.h"
#include "avatar/skinning.h"
#include "src/tracking/body_tracker.h"
#include "src/tracking/cloth_shapes.h"

#include <cmath>
#include <functional>
#include <vector>

/// People dressed in their own skin, moved outwards.
namespace simulcap::test {

using Region = std::function<bool(const Eigen::Vector3d&)>;

inline Eigen::Matrix3Xd restJoints() {
  const auto& model = avatar::defaultBody();
  return avatar::posedBody(model, Eigen::VectorXd::Zero(model.numBetas()), {}).joints;
}

/// Hands, feet and head are bare.
inline bool isUnderShirtOrTrousers(const Eigen::Vector3d& at) {
  static const Eigen::Matrix3Xd kJoints = restJoints();
  return at.y() < kJoints(1, avatar::kNeck) && at.y() > kJoints(1, avatar::kLeftAnkle) + 0.08 &&
         std::abs(at.x()) < kJoints(0, avatar::kLeftWrist);
}

inline Eigen::Matrix3Xd restNormals() {
  const auto& model = avatar::defaultBody();
  return avatar::vertexNormals({model.templateVertices, model.faces});
}

/// The default body under cloth that stands off by `gap` [m] where it is covered.
inline avatar::BodyModel clothed(double gap, const Region& covered) {
  avatar::BodyModel dressed = avatar::defaultBody();
  const Eigen::Matrix3Xd& skin = avatar::defaultBody().templateVertices;
  const Eigen::Matrix3Xd normals = restNormals();
  for (Eigen::Index v = 0; v < skin.cols(); ++v)
    if (covered(skin.col(v)))
      dressed.templateVertices.col(v) += gap * normals.col(v);
  return dressed;
}

inline BodyTracker coarseTracker(const avatar::Camera& camera) {
  TrackerOptions options;
  options.numSamples = 800;
  options.numDepthSamples = 600;
  return BodyTracker(avatar::defaultBody(), camera, options);
}

/// The covered parts of a dressed body of one shape as clothes that follow it.
inline OuterLayer clothesOf(
    const avatar::BodyModel& dressed, const Eigen::VectorXd& betas, const Region& covered) {
  const avatar::BodyModel& model = avatar::defaultBody();
  std::vector<Eigen::Index> kept;
  std::vector<int> place(static_cast<std::size_t>(model.numVertices()), -1);
  for (Eigen::Index v = 0; v < model.numVertices(); ++v) {
    if (!covered(model.templateVertices.col(v)))
      continue;
    place[static_cast<std::size_t>(v)] = static_cast<int>(kept.size());
    kept.push_back(v);
  }
  OuterLayer layer;
  layer.restVertices = avatar::shapedVertices(dressed, betas)(Eigen::all, kept);
  layer.bareness = Eigen::VectorXd::Ones(model.numVertices());
  layer.unknown = ClothUnknown::kNothing;
  layer.skinningWeights.resize(std::ssize(kept), model.numJoints() + 1);
  layer.skinningWeights.reserve(Eigen::VectorXi::Constant(static_cast<int>(kept.size()), 8));
  for (std::size_t i = 0; i < kept.size(); ++i) {
    layer.bareness[kept[i]] = 0.0;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(
             model.skinningWeights, kept[i]);
         it;
         ++it)
      layer.skinningWeights.insert(static_cast<Eigen::Index>(i), it.col()) = it.value();
  }
  layer.skinningWeights.makeCompressed();
  std::vector<Eigen::Vector3i> faces;
  for (const auto& face : model.faces.colwise()) {
    const Eigen::Vector3i corners =
        face.unaryExpr([&](int vertex) { return place[static_cast<std::size_t>(vertex)]; });
    if (corners.minCoeff() >= 0)
      faces.push_back(corners);
  }
  layer.faces.resize(3, std::ssize(faces));
  for (std::size_t f = 0; f < faces.size(); ++f)
    layer.faces.col(static_cast<Eigen::Index>(f)) = faces[f];
  layer.looseness = clothLooseness(
      layer.restVertices,
      layer.skinningWeights,
      {avatar::shapedVertices(model, betas), model.faces});
  return layer;
}

}  // namespace simulcap::test
