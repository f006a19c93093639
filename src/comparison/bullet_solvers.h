#pragma once

#include "src/comparison/solver_under_test.h"

#include <memory>

namespace simulcap {

/// Stock Bullet: cloths as btSoftBody in a btSoftRigidDynamicsWorld. Every edge is a link, and
/// generateBendingConstraints(2) links vertices two edges apart. Positions are projected link by
/// link, `iterations` times per step: stiffness comes from their number, unless a link's part per
/// visit (kLST) takes it back. Here it is chosen so that all visits of a step together leave of a
/// single spring's strain what backward Euler with the scene's k/2 [N/m] would. Bending links are
/// distance springs that take the same; w has no equal. Damping is exact, pins may move.
std::unique_ptr<ClothSolverUnderTest> makeBulletSoftBody(
    const ComparisonTask& task, const SolverSettings& settings);

/// Stock Bullet: the same links as springs of k/2 [N/m] (btDeformableMassSpringForce) in an
/// explicit btDeformableMultiBodyDynamicsWorld, bending ones included; w has no equal. Bullet holds
/// vertices without mass where they are, so pins don't move.
std::unique_ptr<ClothSolverUnderTest> makeBulletDeformable(
    const ComparisonTask& task, const SolverSettings& settings);

}  // namespace simulcap
