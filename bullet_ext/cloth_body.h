#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"

#include <BulletSoftBody/btSoftBody.h>
#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <vector>

namespace bullet_ext {

/// When a body's tree over its faces follows them, for rays.
enum class FaceTreeUpdate {
  kEveryFrame,  ///< rays are right at any time
  kOnDemand     ///< who casts rays calls fitFaceTree() first
};

/// Where a ray meets a cloth first.
struct ClothRayHit {
  double fraction = 1.0;  ///< of the way from the ray's start to its end
  int face = -1;          ///< of the body
  Eigen::Vector3i vertices = Eigen::Vector3i::Constant(-1);  ///< the face's, as nodes
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();          ///< the face's, unit
};

/// A core cloth as the rest of a Bullet world sees it: node i is vertex i of the mesh's input, and
/// face f is mesh.faces column f. The core's state is the truth and the nodes are its image,
/// written once per frame; what somebody writes to a node between frames is adopted.
///
/// Links, faces and masses are set once and are for drawing, export and rays. Bullet's own soft
/// body forces, anchors, clusters and collision modes do nothing here.
class ClothBody final : public btSoftBody {
 public:
  /// At rest in the mesh's rest shape. The margin is the material's thickness, the friction the
  /// material's. worldInfo must outlive the body.
  ClothBody(
      const ClothMesh& mesh,
      btSoftBodyWorldInfo& worldInfo,
      FaceTreeUpdate treeUpdate = FaceTreeUpdate::kEveryFrame);

  /// Makes nodes, normals, bounds and broadphase box those of the state (solver order).
  void mirror(const ClothState& state);

  /// Writes to the state the positions and velocities of nodes that were changed since the last
  /// mirror(), by translate(), setVelocity() and the like. Returns how many nodes that were. Throws
  /// std::invalid_argument if one of them isn't finite; the state is unchanged then.
  int adoptChanges(ClothState& state) const;

  /// Moves the forces that addForce() has gathered in the nodes into `forces` (4 × N [N], solver
  /// order, overwritten) and clears them. False, and `forces` as it was, if there are none.
  bool takeForces(Eigen::Matrix4Xf& forces);

  /// Makes rays right and fast until the next mirror(). Without it they look at every triangle of a
  /// cloth that they come near to, and Bullet's test of a single triangle lets rays hit that pass
  /// it by decimetres: its tolerance is absolute, and boxes are what makes up for it.
  void fitFaceTree();

  /// Exactly, and fitting the tree if needed; nothing if the ray passes the cloth.
  std::optional<ClothRayHit> castRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

 private:
  std::size_t solverIndex(int node) const {
    return static_cast<std::size_t>(solverFromInput_[static_cast<std::size_t>(node)]);
  }

  void addElements(const ClothMesh& mesh);
  void buildFaceTree();
  btDbvtNode* buildFaceTree(int begin, int end, btDbvtNode* parent);
  void loosenFaceTree();
  void updateBox();

  std::vector<int> solverFromInput_;
  std::vector<btVector3> positions_, velocities_;  ///< N, as mirrored, in the order of the nodes
  std::vector<btDbvtNode*> treeNodes_;             ///< parents before their children
  FaceTreeUpdate treeUpdate_;
  bool treeIsFitted_ = false;
  btDbvtVolume looseVolume_;  ///< of all nodes of a tree that isn't fitted
};

}  // namespace bullet_ext
