#include "bullet_ext/collision_pairs.h"

#include "bullet_ext/cloth_body.h"

#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btEmptyCollisionAlgorithm.h>

namespace bullet_ext {
namespace {

bool isOurs(const btCollisionObject& object) {
  return dynamic_cast<const ClothBody*>(&object) != nullptr ||
         object.getCollisionShape()->getShapeType() == FAST_CONCAVE_MESH_PROXYTYPE;
}

/// Makes no contacts for our pairs and leaves the others to Bullet.
class Selection final : public btCollisionAlgorithmCreateFunc {
 public:
  explicit Selection(btCollisionAlgorithmCreateFunc& stock) : stock_(stock) {}

  btCollisionAlgorithm* CreateCollisionAlgorithm(
      btCollisionAlgorithmConstructionInfo& info,
      const btCollisionObjectWrapper* wrapper0,
      const btCollisionObjectWrapper* wrapper1) override {
    return isOurs(*wrapper0->getCollisionObject()) || isOurs(*wrapper1->getCollisionObject())
               ? none_.CreateCollisionAlgorithm(info, wrapper0, wrapper1)
               : stock_.CreateCollisionAlgorithm(info, wrapper0, wrapper1);
  }

 private:
  btEmptyAlgorithm::CreateFunc none_;
  btCollisionAlgorithmCreateFunc& stock_;
};

}  // namespace

CollisionPairs::CollisionPairs(btCollisionDispatcher& dispatcher) {
  btCollisionConfiguration& configuration = *dispatcher.getCollisionConfiguration();
  const auto select = [&](int type0, int type1) {
    functions_.push_back(
        std::make_unique<Selection>(*configuration.getCollisionAlgorithmCreateFunc(type0, type1)));
    dispatcher.registerCollisionCreateFunc(type0, type1, functions_.back().get());
  };
  for (int type = 0; type < MAX_BROADPHASE_COLLISION_TYPES; ++type) {
    select(SOFTBODY_SHAPE_PROXYTYPE, type);
    if (type != SOFTBODY_SHAPE_PROXYTYPE)
      select(type, SOFTBODY_SHAPE_PROXYTYPE);
  }
}

}  // namespace bullet_ext
