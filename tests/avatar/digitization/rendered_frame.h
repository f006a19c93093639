#pragma once

#include "avatar/digitization/posed_frame.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/rasterizer.h"

#include <Eigen/Geometry>

#include <numbers>
#include <span>

namespace avatar::test {

/// One surface of a made-up picture, in one colour and label.
struct PaintedMesh {
  MeshView mesh;
  SurfaceLabel label = kSkinLabel;
  Eigen::Vector3d color = {0.5, 0.5, 0.5};
};

inline Camera frontCamera(double distance, int width = 240, int height = 320) {
  Camera camera{.width = width, .height = height, .fx = 300, .fy = 300};
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  camera.cameraFromWorld = lookAt({0.0, 0.0, distance}, Eigen::Vector3d::Zero());
  return camera;
}

/// A noiseless picture with the normals of the faces.
inline PosedDepthFrame renderedFrame(
    std::span<const PaintedMesh> painted, const Camera& camera, const BodyPose& pose) {
  Rasterizer rasterizer;
  rasterizer.begin(camera);
  std::vector<Eigen::Matrix3Xd> normals;
  for (std::size_t i = 0; i < painted.size(); ++i) {
    rasterizer.draw(painted[i].mesh, static_cast<std::int32_t>(i));
    normals.push_back(faceNormals(painted[i].mesh));
  }
  const RasterImage image = rasterizer.takeImage();
  PosedDepthFrame frame{.camera = camera, .depth = image.depth, .pose = pose};
  frame.normals = Eigen::Matrix3Xf::Zero(3, static_cast<Eigen::Index>(image.depth.size()));
  frame.color = {camera.width, camera.height, std::vector<std::uint8_t>(3 * image.depth.size())};
  frame.labels.assign(image.depth.size(), kNoLabel);
  for (std::size_t i = 0; i < image.depth.size(); ++i) {
    if (image.object[i] < 0)
      continue;
    const auto object = static_cast<std::size_t>(image.object[i]);
    const Eigen::Vector3d normal =
        camera.cameraFromWorld.linear() * normals[object].col(image.triangle[i]);
    frame.normals.col(static_cast<Eigen::Index>(i)) = normal.cast<float>();
    frame.labels[i] = painted[object].label;
    for (std::size_t c = 0; c < 3; ++c)
      frame.color.rgb[3 * i + c] =
          static_cast<std::uint8_t>(255.0 * painted[object].color[static_cast<Eigen::Index>(c)]);
  }
  return frame;
}

/// The pose turned about the vertical by an angle [rad].
inline BodyPose turned(BodyPose pose, double angle) {
  const Eigen::Vector3d root = pose.jointRotations.head<3>();
  const Eigen::AngleAxisd before(
      root.norm(), root.norm() > 0.0 ? root.normalized() : Eigen::Vector3d::UnitX());
  const Eigen::AngleAxisd after(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * before);
  pose.jointRotations.head<3>() = after.angle() * after.axis();
  return pose;
}

}  // namespace avatar::test
