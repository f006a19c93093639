#pragma once

#include "avatar/geometry/mesh.h"
#include "src/scene/scene.h"

#include <Eigen/Core>

#include <vector>

namespace simulcap {

/// A piece of cloth made by formula, in its local frame.
struct ProceduralCloth {
  avatar::TriangleMesh mesh;     ///< 3 × V [m]
  Eigen::Matrix2Xd coordinates;  ///< 2 × V: from left to right and from bottom to top, 0 … 1
};

/// A rectangle in the xy plane, centred, facing +z: rows of nearly equilateral triangles.
ProceduralCloth makeSheet(const ClothSheet& sheet);

/// A cylinder about the y axis, centred, facing outward, open at both ends.
ProceduralCloth makeTube(const ClothTube& tube);

/// The vertices turned about the y axis by `turns` full turns at the bottom, evenly less towards
/// the top; positive from +z towards +x.
Eigen::Matrix3Xd twisted(const ProceduralCloth& cloth, double turns);

/// Vertices of named edges ("top") and corners ("top_left") and of indices; ascending. Throws
/// std::invalid_argument for an unknown name or an index beyond the mesh.
std::vector<int> pinnedVertices(const ProceduralCloth& cloth, const std::vector<Pin>& pins);

}  // namespace simulcap
