#include "bullet_ext/cloth_solver.h"

#include "bullet_ext/core/stability.h"

#include <stdexcept>
#include <utility>

namespace bullet_ext {
namespace {

bool isCloth(const btSoftBody* body) {
  return dynamic_cast<const ClothBody*>(body) != nullptr;
}

}  // namespace

/// What Bullet's addForce() left in the nodes of a cloth; nothing most of the time.
class ClothSolver::NodeForces final : public ExternalForce {
 public:
  void takeFrom(ClothBody& body) { any_ = body.takeForces(forces_); }

  void addTo(
      Eigen::Matrix4Xf& forces, const ClothState& /*state*/, VertexRange range) const override {
    if (!any_)
      return;
    const Eigen::Index count = range.end - range.begin;
    forces.middleCols(range.begin, count) += forces_.middleCols(range.begin, count);
  }

 private:
  bool any_ = false;
  Eigen::Matrix4Xf forces_;  ///< 4 × N [N], solver order
};

void ClothSolverOptions::validate() const {
  simulation.validate();
  if (!(largestSubstep >= 1e-6 && largestSubstep <= 1.0))
    throw std::invalid_argument("ClothSolverOptions: largestSubstep must be within [1e-6, 1] s");
}

ClothSolver::ClothSolver(const ClothSolverOptions& options)
    : options_((options.validate(), options)), simulation_(options.simulation) {}

ClothBody& ClothSolver::addCloth(ClothMesh mesh, btSoftBodyWorldInfo& worldInfo) {
  bodies_.push_back(std::make_unique<ClothBody>(mesh, worldInfo, options_.faceTreeUpdate));
  nodeForces_.push_back(std::make_shared<NodeForces>());
  const btVector3& g = worldInfo.m_gravity;
  if (!g.isZero())
    gravities_.push_back(
        std::make_shared<Gravity>(mesh, Eigen::Vector3f(g.x(), g.y(), g.z()).cast<double>()));
  const int cloth = simulation_.addCloth(std::move(mesh));
  simulation_.addForce(cloth, *nodeForces_.back());
  if (!g.isZero())
    simulation_.addForce(cloth, *gravities_.back());
  return *bodies_.back();
}

const RigidCoupling& ClothSolver::coupleRigidBodies(
    btDynamicsWorld& world, const RigidCouplingOptions& options) {
  if (coupling_ != nullptr)
    throw std::logic_error("ClothSolver: rigid bodies are coupled already");
  auto coupling = std::make_unique<RigidCoupling>(*this, world, options);
  coupling_ = coupling.get();
  simulation_.addConstraint(std::move(coupling));
  return *coupling_;
}

void ClothSolver::setSubsteps(std::optional<int> substeps) {
  if (substeps && (*substeps < 1 || *substeps > 1000000))
    throw std::invalid_argument("ClothSolver: substeps must be within [1, 1000000]");
  substeps_ = substeps;
}

/// A step of 1/30 s in float is longer than that; 1e-6 of a substep doesn't call for another one.
int ClothSolver::substepsOf(double duration) const {
  return substeps_ ? *substeps_ : substepsFor(duration * (1.0 - 1e-6), options_.largestSubstep);
}

void ClothSolver::showStates() {
  for (int i = 0; i < simulation_.numCloths(); ++i)
    body(i).mirror(simulation_.state(i));
}

void ClothSolver::adoptChanges() {
  for (int i = 0; i < simulation_.numCloths(); ++i) {
    ClothState state = simulation_.state(i);
    if (body(i).adoptChanges(state) > 0)
      simulation_.setState(i, std::move(state));
    nodeForces_[static_cast<std::size_t>(i)]->takeFrom(body(i));
  }
}

void ClothSolver::optimize(btAlignedObjectArray<btSoftBody*>& softBodies, bool forceUpdate) {
  btAlignedObjectArray<btSoftBody*> others;
  for (int i = 0; i < softBodies.size(); ++i) {
    if (!isCloth(softBodies[i]))
      others.push_back(softBodies[i]);
  }
  stock_.optimize(others, forceUpdate);
}

void ClothSolver::copyBackToSoftBodies(bool move) {
  stock_.copyBackToSoftBodies(move);
}

void ClothSolver::predictMotion(btScalar duration) {
  stock_.predictMotion(duration);
  adoptChanges();
  if (coupling_ != nullptr)
    coupling_->beginStep();
}

void ClothSolver::solveConstraints(btScalar duration) {
  stock_.solveConstraints(duration);
  if (simulation_.numCloths() == 0)
    return;
  lastReport_ = simulation_.advance({double{duration}, substepsOf(double{duration})});
  if (coupling_ != nullptr)
    coupling_->endStep(lastReport_.stable);
}

void ClothSolver::updateSoftBodies() {
  stock_.updateSoftBodies();
  showStates();
}

void ClothSolver::processCollision(btSoftBody* body, const btCollisionObjectWrapper* object) {
  if (!isCloth(body))
    stock_.processCollision(body, object);
}

void ClothSolver::processCollision(btSoftBody* body, btSoftBody* other) {
  if (!isCloth(body) && !isCloth(other))
    stock_.processCollision(body, other);
}

}  // namespace bullet_ext
