#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/rasterizer.h"
#include "avatar/skinning.h"
#include "src/input/depth_cloud.h"

namespace simulcap::test {

/// A quarter of the usual pixels, to be quick under the sanitizers.
inline avatar::Camera smallCamera(double distance = 2.6) {
  avatar::Camera camera{
      .width = 320, .height = 240, .fx = 262.5, .fy = 262.5, .cx = 159.5, .cy = 119.5};
  camera.cameraFromWorld =
      avatar::lookAt(Eigen::Vector3d(0.0, 0.0, distance), Eigen::Vector3d(0.0, -0.25, 0.0));
  return camera;
}

/// Sees a person 1.2 m away from the waist up.
inline avatar::Camera waistUpCamera() {
  avatar::Camera camera = smallCamera();
  camera.cameraFromWorld =
      avatar::lookAt(Eigen::Vector3d(0.0, 0.4, 1.2), Eigen::Vector3d(0.0, 0.4, 0.0));
  return camera;
}

/// Ideal depth of an undressed body before an empty room: a wall 2 m behind.
inline DepthCloud renderedCloud(
    const avatar::BodyModel& model,
    const Eigen::VectorXd& betas,
    const avatar::BodyPose& pose,
    const avatar::Camera& camera) {
  const Eigen::Matrix3Xd vertices = avatar::posedVertices(model, betas, pose);
  const avatar::RasterImage image = avatar::rasterize({vertices, model.faces}, camera);
  DepthCloud cloud{.width = camera.width, .height = camera.height, .depth = image.depth};
  const auto size = static_cast<Eigen::Index>(image.depth.size());
  cloud.person.assign(image.depth.size(), 0);
  cloud.labels.assign(image.depth.size(), kBackground);
  cloud.points = Eigen::Matrix3Xf::Zero(3, size);
  cloud.normals = Eigen::Matrix3Xf::Zero(3, size);
  const Eigen::Matrix3d rotation = camera.cameraFromWorld.linear();
  for (Eigen::Index i = 0; i < size; ++i) {
    const auto p = static_cast<std::size_t>(i);
    if (image.triangle[p] < 0) {
      constexpr float kWall = 5.0F;
      cloud.depth[p] = kWall;
      continue;
    }
    const double u = static_cast<double>(i % camera.width);
    const Eigen::Index row = i / camera.width;
    const double v = static_cast<double>(row);
    const Eigen::Vector3d ray = avatar::rayInCamera(camera, u, v);
    cloud.person[p] = 1;
    cloud.labels[p] = kSkin;
    cloud.points.col(i) = (ray * static_cast<double>(image.depth[p])).cast<float>();
    const Eigen::Vector3i face = model.faces.col(image.triangle[p]);
    const Eigen::Vector3d a = vertices.col(face[0]);
    const Eigen::Vector3d normal =
        (vertices.col(face[1]) - a).cross(vertices.col(face[2]) - a).normalized();
    cloud.normals.col(i) = (rotation * normal).cast<float>();
  }
  return cloud;
}

inline DepthCloud emptyCloud(const avatar::Camera& camera) {
  const auto size =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  DepthCloud cloud{.width = camera.width, .height = camera.height};
  cloud.depth.assign(size, 0.0F);
  cloud.person.assign(size, 0);
  cloud.points = Eigen::Matrix3Xf::Zero(3, static_cast<Eigen::Index>(size));
  cloud.normals = cloud.points;
  return cloud;
}

}  // namespace simulcap::test
