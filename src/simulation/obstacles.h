#pragma once

#include "src/scene/scene.h"

#include <Eigen/Geometry>

#include <memory>
#include <vector>

class btCollisionShape;
class btDynamicsWorld;
class btRigidBody;

namespace simulcap {

/// A scene's obstacles as rigid bodies of a Bullet world; gone from it when this ends.
class Obstacles {
 public:
  Obstacles(const std::vector<SceneObstacle>& obstacles, btDynamicsWorld& world);
  Obstacles(const Obstacles&) = delete;
  Obstacles& operator=(const Obstacles&) = delete;
  Obstacles(Obstacles&&) = delete;
  Obstacles& operator=(Obstacles&&) = delete;
  ~Obstacles();

  /// Before a step of the world: where those that move as told are at its end, so long after the
  /// beginning [s].
  void moveKinematic(double seconds);

  int count() const { return static_cast<int>(bodies_.size()); }

  Eigen::Isometry3d worldFromObstacle(int obstacle) const;

 private:
  void add(const SceneObstacle& obstacle);

  btDynamicsWorld& world_;
  std::vector<SceneObstacle> obstacles_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

}  // namespace simulcap
