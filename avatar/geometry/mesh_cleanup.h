#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/Core>

#include <vector>

namespace avatar {

/// What a step of the cleaning made of a mesh. Vertices and faces that stay keep their order, a
/// merged vertex the place and the position of its first occurrence.
struct CleanedMesh {
  TriangleMesh mesh;
  std::vector<int> vertexOfInput;  ///< one entry per input vertex: its new index, −1 = dropped
  int weldedVertices = 0;          ///< merged into an earlier one
  int unreferencedVertices = 0;    ///< dropped: no face names them
  int degenerateFaces = 0;         ///< dropped: without area
  int duplicateFaces = 0;          ///< dropped: the same three vertices as an earlier face
  int turnedFaces = 0;             ///< faces whose orientation was reversed
};

/// Merges vertices at the same position (seams of texture or normals, exporters without shared
/// vertices): each into the first vertex within the tolerance [m, ≥ 0; 0: exactly equal] that was
/// not merged itself. So vertices that stay are further apart than the tolerance, and none moves
/// by more. Faces may become degenerate. Throws std::invalid_argument on an invalid mesh or
/// tolerance.
CleanedMesh weldVertices(const MeshView& mesh, double tolerance);

/// Drops faces that name a vertex twice or whose height is below 1e-8 of their longest edge (the
/// rounding of single precision): they have no normal. Throws as weldVertices().
CleanedMesh dropDegenerateFaces(const MeshView& mesh);

/// Drops faces with the same vertices as an earlier one, whichever way round: cloth has one layer
/// of faces, not one per side. Throws as weldVertices().
CleanedMesh dropDuplicateFaces(const MeshView& mesh);

/// Drops vertices that no face names. Throws as weldVertices().
CleanedMesh dropUnreferencedVertices(const MeshView& mesh);

/// Turns faces until neighbours agree; of the faces connected over edges, the larger half stays
/// as it is. Faces around edges of three faces and on one-sided surfaces (Möbius) cannot all agree.
/// Throws as weldVertices(), and when a face names a vertex twice.
CleanedMesh orientFaces(const MeshView& mesh);

/// All of the above in that order.
CleanedMesh cleanMesh(const MeshView& mesh, double weldTolerance = 0.0);

/// The parts connected over shared vertices, the largest area first; vertices without faces are
/// left out. Throws as weldVertices(), and when a face names a vertex twice.
std::vector<TriangleMesh> connectedParts(const MeshView& mesh);

}  // namespace avatar
