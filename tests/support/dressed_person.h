#pragma once

#include "avatar/body_model.h"
#include "avatar/digitization/canonical_volume.h"
#include "avatar/geometry/rasterizer.h"
#include "avatar/wardrobe/dressing_body.h"
#include "avatar/wardrobe/outfit.h"
#include "tests/avatar/digitization/rendered_frame.h"

#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <vector>

/// People in built-in garments as a turn before a camera would have captured them, without one.
namespace avatar::test {

/// Noiseless points of what cameras around see, at most one per voxel.
inline FusedPoints seenPoints(std::span<const PaintedMesh> painted, double voxelSize = 0.004) {
  constexpr int kViews = 16;
  constexpr double kDistance = 2.6;  // [m]
  std::set<std::tuple<long, long, long>> taken;
  std::vector<Eigen::Vector3d> points, normals, colors;
  FusedPoints result;
  Eigen::AlignedBox3d box;
  for (const PaintedMesh& mesh : painted)
    box.extend(boundingBox(mesh.mesh));
  const auto add = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& normal, int object) {
    const auto cell = [&](int axis) { return std::lround(point[axis] / voxelSize); };
    if (!taken.emplace(cell(0), cell(1), cell(2)).second)
      return;
    points.push_back(point);
    normals.push_back(normal);
    const PaintedMesh& mesh = painted[static_cast<std::size_t>(object)];
    colors.push_back(mesh.color);
    LabelCounts counts = {};
    counts[static_cast<std::size_t>(mesh.label - kSkinLabel)] = 20;
    result.labels.push_back(counts);
  };
  for (int view = 0; view < kViews; ++view) {
    const double angle = 2.0 * std::numbers::pi * view / kViews;
    const Eigen::Vector3d eye =
        box.center() + kDistance * Eigen::Vector3d(std::sin(angle), 0.0, std::cos(angle));
    Camera camera{.width = 480, .height = 640, .fx = 600, .fy = 600, .cx = 239.5, .cy = 319.5};
    camera.cameraFromWorld = lookAt(eye, box.center());
    const PosedDepthFrame frame = renderedFrame(painted, camera, {});
    std::vector<MeshView> meshes;
    for (const PaintedMesh& mesh : painted)
      meshes.push_back(mesh.mesh);
    const RasterImage image = rasterize(meshes, camera);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::size_t i = image.index(x, y);
        if (image.object[i] < 0)
          continue;
        Eigen::Vector3d normal = camera.cameraFromWorld.linear().transpose() *
                                 frame.normals.col(static_cast<Eigen::Index>(i)).cast<double>();
        const Eigen::Vector3d point = unproject(camera, {1.0 * x, 1.0 * y, image.depth[i]});
        if (normal.dot(point - eye) > 0.0)
          normal = -normal;  // the inner side of a collar or a hem
        constexpr double kGrazing = 0.15;
        if (-normal.dot((point - eye).normalized()) > kGrazing)
          add(point, normal, image.object[i]);
      }
    }
  }
  const auto count = static_cast<Eigen::Index>(points.size());
  result.points.resize(3, count);
  result.normals.resize(3, count);
  result.colors.resize(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    result.points.col(i) = points[static_cast<std::size_t>(i)];
    result.normals.col(i) = normals[static_cast<std::size_t>(i)];
    result.colors.col(i) = colors[static_cast<std::size_t>(i)].cast<float>();
  }
  return result;
}

/// Garments that are worn, the lower one first if there are two.
struct DressedPerson {
  DressingBody body;
  std::vector<Garment> garments;
  std::vector<SurfaceLabel> labels;  ///< of each garment
  FusedPoints seen;
};

/// `names` of wardrobe pieces, the lower one first; one alone is a dress.
inline DressedPerson dressedPerson(
    const BodyModel& model, const Eigen::VectorXd& betas, const std::vector<std::string>& names) {
  DressedPerson person{.body = standForDressing(model, betas)};
  for (const std::string& name : names) {
    person.garments.push_back(makeGarment({.name = name}, person.body, person.garments));
    person.labels.push_back(names.size() == 2 && person.labels.empty() ? kLowerLabel : kUpperLabel);
  }
  std::vector<PaintedMesh> painted = {
      {person.body.mesh(), kSkinLabel, Eigen::Vector3d(0.9, 0.7, 0.6)}};
  for (std::size_t i = 0; i < person.garments.size(); ++i)
    painted.push_back({person.garments[i].mesh, person.labels[i], person.garments[i].color});
  person.seen = seenPoints(painted);
  return person;
}

}  // namespace avatar::test
