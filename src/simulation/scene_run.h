#pragma once

#include "bullet_ext/capture_world.h"
#include "src/scene/scene.h"
#include "src/simulation/obstacles.h"
#include "src/simulation/stage.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <memory>
#include <string>
#include <vector>

namespace simulcap {

/// What pre-flight found of a cloth.
struct ClothStability {
  std::string name;
  double largestSubstep = 0.0;  ///< that is stable about the rest shape [s]
};

/// A scene in motion: owns the Bullet world with a stage's cloths, body and obstacles, and moves it
/// frame by frame.
class SceneRun {
 public:
  /// Builds only what the scene names. Throws std::runtime_error for a mesh that can't be
  /// simulated, or a number of substeps that pre-flight finds unstable, with the number it needs.
  SceneRun(const Scene& scene, const Stage& stage, int threads);

  const std::vector<ClothStability>& preflight() const { return preflight_; }

  int substepsPerFrame() const { return timing_.substeps; }

  /// Frames since the beginning of the pre-roll; 0 before the first advance().
  int frame() const { return frame_; }

  /// To the next frame.
  bullet_ext::FrameReport advance();

  /// Leaves the cloths this share of their velocities: once per frame, so that they come to rest
  /// sooner than they would by themselves.
  void calm(double share);

  /// The parts that the scene asked for; those of others are null.
  const bullet_ext::CaptureWorld& world() const { return *world_; }

  /// 3 × N [m], in the order of the stage's mesh.
  Eigen::Matrix3Xd vertices(int cloth) const { return world_->vertices(cloth); }

  /// 0 without any.
  int numObstacles() const { return obstacles_ ? obstacles_->count() : 0; }

  Eigen::Isometry3d worldFromObstacle(int obstacle) const {
    return obstacles_->worldFromObstacle(obstacle);
  }

 private:
  void checkStability(const Scene& scene);
  void movePins(const avatar::MeshView* body);

  const Stage& stage_;
  bullet_ext::FrameTiming timing_;
  std::unique_ptr<bullet_ext::CaptureWorld> world_;
  std::unique_ptr<Obstacles> obstacles_;  ///< null: none; after the world, which it leaves first
  std::vector<ClothStability> preflight_;
  int frame_ = 0;
};

}  // namespace simulcap
