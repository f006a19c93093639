#pragma once

#include "avatar/body_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/primitives_mesh.h"
#include "avatar/geometry/rasterizer.h"
#include "avatar/motion_clips.h"
#include "avatar/skinning.h"
#include "src/input/depth_noise.h"
#include "src/input/rgbd_frame.h"

#include <random>
#include <vector>

/// People in a room, seen by a noisy depth camera, with the truth of every pixel.
namespace simulcap::test {

enum RoomObject : int { kFloor = 1, kWall = 2, kPerson = 3, kOtherPerson = 4 };

struct Room {
  avatar::Camera camera;
  std::vector<avatar::TriangleMesh> meshes;
  std::vector<int> objects;
  bool noisy = true;

  void add(avatar::TriangleMesh mesh, const Eigen::Isometry3d& placement, int object) {
    mesh.vertices = (placement * mesh.vertices.colwise().homogeneous()).eval();
    meshes.push_back(std::move(mesh));
    objects.push_back(object);
  }

  void addFloor() { add(avatar::planeMesh({8.0, 8.0}), Eigen::Isometry3d::Identity(), kFloor); }

  /// Upright, at this z, facing the camera.
  void addWall(double z) {
    Eigen::Isometry3d placement = Eigen::Isometry3d::Identity();
    placement.translation().z() = z;
    placement.rotate(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitX()));
    add(avatar::planeMesh({8.0, 8.0}), placement, kWall);
  }

  void addPerson(const avatar::BodyPose& pose, const Eigen::Vector3d& at, int object = kPerson) {
    const avatar::BodyModel& body = avatar::defaultBody();
    Eigen::Isometry3d placement = Eigen::Isometry3d::Identity();
    placement.translation() = at;
    const Eigen::VectorXd betas = Eigen::VectorXd::Zero(body.shapeDirections.cols());
    add({posedVertices(body, betas, pose), body.faces}, placement, object);
  }
};

struct RoomPicture {
  RgbdFrame frame;
  avatar::RasterImage truth;

  bool is(std::size_t pixel, int object) const { return truth.object[pixel] == object; }
};

inline RoomPicture picture(const Room& room, int index = 0) {
  avatar::Rasterizer rasterizer;
  rasterizer.begin(room.camera);
  for (std::size_t i = 0; i < room.meshes.size(); ++i)
    rasterizer.draw({room.meshes[i].vertices, room.meshes[i].faces}, room.objects[i]);
  RoomPicture result;
  result.truth = rasterizer.takeImage();
  result.frame.index = index;
  result.frame.timestamp = index / 10.0;
  result.frame.width = room.camera.width;
  result.frame.height = room.camera.height;
  result.frame.depth = result.truth.depth;
  if (!room.noisy)
    return result;
  std::mt19937 random(static_cast<unsigned>(index + 1));
  // A sum of 12 uniform numbers has variance 1; the same on every machine, other than
  // std::normal_distribution.
  const auto gauss = [&] {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i)
      sum += static_cast<double>(random()) / 4294967296.0;
    return static_cast<float>(sum);
  };
  for (float& z : result.frame.depth) {
    if (random() % 30 == 0)
      z = 0.0F;
    else if (z > 0.0F)
      z += depthNoise(z) * gauss();
  }
  return result;
}

/// 320 × 240, 60° wide, at 1 m height in front of the origin.
inline avatar::Camera roomCamera(double distance = 2.6) {
  avatar::Camera camera{
      .width = 320, .height = 240, .fx = 270.0, .fy = 270.0, .cx = 159.5, .cy = 119.5};
  camera.cameraFromWorld = avatar::lookAt({0.0, 1.0, distance}, {0.0, 0.95, 0.0});
  return camera;
}

/// The person's pixels against the truth, where something was measured.
inline double maskIou(
    const RoomPicture& picture, const std::vector<std::uint8_t>& person, int object = kPerson) {
  double both = 0.0;
  double either = 0.0;
  for (std::size_t i = 0; i < person.size(); ++i) {
    if (picture.frame.depth[i] <= 0.0F)
      continue;
    both += picture.is(i, object) && person[i] != 0 ? 1.0 : 0.0;
    either += picture.is(i, object) || person[i] != 0 ? 1.0 : 0.0;
  }
  return both / either;
}

}  // namespace simulcap::test
