#pragma once

#include "avatar/geometry/mesh.h"
#include "src/output/body_view.h"
#include "src/scene/scene.h"
#include "src/simulation/scene_run.h"
#include "src/simulation/stage.h"

#include <Eigen/Core>

#include <vector>

namespace simulcap {

/// What there is to see of a scene.
class StagePictures {
 public:
  /// Keeps a reference to the stage.
  StagePictures(const Scene& scene, const Stage& stage);

  PicturedPerson person() const;

  /// As it is in the run's frame, captioned with the time since frame 0.
  PicturedBody moment(const SceneRun& run) const;

  /// At rest where their poses are the identity.
  const std::vector<avatar::TriangleMesh>& obstacles() const { return obstacles_; }

  static const Eigen::Vector3d kObstacleColor;  ///< display values

 private:
  const Stage& stage_;
  std::vector<avatar::TriangleMesh> obstacles_;
};

}  // namespace simulcap
