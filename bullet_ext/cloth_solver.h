#pragma once

#include "bullet_ext/cloth_body.h"
#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/rigid_coupling.h"

#include <BulletSoftBody/btDefaultSoftBodySolver.h>
#include <Eigen/Core>

#include <memory>
#include <optional>
#include <vector>

namespace bullet_ext {

struct ClothSolverOptions {
  SimulationOptions simulation;
  /// A step of the world is divided into substeps no longer than this [s], 1e-6 … 1; the paper's
  /// 1/3000 s.
  double largestSubstep = 1.0 / 3000.0;
  FaceTreeUpdate faceTreeUpdate = FaceTreeUpdate::kEveryFrame;

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// The core's cloths inside a btSoftRigidDynamicsWorld: give it to the world's constructor, and
/// each step of the world moves them through all their substeps. That is after the rigid bodies, so
/// cloth is as new as they are when stepSimulation returns, and not yet in a tick callback.
///
/// It owns the cloths and their ClothBody, so it must be destroyed after the world. Cloths are
/// simulated whether or not their bodies are in the world; there others can see them. Soft bodies
/// of the world that are not ClothBody are left to Bullet's default solver and stay what they are
/// without us; they don't touch our cloth.
class ClothSolver final : public btSoftBodySolver {
 public:
  explicit ClothSolver(const ClothSolverOptions& options = {});

  /// A cloth at rest in its rest shape, under the gravity that worldInfo has now. Add the result to
  /// the world. worldInfo must outlive the solver's use.
  ClothBody& addCloth(ClothMesh mesh, btSoftBodyWorldInfo& worldInfo);

  /// For states, pins, forces, constraints. Who changes a state calls showStates() if somebody
  /// looks at the body before the next step.
  ClothSimulation& simulation() { return simulation_; }

  const ClothSimulation& simulation() const { return simulation_; }

  /// Of the simulation's cloth of that index.
  ClothBody& body(int cloth) { return *bodies_.at(static_cast<std::size_t>(cloth)); }

  const ClothBody& body(int cloth) const { return *bodies_.at(static_cast<std::size_t>(cloth)); }

  /// From now on the world's rigid bodies push all cloths and are pushed by them. Once; throws
  /// std::logic_error the second time.
  const RigidCoupling& coupleRigidBodies(
      btDynamicsWorld& world, const RigidCouplingOptions& options = {});

  /// So many per step of the world from now on (1 … 1000000), or as largestSubstep demands.
  void setSubsteps(std::optional<int> substeps);

  /// Of the last step with cloth in it. If it isn't stable, the cloth lost its momentum and pushed
  /// no rigid body.
  const FrameReport& lastReport() const { return lastReport_; }

  /// Writes the cloths' states to their bodies.
  void showStates();

  SolverTypes getSolverType() const override { return DEFAULT_SOLVER; }

  bool checkInitialized() override { return true; }

  void optimize(btAlignedObjectArray<btSoftBody*>& softBodies, bool forceUpdate) override;
  void copyBackToSoftBodies(bool move) override;

  /// Takes over what was done to the bodies since the last step: nodes that were moved, and forces,
  /// which act all through the coming step. Throws std::invalid_argument if they aren't finite.
  void predictMotion(btScalar duration) override;
  void solveConstraints(btScalar duration) override;
  void updateSoftBodies() override;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* object) override;
  void processCollision(btSoftBody* body, btSoftBody* other) override;

 private:
  class NodeForces;

  void adoptChanges();
  int substepsOf(double duration) const;

  ClothSolverOptions options_;
  std::optional<int> substeps_;
  std::vector<std::unique_ptr<ClothBody>> bodies_;
  std::vector<std::shared_ptr<ExternalForce>> gravities_;
  std::vector<std::shared_ptr<NodeForces>> nodeForces_;
  ClothSimulation simulation_;
  RigidCoupling* coupling_ = nullptr;  ///< the simulation's
  btDefaultSoftBodySolver stock_;      ///< of the soft bodies that aren't ours
  FrameReport lastReport_;
};

}  // namespace bullet_ext
