#include "avatar/geometry/mesh_cleanup.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/element_index.h"
#include "avatar/geometry/measures.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

namespace avatar {
namespace {

/// Vertices by the cube of space that they lie in. Only asked, never walked through, so the order
/// of its buckets does not matter.
class SpatialHash {
 public:
  explicit SpatialHash(double cellSize) : cellSize_(cellSize) {}

  using Cell = Eigen::Array3d;  // whole numbers

  Cell cellOf(const Eigen::Vector3d& point) const {
    // + 0: −0 and 0 are one cell, but differ in their bits.
    return (point.array() / cellSize_).floor() + 0.0;
  }

  void insert(const Cell& cell, int vertex) { cells_[cell].push_back(vertex); }

  /// Ascending when inserted so; null: empty.
  const std::vector<int>* find(const Cell& cell) const {
    const auto found = cells_.find(cell);
    return found == cells_.end() ? nullptr : &found->second;
  }

 private:
  struct Hash {
    std::size_t operator()(const Cell& cell) const {
      std::size_t hash = 0;
      for (int axis = 0; axis < 3; ++axis) {
        hash = hash * std::size_t{0x9E3779B97F4A7C15} + std::hash<double>()(cell[axis]);
      }
      return hash;
    }
  };

  struct Same {
    bool operator()(const Cell& a, const Cell& b) const { return (a == b).all(); }
  };

  double cellSize_;
  std::unordered_map<Cell, std::vector<int>, Hash, Same> cells_;
};

/// Finds, vertex by vertex, the first one that stays within the tolerance.
class Welder {
 public:
  Welder(const Eigen::Matrix3Xd& vertices, double tolerance)
      : vertices_(vertices),
        tolerance_(tolerance),
        reach_(tolerance > 0.0 ? 1 : 0),
        hash_(tolerance > 0.0 ? tolerance : kExactCell) {}

  /// The first vertex of each vertex' group, itself when it stays.
  std::vector<int> run() {
    std::vector<int> first(at(vertices_.cols()));
    for (int v = 0; v < vertices_.cols(); ++v) {
      const SpatialHash::Cell cell = hash_.cellOf(vertices_.col(v));
      first[at(v)] = firstAround(cell, v);
      if (first[at(v)] == v) {
        hash_.insert(cell, v);
      }
    }
    return first;
  }

 private:
  static constexpr double kExactCell = 1e-6;  // [m] equal positions share a cell of any size

  int firstAround(const SpatialHash::Cell& cell, int v) const {
    int first = v;
    const int width = 2 * reach_ + 1;
    for (int i = 0; i < width * width * width; ++i) {
      const Eigen::Array3i offset(i % width, i / width % width, i / (width * width));
      const SpatialHash::Cell neighbour = cell + (offset - reach_).cast<double>() + 0.0;
      first = std::min(first, firstIn(neighbour, v));
    }
    return first;
  }

  int firstIn(const SpatialHash::Cell& cell, int v) const {
    const std::vector<int>* candidates = hash_.find(cell);
    if (candidates == nullptr) {
      return v;
    }
    const auto found = std::find_if(candidates->begin(), candidates->end(), [&](int other) {
      return (vertices_.col(v) - vertices_.col(other)).norm() <= tolerance_;
    });
    return found == candidates->end() ? v : *found;
  }

  const Eigen::Matrix3Xd& vertices_;
  double tolerance_;
  int reach_;  // [cells]
  SpatialHash hash_;
};

CleanedMesh unchanged(const MeshView& mesh) {
  requireValid(mesh, "mesh cleanup");
  CleanedMesh result;
  result.mesh = {mesh.vertices, mesh.faces};
  result.vertexOfInput.resize(at(mesh.numVertices()));
  std::iota(result.vertexOfInput.begin(), result.vertexOfInput.end(), 0);
  return result;
}

/// Keeps the vertices that are first in their group.
CleanedMesh withVertexGroups(const MeshView& mesh, const std::vector<int>& first) {
  CleanedMesh result = unchanged(mesh);
  int kept = 0;
  for (int v = 0; v < mesh.numVertices(); ++v) {
    if (first[at(v)] == v) {
      result.mesh.vertices.col(kept) = mesh.vertices.col(v);
      result.vertexOfInput[at(v)] = kept++;
    } else {
      result.vertexOfInput[at(v)] = first[at(v)] < 0 ? -1 : result.vertexOfInput[at(first[at(v)])];
    }
  }
  result.mesh.vertices.conservativeResize(3, kept);
  for (int& corner : result.mesh.faces.reshaped()) {
    corner = result.vertexOfInput[at(corner)];
  }
  return result;
}

/// Keeps the faces for which `keep(face)` holds.
template <typename Keep>
CleanedMesh withFaces(const MeshView& mesh, const Keep& keep) {
  CleanedMesh result = unchanged(mesh);
  Eigen::Index kept = 0;
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    if (keep(face)) {
      result.mesh.faces.col(kept++) = mesh.faces.col(face);
    }
  }
  result.mesh.faces.conservativeResize(3, kept);
  return result;
}

int removedFaces(const MeshView& before, const CleanedMesh& after) {
  return static_cast<int>(before.numFaces() - after.mesh.numFaces());
}

bool isDegenerate(const MeshView& mesh, Eigen::Index face) {
  constexpr double kRelativeHeight = 1e-8;
  double longest = 0.0;
  for (int k = 0; k < 3; ++k) {
    const int a = mesh.faces(k, face);
    const int b = mesh.faces((k + 1) % 3, face);
    if (a == b) {
      return true;
    }
    longest = std::max(longest, (mesh.vertices.col(b) - mesh.vertices.col(a)).squaredNorm());
  }
  return doubleAreaVector(mesh, face).norm() <= kRelativeHeight * longest;
}

/// Applies a further step to what came out of the earlier ones.
void append(CleanedMesh& result, CleanedMesh step) {
  for (int& vertex : result.vertexOfInput) {
    vertex = vertex < 0 ? -1 : step.vertexOfInput[at(vertex)];
  }
  result.mesh = std::move(step.mesh);
  result.weldedVertices += step.weldedVertices;
  result.unreferencedVertices += step.unreferencedVertices;
  result.degenerateFaces += step.degenerateFaces;
  result.duplicateFaces += step.duplicateFaces;
  result.turnedFaces += step.turnedFaces;
}

}  // namespace

