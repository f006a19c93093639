#include "src/comparison/bullet_solvers.h"

#include "bullet_ext/bullet_vector.h"
#include "src/simulation/cloth_setup.h"

#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

using bullet_ext::ClothMesh;
using bullet_ext::fromBullet;
using bullet_ext::toBullet;

constexpr int kBendingReach = 2;  // edges between the ends of a bending link

/// Share of the velocity that a step of duration dt [s] takes away.
double dampedShare(const StagedCloth& cloth, double dt) {
  const avatar::ClothParameters& parameters = cloth.parameters;
  return parameters.dampingMode == avatar::DampingMode::kPerSubstep
             ? parameters.damping
             : 1.0 - std::exp(-parameters.damping * dt);
}

/// kLST such that `iterations` visits of a single spring between two free vertices of mass m leave
/// of its strain what one step of backward Euler leaves: 1/(1 + 2 dt² (k/2)/m).
double linkStiffness(const ClothMesh& mesh, double dt, int iterations) {
  const double stiffness = 0.5 * mesh.springStiffness.mean();
  const double left = 1.0 / (1.0 + 2.0 * dt * dt * stiffness / mesh.masses.mean());
  return 1.0 - std::pow(left, 1.0 / iterations);
}

/// Nodes, links, faces and bending links of a cloth at rest, which is then moved to its start.
std::unique_ptr<btSoftBody> makeBody(
    const StagedCloth& cloth, const ClothMesh& mesh, btSoftBodyWorldInfo& info, double kLst) {
  auto body = std::make_unique<btSoftBody>(&info);
  btSoftBody::Material* material = body->appendMaterial();
  material->m_kLST = static_cast<btScalar>(kLst);
  material->m_kAST = material->m_kVST = 1;
  material->m_flags = btSoftBody::fMaterial::Default;
  const auto inputIndex = [&mesh](int vertex) {
    return mesh.inputFromSolver[static_cast<std::size_t>(vertex)];
  };
  for (Eigen::Index v = 0; v < cloth.rest.numVertices(); ++v) {
    const int vertex = mesh.solverFromInput[static_cast<std::size_t>(v)];
    body->appendNode(toBullet(Eigen::Vector3d(cloth.rest.vertices.col(v))), 1);
    body->setMass(
        static_cast<int>(v),
        mesh.isPinned(vertex) ? btScalar(0) : static_cast<btScalar>(mesh.masses[vertex]));
  }
  for (const auto& spring : mesh.springs.colwise())
    body->appendLink(inputIndex(spring[0]), inputIndex(spring[1]), material);
  for (const auto& face : cloth.rest.faces.colwise())
    body->appendFace(face[0], face[1], face[2]);
  body->generateBendingConstraints(kBendingReach, material);
  body->updateConstants();  // rest lengths, from the rest shape
  body->m_bUpdateRtCst = false;
  body->m_cfg.collisions = 0;
  body->setActivationState(DISABLE_DEACTIVATION);
  for (int i = 0; i < body->m_nodes.size(); ++i)
    body->m_nodes[i].m_x = body->m_nodes[i].m_q = toBullet(Eigen::Vector3d(cloth.start.col(i)));
  return body;
}

/// What both worlds stand on.
struct BulletBase {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
};

Eigen::Matrix3Xd positionsOf(const btSoftBody& body) {
  Eigen::Matrix3Xd result(3, body.m_nodes.size());
  for (int i = 0; i < body.m_nodes.size(); ++i)
    result.col(i) = fromBullet(body.m_nodes[i].m_x).cast<double>();
  return result;
}

class SoftBodySolver final : public ClothSolverUnderTest {
 public:
  SoftBodySolver(const ComparisonTask& task, const SolverSettings& settings)
      : task_(task),
        stepsPerFrame_(settings.stepsPerFrame),
        stepDuration_(task.frameDuration() / settings.stepsPerFrame) {
    const btVector3 gravity = toBullet(task.scene.gravity);
    world_.setGravity(gravity);
    world_.getWorldInfo().m_gravity = gravity;
    for (const StagedCloth& cloth : task.stage.cloths) {
      const ClothMesh mesh = clothMesh(cloth);
      const double kLst = linkStiffness(mesh, stepDuration_, settings.iterations);
      bodies_.push_back(makeBody(cloth, mesh, world_.getWorldInfo(), kLst));
      bodies_.back()->m_cfg.piterations = settings.iterations;
      bodies_.back()->m_cfg.kDP = static_cast<btScalar>(dampedShare(cloth, stepDuration_));
      world_.addSoftBody(bodies_.back().get());
    }
  }

  ~SoftBodySolver() override {
    for (const auto& body : bodies_)
      world_.removeSoftBody(body.get());
  }

  SoftBodySolver(const SoftBodySolver&) = delete;
  SoftBodySolver& operator=(const SoftBodySolver&) = delete;
  SoftBodySolver(SoftBodySolver&&) = delete;
  SoftBodySolver& operator=(SoftBodySolver&&) = delete;

