#include "bullet_ext/capture_world.h"

#include "bullet_ext/bullet_vector.h"
#include "bullet_ext/core/strain_constraint.h"

#include <stdexcept>
#include <utility>

namespace bullet_ext {
namespace {

ClothSolverOptions solverOptions(const CaptureSetup& setup) {
  return {.simulation = setup.simulation, .faceTreeUpdate = FaceTreeUpdate::kOnDemand};
}

Eigen::Matrix3Xd forOutput(const ClothMesh& mesh, const Eigen::Matrix4Xf& inSolverOrder) {
  return toInputOrder(mesh, Eigen::Matrix3Xd(inSolverOrder.topRows<3>().cast<double>()));
}

/// The nearest of all objects but soft bodies, which castRay() asks itself.
class RigidRayCallback final : public btCollisionWorld::ClosestRayResultCallback {
 public:
  using ClosestRayResultCallback::ClosestRayResultCallback;

  bool needsCollision(btBroadphaseProxy* proxy) const override {
    const auto* object = static_cast<const btCollisionObject*>(proxy->m_clientObject);
    return object->getInternalType() != btCollisionObject::CO_SOFT_BODY &&
           ClosestRayResultCallback::needsCollision(proxy);
  }
};

}  // namespace

/// Velocities, damping and forces of a fit, and after it, whatever happens, those from before.
class CaptureWorld::FitPass {
 public:
  /// `own` are the fit's velocities, none to begin from rest; what they are at its end goes there.
  FitPass(
      ClothSimulation& simulation,
      const std::vector<const ExternalForce*>& forces,
      const FitOptions& options,
      std::vector<Eigen::Matrix4Xf>& own)
      : simulation_(simulation), forces_(forces), own_(own) {
    const bool goesOn = !own_.empty();
    own_.resize(static_cast<std::size_t>(simulation_.numCloths()));
    for (int i = 0; i < simulation_.numCloths(); ++i) {
      ClothState state = simulation_.state(i);
      velocities_.push_back(state.velocities);
      if (goesOn)
        state.velocities = own_[static_cast<std::size_t>(i)];
      else
        state.velocities.setZero();
      simulation_.setState(i, std::move(state));
      simulation_.setDamping(i, DampingMode::kPerSubstep, options.damping);
      if (forceOn(i) != nullptr)
        simulation_.addForce(i, *forceOn(i));
    }
  }

  ~FitPass() {
    for (int i = 0; i < simulation_.numCloths(); ++i) {
      ClothState state = simulation_.state(i);
      own_[static_cast<std::size_t>(i)] = state.velocities;
      state.velocities = velocities_[static_cast<std::size_t>(i)];
      simulation_.setState(i, std::move(state));
      const ClothMaterial& material = simulation_.mesh(i).material;
      simulation_.setDamping(i, material.dampingMode, material.damping);
      if (forceOn(i) != nullptr)
        simulation_.removeForce(i, *forceOn(i));
    }
  }

  FitPass(const FitPass&) = delete;
  FitPass& operator=(const FitPass&) = delete;
  FitPass(FitPass&&) = delete;
  FitPass& operator=(FitPass&&) = delete;

 private:
  const ExternalForce* forceOn(int cloth) const { return forces_[static_cast<std::size_t>(cloth)]; }

