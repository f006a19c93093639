#include "avatar/geometry/mesh.h"

#include <stdexcept>
#include <string>

namespace avatar {

void requireValid(const MeshView& mesh, const char* who) {
  const std::string name(who);
  if (mesh.numFaces() > 0 &&
      (mesh.faces.minCoeff() < 0 || mesh.faces.maxCoeff() >= mesh.numVertices())) {
    throw std::invalid_argument(
        name + ": face indices must be in [0, " + std::to_string(mesh.numVertices()) +
        "), found [" + std::to_string(mesh.faces.minCoeff()) + ", " +
        std::to_string(mesh.faces.maxCoeff()) + "]");
  }
  if (!mesh.vertices.allFinite()) {
    throw std::invalid_argument(name + ": a vertex is not finite");
  }
}

}  // namespace avatar
