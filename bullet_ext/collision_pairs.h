#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

#include <memory>
#include <vector>

namespace bullet_ext {

/// Takes pairs that our own contact treats out of Bullet's narrow phase: ClothBody with anything,
/// and any soft body with a KinematicBody. Other soft bodies keep Bullet's algorithms.
///
/// Nothing depends on it but time: Bullet makes a convex hull on the heap of every triangle of a
/// concave shape near a soft body before it asks anybody (milliseconds per step over a person). And
/// what it does with those of a deforming mesh is wrong: it keeps the hulls of where they were.
class CollisionPairs {
 public:
  /// For all pairs that meet from now on. Must live as long as the dispatcher is used.
  explicit CollisionPairs(btCollisionDispatcher& dispatcher);

 private:
  std::vector<std::unique_ptr<btCollisionAlgorithmCreateFunc>> functions_;
};

}  // namespace bullet_ext
