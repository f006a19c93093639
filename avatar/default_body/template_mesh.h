#pragma once

#include "avatar/default_body/body_field.h"
#include "avatar/geometry/mesh.h"

#include <vector>

namespace avatar {

/// A closed mesh that is its own mirror image in x = 0.
struct SymmetricMesh {
  TriangleMesh mesh;
  std::vector<int> mirrorVertex;  ///< V entries: the vertex on the other side (itself at x = 0)
};

/// The anatomy as a mesh of about 7000 vertices, finer at face, hands and feet: the half x ≥ 0 is
/// polygonised, remeshed to the local edge length, moved onto the field, and mirrored.
SymmetricMesh makeTemplateMesh(const BodyField& field);

}  // namespace avatar