  ClothSimulation& simulation_;
  const std::vector<const ExternalForce*>& forces_;
  std::vector<Eigen::Matrix4Xf>& own_;
  std::vector<Eigen::Matrix4Xf> velocities_;
};

CaptureWorld::CaptureWorld(const CaptureSetup& setup)
    : solver_(solverOptions(setup)),
      dispatcher_(&configuration_),
      pairs_(dispatcher_),
      world_(&dispatcher_, &broadphase_, &constraintSolver_, &configuration_, &solver_) {
  world_.setGravity(toBullet(setup.gravity));
  world_.getWorldInfo().m_gravity = toBullet(setup.gravity);
  addGarments(setup);
  if (setup.wind)
    addWind(*setup.wind);
  if (setup.strainLimit)
    solver_.simulation().addConstraint(
        std::make_unique<StrainConstraint>(solver_.simulation(), *setup.strainLimit));
  if (setup.bodyFaces.cols() > 0)
    addBody(setup);
  if (setup.rigidBodies)
    rigidCoupling_ = &solver_.coupleRigidBodies(world_);
  if (setup.selfContact || setup.garmentContact)
    addClothContact(setup);
}

void CaptureWorld::addGarments(const CaptureSetup& setup) {
  for (const CaptureGarment& garment : setup.garments) {
    ClothMesh mesh =
        buildClothMesh(garment.vertices, garment.faces, garment.material, garment.mesh);
    world_.addSoftBody(&solver_.addCloth(std::move(mesh), world_.getWorldInfo()));
  }
}

void CaptureWorld::addWind(const WindOptions& options) {
  winds_.reserve(static_cast<std::size_t>(numGarments()));
  for (int i = 0; i < numGarments(); ++i) {
    winds_.push_back(std::make_unique<Wind>(mesh(i), options));
    solver_.simulation().addForce(i, *winds_.back());
  }
}

void CaptureWorld::addBody(const CaptureSetup& setup) {
  surface_ = std::make_unique<BodySurface>(setup.bodyFaces, setup.numBodyVertices);
  body_ = std::make_unique<KinematicBody>(*surface_, world_);
  if (!setup.bodyContact || setup.garments.empty())
    return;
  auto contact = std::make_unique<BodyConstraint>(solver_.simulation(), *surface_);
  bodyContact_ = contact.get();
  solver_.simulation().addConstraint(std::move(contact));
}

/// After all other contacts: it makes sure that no cloth has been pushed through cloth.
void CaptureWorld::addClothContact(const CaptureSetup& setup) {
  std::vector<ContactGarment> garments;
  garments.reserve(setup.garments.size());
  for (int i = 0; i < numGarments(); ++i)
    garments.push_back(
        {.mesh = &mesh(i),
         .layer = setup.garments[static_cast<std::size_t>(i)].layer,
         .thickness = mesh(i).material.thickness,
         .friction = mesh(i).material.friction});
  auto contact = std::make_unique<ClothContact>(
      garments,
      ClothContactOptions{
          .self = setup.selfContact,
          .between = setup.garmentContact,
          .interval = setup.contactInterval},
      &solver_.simulation().team());
  clothContact_ = contact.get();
  solver_.simulation().addConstraint(std::move(contact));
}

void CaptureWorld::setState(
    int garment, const Eigen::Matrix3Xd& positions, const Eigen::Matrix3Xd& velocities) {
  solver_.simulation().setState(garment, stateFromInput(mesh(garment), positions, velocities));
  solver_.body(garment).mirror(solver_.simulation().state(garment));
}

void CaptureWorld::movePins(int garment, const Eigen::Matrix3Xd& positions) {
  PinTargets targets{.positions = positions};
  for (int v = 0; v < mesh(garment).numVertices(); ++v) {
    const int vertex = mesh(garment).solverFromInput[static_cast<std::size_t>(v)];
    if (mesh(garment).isPinned(vertex))
      targets.vertices.push_back(vertex);
  }
  solver_.simulation().setPinTargets(garment, std::move(targets));
}

void CaptureWorld::requireBody(const Eigen::Matrix3Xd& vertices) const {
  if (vertices.cols() != (surface_ ? surface_->numVertices() : 0))
    throw std::invalid_argument("CaptureWorld: the body has another number of vertices");
}

void CaptureWorld::moveBody(const Eigen::Matrix3Xd& vertices, double duration) {
  if (!surface_)
    return;
  surface_->setFrame(bodyVertices_.cols() == 0 ? vertices : bodyVertices_, vertices, duration);
  bodyVertices_ = vertices;
  body_->followSurface();
}

void CaptureWorld::placeBody(const Eigen::Matrix3Xd& vertices) {
  requireBody(vertices);
  bodyVertices_ = vertices;
}

FrameReport CaptureWorld::step(
    const Eigen::Matrix3Xd& bodyVertices, double duration, int substeps) {
  FrameTiming{duration, substeps}.validate();
  requireBody(bodyVertices);
  moveBody(bodyVertices, duration);
  solver_.setSubsteps(substeps);
  world_.stepSimulation(static_cast<btScalar>(duration), 0);
  for (int i = 0; i < numGarments(); ++i)
    solver_.simulation().setPinTargets(i, {});
  return solver_.lastReport();
}

FrameReport CaptureWorld::fit(
    const std::vector<const ExternalForce*>& forces, const FitOptions& options) {
  if (static_cast<int>(forces.size()) != numGarments())
    throw std::invalid_argument("CaptureWorld: a fit needs one force per garment, or null");
  const FrameTiming timing{options.iterations * options.substepDuration, options.iterations};
  timing.validate();
  if (!(options.damping >= 0.0 && options.damping <= 1.0))
    throw std::invalid_argument("FitOptions: damping must be within [0, 1] per substep");
  if (surface_ && surface_->numFrames() == 0)
    throw std::logic_error("CaptureWorld: nobody knows where the body is before the first step");
  moveBody(bodyVertices_, timing.duration);
  FrameReport report;
  {
    if (!options.goesOn)
      fitVelocities_.clear();
    const FitPass pass(solver_.simulation(), forces, options, fitVelocities_);
    report = solver_.simulation().advance(timing);
  }
  solver_.showStates();
  return report;
}

Eigen::Matrix3Xd CaptureWorld::vertices(int garment) const {
  return forOutput(mesh(garment), solver_.simulation().state(garment).positions);
}

Eigen::Matrix3Xd CaptureWorld::velocities(int garment) const {
  return forOutput(mesh(garment), solver_.simulation().state(garment).velocities);
}

std::optional<RayHit> CaptureWorld::castRay(
    const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  std::optional<RayHit> nearest;
  RigidRayCallback rigid(toBullet(from), toBullet(to));
  world_.rayTest(rigid.m_rayFromWorld, rigid.m_rayToWorld, rigid);
  if (rigid.hasHit())
    nearest = {
        .fraction = double{rigid.m_closestHitFraction},
        .normal = fromBullet(rigid.m_hitNormalWorld).cast<double>(),
        .object = rigid.m_collisionObject};
  for (int i = 0; i < numGarments(); ++i) {
    const std::optional<ClothRayHit> hit = solver_.body(i).castRay(from, to);
    if (hit && (!nearest || hit->fraction < nearest->fraction))
      nearest = {
          .fraction = hit->fraction,
          .normal = hit->normal,
          .garment = i,
          .vertices = hit->vertices,
          .object = &solver_.body(i)};
  }
  if (nearest)
    nearest->point = from + nearest->fraction * (to - from);
  return nearest;
}

void CaptureWorld::draw(btIDebugDraw& drawer) {
  world_.setDebugDrawer(&drawer);
  world_.debugDrawWorld();
  world_.setDebugDrawer(nullptr);
}

}  // namespace bullet_ext
