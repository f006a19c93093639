#pragma once

#include "bullet_ext/cloth_solver.h"
#include "bullet_ext/collision_pairs.h"
#include "bullet_ext/core/body_constraint.h"
#include "bullet_ext/core/body_surface.h"
#include "bullet_ext/core/cloth_contact.h"
#include "bullet_ext/core/strain_limit.h"
#include "bullet_ext/core/wind_force.h"
#include "bullet_ext/kinematic_body.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <Eigen/Core>

#include <memory>
#include <optional>
#include <vector>

namespace bullet_ext {

/// One piece of clothing: N vertices, F faces.
struct CaptureGarment {
  Eigen::Matrix3Xd vertices;  ///< 3 × N [m]: the rest shape
  Eigen::Matrix3Xi faces;     ///< 3 × F
  ClothMaterial material;
  ClothMeshOptions mesh;  ///< pins, and what is not the same everywhere
  int layer = 0;          ///< 0 = next to the skin
};

/// What there is in a capture. What isn't named is not built and costs nothing.
struct CaptureSetup {
  std::vector<CaptureGarment> garments;
  Eigen::Matrix3Xi bodyFaces;        ///< 3 × F; none: no body
  Eigen::Index numBodyVertices = 0;  ///< V
  bool bodyContact = true;           ///< cloth stays outside the body, if there is one
  bool selfContact = false;          ///< garments don't pass through themselves
  bool garmentContact = false;       ///< nor through each other
  double contactInterval = 0.0;      ///< [s], of both: ClothContactOptions::interval
  bool rigidBodies = false;          ///< rigid bodies of bulletWorld() push cloth and are pushed
  Eigen::Vector3d gravity = Eigen::Vector3d(0.0, -9.81, 0.0);  ///< [m/s²]
  std::optional<WindOptions> wind;
  std::optional<StrainLimitOptions> strainLimit;
  SimulationOptions simulation;
};

/// SimulCap's fitting pass (4.2.2): the paper's number, substep and damping of v ← 0.9 v.
struct FitOptions {
  int iterations = 100;                   ///< 1 … 1000000 substeps
  double substepDuration = 1.0 / 3000.0;  ///< [s]
  double damping = 0.1;                   ///< per substep, 0 … 1
  bool goesOn = false;  ///< with the velocities at the end of the last fit, not from rest
};

/// What a ray meets first.
struct RayHit {
  double fraction = 1.0;                             ///< of the way from its start to its end
  Eigen::Vector3d point = Eigen::Vector3d::Zero();   ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit
  int garment = -1;  ///< −1: not a garment, but the body or a rigid body
  Eigen::Vector3i vertices = Eigen::Vector3i::Constant(-1);  ///< of the garment's triangle
  const btCollisionObject* object = nullptr;
};

/// A tracked person's clothes in a Bullet world, moved frame by frame. All matrices have the order
/// of the input, one column per vertex, in metres and seconds.
class CaptureWorld {
 public:
  /// Cloth at rest in its rest shape. Throws std::invalid_argument for a garment that can't be
  /// built (cloth_mesh.h), body faces that can't, or an option outside its range.
  explicit CaptureWorld(const CaptureSetup& setup);

  int numGarments() const { return solver_.simulation().numCloths(); }

  /// Puts a garment elsewhere; both 3 × N.
  void setState(int garment, const Eigen::Matrix3Xd& positions, const Eigen::Matrix3Xd& velocities);

  /// Where the garment's pins (ascending, as in ClothMeshOptions) are after the next step, 3 ×
  /// pins; they stay there until they are moved again.
  void movePins(int garment, const Eigen::Matrix3Xd& positions);

  /// Where the body is before the first step. 3 × V; throws std::invalid_argument for a wrong size
  /// or a coordinate out of range.
  void placeBody(const Eigen::Matrix3Xd& vertices);

  /// One frame of `duration` [s] in Bullet's stepSimulation, with the body (3 × V at the frame's
  /// end) moving there on straight lines from where it is (without placeBody(), in the first frame
  /// it is there already). 3 × 0 without a body. Throws std::invalid_argument for a wrong size, a
  /// coordinate or a number out of range, and changes nothing then.
  FrameReport step(const Eigen::Matrix3Xd& bodyVertices, double duration, int substeps);

  /// Lets extra forces (one per garment, null: none) pull the cloth with the body and rigid bodies
  /// at rest where they are. Velocities are zero at its beginning, unless it goes on with the last
  /// one, and those from before at its end: what a fit moves has no momentum. Throws
  /// std::invalid_argument for another number of forces or options out of range, std::logic_error
  /// when there is a body but was no step().
  FrameReport fit(const std::vector<const ExternalForce*>& forces, const FitOptions& options = {});

  Eigen::Matrix3Xd vertices(int garment) const;    ///< 3 × N [m]
  Eigen::Matrix3Xd velocities(int garment) const;  ///< 3 × N [m/s]

  /// In solver order, for those who make forces.
  const ClothMesh& mesh(int garment) const { return solver_.simulation().mesh(garment); }

  /// Garments, body and rigid bodies; nothing if the ray meets none.
  std::optional<RayHit> castRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  /// Everything, as the drawer's debug mode wants it.
  void draw(btIDebugDraw& drawer);

  /// For rigid bodies and whatever else a game has; what is added must be removed before the end.
  btSoftRigidDynamicsWorld& bulletWorld() { return world_; }

  /// The parts that the setup asked for; null: not built.
  const BodySurface* bodySurface() const { return surface_.get(); }

  const BodyConstraint* bodyContact() const { return bodyContact_; }

  const ClothContact* clothContact() const { return clothContact_; }

  const RigidCoupling* rigidCoupling() const { return rigidCoupling_; }

 private:
  class FitPass;

  void addGarments(const CaptureSetup& setup);
  void addWind(const WindOptions& options);
  void addBody(const CaptureSetup& setup);
  void addClothContact(const CaptureSetup& setup);
  void moveBody(const Eigen::Matrix3Xd& vertices, double duration);
  void requireBody(const Eigen::Matrix3Xd& vertices) const;

  std::vector<std::unique_ptr<Wind>> winds_;  // one per garment; none without wind
  ClothSolver solver_;  // before the world, which lets go of the cloth when it ends
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  CollisionPairs pairs_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver constraintSolver_;
  btSoftRigidDynamicsWorld world_;
  std::unique_ptr<BodySurface> surface_;
  std::unique_ptr<KinematicBody> body_;
  std::vector<Eigen::Matrix4Xf> fitVelocities_;  ///< at the end of the last fit, per garment
  Eigen::Matrix3Xd bodyVertices_;                ///< 3 × V [m] at the end of the last frame
  const BodyConstraint* bodyContact_ = nullptr;
  const ClothContact* clothContact_ = nullptr;
  const RigidCoupling* rigidCoupling_ = nullptr;
};

}  // namespace bullet_ext
