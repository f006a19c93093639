#include "src/scene/scene.h"

#include "bullet_ext/core/cloth_material.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace simulcap {

Eigen::Isometry3d Placement::worldFromLocal() const {
  const Eigen::Vector3d angles = rotationDegrees * std::numbers::pi / 180.0;
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  transform.translate(position);
  transform.rotate(
      Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()));
  return transform;
}

avatar::Camera SceneCamera::camera() const {
  avatar::Camera result;
  result.width = width;
  result.height = height;
  result.fx = fx;
  result.fy = fy.value_or(fx);
  result.cx = cx.value_or((width - 1) / 2.0);
  result.cy = cy.value_or((height - 1) / 2.0);
  result.cameraFromWorld = avatar::lookAt(position, target, up);
  return result;
}

avatar::ClothParameters paperCloth(const std::string& material) {
  // The paper's materials differ in k and w alone; the rest is the same on both sides.
  const bullet_ext::ClothMaterial paper = bullet_ext::paperMaterial(material);
  avatar::ClothParameters cloth;
  cloth.stretchStiffness = paper.stretchStiffness;
  cloth.torsionStiffness = paper.torsionStiffness;
  return cloth;
}

int substepsPerFrame(const SceneTime& time) {
  constexpr double kSubstepsPerSecond = 3000.0;
  const auto whole = static_cast<int>(std::lround(kSubstepsPerSecond / time.framesPerSecond));
  return time.substeps.value_or(std::max(1, whole));
}

std::optional<int> numFrames(const SceneTime& time) {
  if (time.frames || !time.seconds)
    return time.frames;
  return std::max(1, static_cast<int>(std::lround(*time.seconds * time.framesPerSecond)));
}

SceneContact activeContact(const Scene& scene) {
  SceneContact active;
  active.body = scene.contact.body && scene.body && !scene.garments.empty();
  active.betweenGarments = scene.contact.betweenGarments && scene.garments.size() > 1;
  active.selfContact = scene.contact.selfContact && !scene.garments.empty();
  return active;
}

std::vector<std::string> leftOut(const Scene& scene) {
  const SceneContact contact = activeContact(scene);
  const std::pair<bool, const char*> parts[] = {
      {!scene.gravity.isZero(0.0), "gravity"},
      {scene.body.has_value(), "body"},
      {scene.body && !scene.body->softTissue.empty(), "soft tissue"},
      {!scene.garments.empty(), "garments"},
      {contact.body, "contact with the body"},
      {contact.betweenGarments, "contact between garments"},
      {contact.selfContact, "self-contact"},
      {scene.strainLimit.has_value(), "strain limit"},
      {scene.wind.has_value(), "wind"},
      {!scene.obstacles.empty(), "obstacles"},
      {scene.camera.has_value(), "camera"},
      {scene.sensor.has_value(), "sensor noise"},
      {scene.room.has_value(), "room and lights"}};
  std::vector<std::string> names;
  for (const auto& [present, name] : parts) {
    if (!present)
      names.emplace_back(name);
  }
  return names;
}

}  // namespace simulcap