  bool advance() override {
    ++frame_;
    for (int step = 0; step < stepsPerFrame_; ++step) {
      movePins(step);
      world_.stepSimulation(static_cast<btScalar>(stepDuration_), 0);
    }
    return true;
  }

  Eigen::Matrix3Xd vertices(int cloth) const override {
    return positionsOf(*bodies_[static_cast<std::size_t>(cloth)]);
  }

 private:
  /// Pins have no mass: Bullet moves them with the velocity that they have.
  void movePins(int step) {
    const double left = (stepsPerFrame_ - step) * stepDuration_;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const StagedCloth& cloth = task_.stage.cloths[i];
      const Eigen::Matrix3Xd targets = task_.pinsAt(cloth, frame_);
      for (std::size_t p = 0; p < cloth.pins.size(); ++p) {
        btSoftBody::Node& node = bodies_[i]->m_nodes[cloth.pins[p]];
        const Eigen::Vector3d target = targets.col(static_cast<Eigen::Index>(p));
        node.m_v = (toBullet(target) - node.m_x) / static_cast<btScalar>(left);
      }
    }
  }

  ComparisonTask task_;
  int stepsPerFrame_;
  double stepDuration_;
  BulletBase base_;
  btSequentialImpulseConstraintSolver rigidSolver_;
  btSoftRigidDynamicsWorld world_{
      &base_.dispatcher, &base_.broadphase, &rigidSolver_, &base_.configuration};
  std::vector<std::unique_ptr<btSoftBody>> bodies_;
  int frame_ = 0;
};

class DeformableSolver final : public ClothSolverUnderTest {
 public:
  DeformableSolver(const ComparisonTask& task, const SolverSettings& settings)
      : stepsPerFrame_(settings.stepsPerFrame),
        stepDuration_(task.frameDuration() / settings.stepsPerFrame),
        gravity_(toBullet(task.scene.gravity)) {
    contactSolver_.setDeformableSolver(&deformableSolver_);
    world_.setImplicit(false);
    world_.setLineSearch(false);
    world_.setGravity(toBullet(task.scene.gravity));
    world_.getWorldInfo().m_gravity = toBullet(task.scene.gravity);
    for (const StagedCloth& cloth : task.stage.cloths)
      add(cloth);
  }

  ~DeformableSolver() override {
    for (const auto& body : bodies_)
      world_.removeSoftBody(body.get());
  }

  DeformableSolver(const DeformableSolver&) = delete;
  DeformableSolver& operator=(const DeformableSolver&) = delete;
  DeformableSolver(DeformableSolver&&) = delete;
  DeformableSolver& operator=(DeformableSolver&&) = delete;

  bool advance() override {
    for (int step = 0; step < stepsPerFrame_; ++step) {
      world_.stepSimulation(static_cast<btScalar>(stepDuration_), 0);
      damp();
    }
    return true;
  }

  Eigen::Matrix3Xd vertices(int cloth) const override {
    return positionsOf(*bodies_[static_cast<std::size_t>(cloth)]);
  }

 private:
  void add(const StagedCloth& cloth) {
    const ClothMesh mesh = clothMesh(cloth);
    bodies_.push_back(makeBody(cloth, mesh, world_.getWorldInfo(), 1.0));
    remaining_.push_back(static_cast<btScalar>(1.0 - dampedShare(cloth, stepDuration_)));
    // Bullet keeps one force of each kind for all its bodies, with the stiffness of the first.
    if (!springs_) {
      const auto stiffness = static_cast<btScalar>(0.5 * mesh.springStiffness.mean());
      springs_ = std::make_unique<btDeformableMassSpringForce>(stiffness, btScalar(0), true);
    }
    world_.addSoftBody(bodies_.back().get());
    world_.addForce(bodies_.back().get(), springs_.get());
    world_.addForce(bodies_.back().get(), &gravity_);
  }

  /// Bullet damps springs and not motion: drag as the other solvers have it.
  void damp() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      for (int node = 0; node < bodies_[i]->m_nodes.size(); ++node)
        bodies_[i]->m_nodes[node].m_v *= remaining_[i];
    }
  }

  int stepsPerFrame_;
  double stepDuration_;
  BulletBase base_;
  btDeformableBodySolver deformableSolver_;
  btDeformableMultiBodyConstraintSolver contactSolver_;
  btDeformableGravityForce gravity_;
  std::unique_ptr<btDeformableMassSpringForce> springs_;
  btDeformableMultiBodyDynamicsWorld world_{
      &base_.dispatcher,
      &base_.broadphase,
      &contactSolver_,
      &base_.configuration,
      &deformableSolver_};
  std::vector<std::unique_ptr<btSoftBody>> bodies_;
  std::vector<btScalar> remaining_;  // of the velocity after a step, per body
};

}  // namespace

std::unique_ptr<ClothSolverUnderTest> makeBulletSoftBody(
    const ComparisonTask& task, const SolverSettings& settings) {
  return std::make_unique<SoftBodySolver>(task, settings);
}

std::unique_ptr<ClothSolverUnderTest> makeBulletDeformable(
    const ComparisonTask& task, const SolverSettings& settings) {
  return std::make_unique<DeformableSolver>(task, settings);
}

}  // namespace simulcap
