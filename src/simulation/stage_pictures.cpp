#include "src/simulation/stage_pictures.h"

#include "avatar/geometry/primitives_mesh.h"

#include <cstdio>
#include <variant>

namespace simulcap {
namespace {

/// Round shapes with edges of a tenth of their radius; of a plane, a patch of four metres.
struct ObstacleMesher {
  avatar::TriangleMesh operator()(const SphereShape& sphere) const {
    return avatar::sphereMesh(sphere.radius, 0.1 * sphere.radius);
  }

  avatar::TriangleMesh operator()(const BoxShape& box) const { return avatar::boxMesh(box.size); }

  avatar::TriangleMesh operator()(const CapsuleShape& capsule) const {
    return avatar::capsuleMesh(capsule.radius, capsule.length, 0.1 * capsule.radius);
  }

  avatar::TriangleMesh operator()(const PlaneShape& /*plane*/) const {
    return avatar::planeMesh(Eigen::Vector2d(4.0, 4.0));
  }
};

}  // namespace

const Eigen::Vector3d StagePictures::kObstacleColor(0.62, 0.62, 0.65);

StagePictures::StagePictures(const Scene& scene, const Stage& stage) : stage_(stage) {
  for (const SceneObstacle& obstacle : scene.obstacles)
    obstacles_.push_back(std::visit(ObstacleMesher{}, obstacle.shape));
}

PicturedPerson StagePictures::person() const {
  return stage_.body ? PicturedPerson(stage_.body->model()) : PicturedPerson::nobody();
}

PicturedBody StagePictures::moment(const SceneRun& run) const {
  PicturedBody moment;
  char label[32];
  std::snprintf(
      label,
      sizeof label,
      "%.2f s",
      (run.frame() - stage_.numPrerollFrames) / stage_.framesPerSecond);
  moment.label = label;
  if (stage_.body)
    moment.vertices = stage_.body->vertices(run.frame());
  for (std::size_t i = 0; i < stage_.cloths.size(); ++i)
    moment.garments.push_back(
        {{run.vertices(static_cast<int>(i)), stage_.cloths[i].rest.faces}, stage_.cloths[i].color});
  for (std::size_t i = 0; i < obstacles_.size(); ++i)
    moment.props.push_back(
        {{run.worldFromObstacle(static_cast<int>(i)) * obstacles_[i].vertices, obstacles_[i].faces},
         kObstacleColor});
  return moment;
}

}  // namespace simulcap