CleanedMesh weldVertices(const MeshView& mesh, double tolerance) {
  if (!(tolerance >= 0.0 && std::isfinite(tolerance))) {
    throw std::invalid_argument("weldVertices: the tolerance must be 0 or a positive length");
  }
  requireValid(mesh, "weldVertices");
  CleanedMesh result = withVertexGroups(mesh, Welder(mesh.vertices, tolerance).run());
  result.weldedVertices = static_cast<int>(mesh.numVertices() - result.mesh.numVertices());
  return result;
}

CleanedMesh dropDegenerateFaces(const MeshView& mesh) {
  requireValid(mesh, "dropDegenerateFaces");
  CleanedMesh result =
      withFaces(mesh, [&](Eigen::Index face) { return !isDegenerate(mesh, face); });
  result.degenerateFaces = removedFaces(mesh, result);
  return result;
}

CleanedMesh dropDuplicateFaces(const MeshView& mesh) {
  std::set<std::vector<int>> seen;
  CleanedMesh result = withFaces(mesh, [&](Eigen::Index face) {
    std::vector<int> corners(mesh.faces.col(face).begin(), mesh.faces.col(face).end());
    std::sort(corners.begin(), corners.end());
    return seen.insert(std::move(corners)).second;
  });
  result.duplicateFaces = removedFaces(mesh, result);
  return result;
}

CleanedMesh dropUnreferencedVertices(const MeshView& mesh) {
  requireValid(mesh, "dropUnreferencedVertices");
  std::vector<int> first(at(mesh.numVertices()), -1);
  for (const int corner : mesh.faces.reshaped()) {
    first[at(corner)] = corner;
  }
  CleanedMesh result = withVertexGroups(mesh, first);
  result.unreferencedVertices = static_cast<int>(mesh.numVertices() - result.mesh.numVertices());
  return result;
}

CleanedMesh orientFaces(const MeshView& mesh) {
  CleanedMesh result = unchanged(mesh);
  const FaceSides sides = faceSides(mesh.faces, buildAdjacency(mesh.faces, mesh.numVertices()));
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    if (sides.turned[at(face)]) {
      std::swap(result.mesh.faces(1, face), result.mesh.faces(2, face));
      ++result.turnedFaces;
    }
  }
  return result;
}

CleanedMesh cleanMesh(const MeshView& mesh, double weldTolerance) {
  CleanedMesh result = weldVertices(mesh, weldTolerance);
  append(result, dropDegenerateFaces(result.mesh));
  append(result, dropDuplicateFaces(result.mesh));
  append(result, dropUnreferencedVertices(result.mesh));
  append(result, orientFaces(result.mesh));
  return result;
}

std::vector<TriangleMesh> connectedParts(const MeshView& mesh) {
  requireValid(mesh, "connectedParts");
  const Components components =
      connectedComponents(mesh.faces, buildAdjacency(mesh.faces, mesh.numVertices()));
  const auto count = static_cast<std::size_t>(components.count);
  std::vector<std::vector<Eigen::Index>> faces(count);
  std::vector<double> areas(count, 0.0);
  const Eigen::VectorXd faceArea = faceAreas(mesh);
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    const auto part = static_cast<std::size_t>(components.faceLabels[static_cast<std::size_t>(f)]);
    faces[part].push_back(f);
    areas[part] += faceArea[f];
  }
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return areas[a] > areas[b];
  });
  std::vector<TriangleMesh> parts;
  parts.reserve(count);
  for (const std::size_t part : order) {
    const TriangleMesh whole{mesh.vertices, mesh.faces(Eigen::all, faces[part])};
    parts.push_back(dropUnreferencedVertices(whole).mesh);
  }
  return parts;
}

}  // namespace avatar
