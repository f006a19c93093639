#pragma once

#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/layered_avatar.h"
#include "tests/support/primitive_meshes.h"

#include <Eigen/Core>

#include <cmath>
#include <numbers>
#include <string>

/// A dressed person without tailoring: tubes around a body, bound in an A-pose.
namespace avatar::test {

struct TubeSize {
  double bottom = 0.0;   ///< y of the hem at rest [m]
  double top = 0.3;      ///< y of the upper edge at rest [m]
  double margin = 0.02;  ///< from the body, whose widest place within the tube decides [m]
  int columns = 32;
  int rows = 12;
};

/// Half the extent of the body across (x, z) between two heights, only near the midline, so that
/// outstretched arms don't count [m].
inline Eigen::Vector2d halfExtent(const AvatarBody& body, const TubeSize& size) {
  Eigen::Vector2d extent = Eigen::Vector2d::Zero();
  for (const auto& vertex : body.mesh.vertices.colwise())
    if (vertex.y() > size.bottom && vertex.y() < size.top && std::abs(vertex.x()) < 0.25)
      extent = extent.cwiseMax(Eigen::Vector2d(std::abs(vertex.x()), std::abs(vertex.z())));
  return extent;
}

/// An elliptic tube around the trunk in the rest pose, open at both ends, that follows the body's
/// nearest vertices; then posed, with the upper edge pinned.
inline Garment tubeGarment(
    const AvatarBody& body, const std::string& name, const TubeSize& size, const BodyPose& pose) {
  const Eigen::Vector2d radii = halfExtent(body, size).array() + size.margin;
  Garment garment;
  garment.name = name;
  garment.mesh = grid(size.columns, size.rows, true, false, [&](int i, int j) {
    const double u = -2.0 * std::numbers::pi * i / size.columns;  // outward normals with y up
    const double y = size.bottom + (size.top - size.bottom) * j / size.rows;
    return Eigen::Vector3d(radii.x() * std::cos(u), y, radii.y() * std::sin(u));
  });
  const auto numJoints = static_cast<Eigen::Index>(body.parents.size());
  Eigen::MatrixXd weights(garment.mesh.numVertices(), numJoints);
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    Eigen::Index nearest = 0;
    (body.mesh.vertices.colwise() - garment.mesh.vertices.col(v))
        .colwise()
        .squaredNorm()
        .minCoeff(&nearest);
    weights.row(v) = body.skinningWeights.row(nearest);
  }
  garment.skinningWeights = limitedWeights(weights.sparseView());
  // In its own bind pose a garment is its mesh: posed from rest, then bound there.
  garment.mesh.vertices = roundedToFloat(posedVertices(garment, body, pose));
  garment.bindPose = pose;
  for (int i = 0; i < size.columns; ++i)
    garment.pins.push_back(size.rows * size.columns + i);
  return garment;
}

/// The body with a shirt and a skirt over it, every parameter different from its default.
inline LayeredAvatar dressedAvatar(const BodyModel& model, const Eigen::VectorXd& betas) {
  LayeredAvatar avatar;
  avatar.body = makeAvatarBody(model, betas);
  const AvatarBody& body = avatar.body;
  const double hip = body.joints(1, kPelvis);
  const double chest = body.joints(1, kSpine3);
  const double knee = body.joints(1, kLeftKnee);
  avatar.garments = {
      tubeGarment(body, "shirt", {.bottom = hip - 0.05, .top = chest + 0.05}, aPose()),
      tubeGarment(
          body, "skirt", {.bottom = knee + 0.1, .top = hip + 0.05, .margin = 0.04}, aPose())};
  avatar.body.color = {0.8, 0.6, 0.5};
  Garment& shirt = avatar.garments[0];
  shirt.cloth = {
      .stretchStiffness = 512.3,
      .torsionStiffness = 0.04,
      .massMode = MassMode::kAreal,
      .vertexMass = 0.0011,
      .arealDensity = 0.15,
      .dampingMode = DampingMode::kPerSubstep,
      .damping = 0.013,
      .friction = 0.42,
      .thickness = 0.003};
  shirt.maxDistance = Eigen::VectorXd::LinSpaced(shirt.mesh.numVertices(), 0.0, 0.1);
  shirt.hints = {{"unity", {{"bendingStiffness", 0.3}}}, {"blender", {{"mass", 0.15}}}};
  shirt.vertexColors = Eigen::Matrix3Xd::Constant(3, shirt.mesh.numVertices(), 0.3);
  shirt.vertexColors.row(0).setLinSpaced(0.0, 1.0);
  Garment& skirt = avatar.garments[1];
  skirt.layer = 1;
  skirt.collideWith = {"body", "shirt"};
  skirt.color = {0.7, 0.2, 0.25};
  skirt.cloth.vertexMasses.assign(static_cast<std::size_t>(skirt.mesh.numVertices()), 0.0009);
  return avatar;
}

}  // namespace avatar::test
