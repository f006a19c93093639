#pragma once

#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/rigid_motion.h"
#include "bullet_ext/rigid_shape.h"

#include <BulletDynamics/Dynamics/btDynamicsWorld.h>
#include <Eigen/Core>

#include <optional>
#include <span>
#include <vector>

namespace bullet_ext {

class ClothSolver;

struct RigidCouplingOptions {
  /// Vertices nearer to a body than their thickness and this [m] are watched, 1e-4 … 1. What is
  /// looked at in every substep grows with it, how often lists are made shrinks.
  double skin = 0.02;
  /// How fast a vertex nearer than its thickness is lifted at most [m/s], 0 … 100,
  double recoverySpeed = 0.5;
  double recovery = 0.2;  ///< and which part of the lack in a substep, 0 … 1

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// What there was to do, from the coupling's beginning.
struct RigidCouplingCounters {
  long listsMade = 0;
  long distances = 0;  ///< of a vertex from a body
  long impulses = 0;
};

/// Rigid bodies of a Bullet world push cloth and are pushed by it, vertex by vertex.
///
/// In a step, Bullet moves the rigid bodies first. Here they go the same way again along with the
/// cloth's substeps, and what the cloth does to them changes their way at once, so a light ball
/// bounces off within a step instead of passing through. In each substep a vertex that starts at
/// distance d from the body (thickness h, relative velocity v at the vertex, n along the distance)
/// gets the impulse j n that v·n ≥ −(d − h)/dt needs: it arrives at h, and not beyond. Coulomb
/// friction of at most μj, μ the product of both frictions as Bullet has it, slows the sliding. The
/// body gets the opposite impulse at the same point x. Then both move through the substep with
/// their new velocities. As x + dt v' has the same moment of velocity as x, this keeps angular
/// momentum as it keeps momentum. Inelastic.
///
/// Only vertices are tested: what is finer than a mesh may slip through it, such as corners of
/// boxes. Bodies and cloth whose collision filters exclude each other, ignored objects of the cloth
/// and objects without contact response don't touch; KinematicBody is left to BodyContact.
class RigidCoupling final : public SubstepConstraint {
 public:
  /// Keeps references; made by ClothSolver::coupleRigidBodies(). Throws std::invalid_argument for
  /// an option outside its range.
  RigidCoupling(
      const ClothSolver& solver, btDynamicsWorld& world, const RigidCouplingOptions& options = {});

  /// With all bodies where the world's step begins.
  void beginStep();

  /// Throws std::invalid_argument for a body of a shape that cloth can't touch (rigid_shape.h).
  /// Without a beginStep() before, bodies are at rest where they are, and too heavy to be moved.
  void beginFrame(std::span<const ClothState> states, const FrameTiming& timing) override;
  void resolve(std::span<ClothState> states, int substep) override;

  /// Ends the world's step. If `moveBodies`, they get the poses and velocities that they have now;
  /// a body that sleeps is woken only by what is faster than it may sleep with.
  void endStep(bool moveBodies);

  const RigidCouplingCounters& counters() const { return counters_; }

 private:
  struct Body {
    btCollisionObject* object = nullptr;
    RigidMotion motion;
    double radius = 0.0;  ///< all of the shape is within [m]; 0 for those that don't move
    double travel = 0.0;  ///< longest way of any of its points up to now [m]
    std::optional<RigidShape> shape;  ///< from the first cloth that comes near
  };

  struct Cloth {
    Eigen::Matrix4Xf lastPositions;  ///< 4 × N [m]
    double travel = 0.0;             ///< longest way of any vertex up to now [m]
    double lookahead = 0.0;          ///< of any vertex in the next substep [m]
  };

  /// Vertices of a cloth that may touch a body while both travel no farther than `slack` together.
  struct Pair {
    int cloth = 0;
    int body = 0;
    std::vector<int> vertices;
    double slack = -1.0;  ///< [m]
    double madeAt = 0.0;  ///< travel of both then [m]
  };

  struct VertexContact;

  struct StartPose {
    const btCollisionObject* object;
    btTransform transform;
  };

  btTransform startOf(const btCollisionObject& object, int index) const;
  void addBody(btCollisionObject& object, const btTransform& start);
  bool mayTouch(int cloth, const btCollisionObject& object) const;
  void followCloth(Cloth& cloth, const ClothState& state) const;
  void makeList(Pair& pair, const ClothState& state);
  VertexContact contactOf(const Pair& pair, int vertex, const ClothState& state) const;
  void resolvePair(const Pair& pair, ClothState& state);
  double lookahead(const Body& body) const;

  const ClothSolver& solver_;
  btDynamicsWorld& world_;
  RigidCouplingOptions options_;
  std::vector<StartPose> starts_;
  bool inStep_ = false;
  FrameTiming timing_;
  std::vector<Body> bodies_;
  std::vector<Cloth> cloths_;
  std::vector<Pair> pairs_;
  RigidCouplingCounters counters_;
};

}  // namespace bullet_ext
