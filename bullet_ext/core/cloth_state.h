#pragma once

#include "bullet_ext/core/cloth_mesh.h"

#include <Eigen/Core>

namespace bullet_ext {

/// Where the N vertices of a cloth are and how they move, in the mesh's solver order. Four floats
/// per vertex (x, y, z, 0), because that is what the processor loads at once. Float keeps 1e-7 of
/// the distance from the origin: at 1.5 m a vertex slower than 2e-4 m/s does not move in a substep
/// of 1/3000 s, so keep the origin near the cloth.
struct ClothState {
  Eigen::Matrix4Xf positions;   ///< 4 × N [m], row 3 is 0
  Eigen::Matrix4Xf velocities;  ///< 4 × N [m/s], row 3 is 0
};

/// The rest shape, not moving.
ClothState restState(const ClothMesh& mesh);

/// Positions and velocities, each 3 × N in the order of the mesh's input [m, m/s]. Throws
/// std::invalid_argument when a size is wrong or a value isn't finite.
ClothState stateFromInput(
    const ClothMesh& mesh, const Eigen::Matrix3Xd& positions, const Eigen::Matrix3Xd& velocities);

/// 3 × N [m] in the order of the mesh's input.
Eigen::Matrix3Xd positionsForOutput(const ClothMesh& mesh, const ClothState& state);

/// False after an explosion.
bool isFinite(const ClothState& state);

/// Σ m v²/2 [J]; pins count with their mass.
double kineticEnergy(const ClothMesh& mesh, const ClothState& state);

}  // namespace bullet_ext
