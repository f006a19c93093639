#include "bullet_ext/core/wide_cloth.h"

#include "bullet_ext/core/element_index.h"
#include "bullet_ext/core/torsion_force.h"

#include <algorithm>
#include <cmath>

namespace bullet_ext {
namespace {

Eigen::Index blocksOf(std::size_t count) {
  return static_cast<Eigen::Index>((count + kWideLanes - 1) / kWideLanes);
}

/// Where the vector of element i is, in an array with `stride` floats per block.
std::int32_t vectorOffset(Eigen::Index i, Eigen::Index stride) {
  return static_cast<std::int32_t>(stride * (i / kWideLanes)) + 4 * kVectorSlots[i % kWideLanes];
}

std::int32_t pairOffset(Eigen::Index i) {
  return static_cast<std::int32_t>(2 * kWideLanes * (i / kWideLanes)) +
         2 * kPairSlots[i % kWideLanes];
}

constexpr Eigen::Index kNormalStride = 4 * kWideLanes;
constexpr Eigen::Index kCornerStride = 12 * kWideLanes;

/// Where a value of row `row` of element i is, in an array with `rows` rows of eight per block.
std::size_t rowOffset(Eigen::Index i, Eigen::Index rows, Eigen::Index row) {
  return at(kWideLanes * (rows * (i / kWideLanes) + row) + i % kWideLanes);
}

}  // namespace

bool wideKernelsSupported() {
#if BULLET_EXT_WIDE_KERNELS
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
#else
  return false;
#endif
}

/// What a range of vertices needs: faces around them first, then the other faces of their edges.
struct WideCloth::Elements {
  std::vector<int> faces, edges;
  std::size_t numForceFaces = 0;
  std::vector<int> localFace, localEdge;  ///< of every face and spring, −1 for others
  std::vector<int> hingeOfEdge;           ///< of every spring, −1 on the boundary
  std::vector<int> faceOfEdge;            ///< of every spring: some face of it

  Elements(const ClothMesh& mesh, VertexRange range)
      : localFace(at(mesh.faces.cols()), -1),
        localEdge(at(mesh.springs.cols()), -1),
        hingeOfEdge(at(mesh.springs.cols()), -1),
        faceOfEdge(at(mesh.springs.cols()), -1) {
    for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
      hingeOfEdge[at(mesh.hingeSprings[at(h)])] = static_cast<int>(h);
    }
    const auto inRange = [&](int v) { return v >= range.begin && v < range.end; };
    for (int f = 0; f < mesh.faces.cols(); ++f) {
      if (inRange(mesh.faces(0, f)) || inRange(mesh.faces(1, f)) || inRange(mesh.faces(2, f))) {
        addFace(f);
        addEdges(mesh, f);
      }
    }
    numForceFaces = faces.size();
    std::sort(edges.begin(), edges.end());
    for (std::size_t e = 0; e < edges.size(); ++e) {
      localEdge[at(edges[e])] = static_cast<int>(e);
      const int hinge = hingeOfEdge[at(edges[e])];
      if (hinge >= 0) {
        addFace(mesh.hingeFaces(0, hinge));
        addFace(mesh.hingeFaces(1, hinge));
      }
    }
  }

 private:
  void addFace(int face) {
    if (localFace[at(face)] < 0) {
      localFace[at(face)] = static_cast<int>(faces.size());
      faces.push_back(face);
    }
  }

  void addEdges(const ClothMesh& mesh, int face) {
    for (const int edge : mesh.faceSprings.col(face)) {
      if (faceOfEdge[at(edge)] < 0) {
        faceOfEdge[at(edge)] = face;
        edges.push_back(edge);
      }
    }
  }
};

WideCloth::WideCloth(const ClothMesh& mesh, VertexRange range) {
  const Elements elements(mesh, range);
  domain_.vertexBegin = static_cast<std::int32_t>(range.begin);
  domain_.vertexEnd = static_cast<std::int32_t>(range.end);
  packFaces(mesh, elements);
  packEdges(mesh, elements);
  packVertices(mesh, elements);
  domain_.corners = corners_.data();
  domain_.cornerEdges = cornerEdges_.data();
  domain_.edgeEnds = edgeEnds_.data();
  domain_.edgeRest = edgeRest_.data();
  domain_.groupSlots = groupSlots_.data();
  domain_.slots = slots_.data();
  domain_.normals = normals_.data();
  domain_.faceRest = faceRest_.data();
  domain_.edgeStates = edgeStates_.data();
  domain_.edgeEnergies = edgeEnergies_.data();
  domain_.cornerForces = cornerForces_.data();
}

void WideCloth::packFaces(const ClothMesh& mesh, const Elements& elements) {
  const Eigen::Index normalBlocks = blocksOf(elements.faces.size());
  const Eigen::Index forceBlocks = blocksOf(elements.numForceFaces);
  domain_.normalBlocks = static_cast<std::int32_t>(normalBlocks);
  domain_.forceBlocks = static_cast<std::int32_t>(forceBlocks);
  corners_.resize(at(3 * kWideLanes * normalBlocks));
  faceRest_.resize(at(kWideLanes * normalBlocks));
  for (Eigen::Index i = 0; i < kWideLanes * normalBlocks; ++i) {
    const int face = elements.faces[std::min(at(i), elements.faces.size() - 1)];
    for (int k = 0; k < 3; ++k) {
      corners_[rowOffset(i, 3, k)] = 4 * mesh.faces(k, face);
    }
    faceRest_[at(i)] = static_cast<float>(1.0 / mesh.squaredWidthLimits[face]);
  }
  // Lanes behind the last face around the vertices: any edge will do, nobody reads their forces.
  cornerEdges_.assign(at(3 * kWideLanes * forceBlocks), 0);
  for (Eigen::Index i = 0; at(i) < elements.numForceFaces; ++i) {
    for (int k = 0; k < 3; ++k) {
      const int edge = mesh.faceSprings(k, elements.faces[at(i)]);
      cornerEdges_[rowOffset(i, 3, k)] = pairOffset(elements.localEdge[at(edge)]);
    }
  }
  normals_.assign(at(kNormalStride * normalBlocks), 0.0F);
  cornerForces_.assign(at(kCornerStride * forceBlocks) + 4, 0.0F);
}

void WideCloth::packEdges(const ClothMesh& mesh, const Elements& elements) {
  const Eigen::Index blocks = blocksOf(elements.edges.size());
  domain_.edgeBlocks = static_cast<std::int32_t>(blocks);
  edgeEnds_.resize(at(4 * kWideLanes * blocks));
  edgeRest_.assign(at(kEdgeRestRows * kWideLanes * blocks), 0.0F);
  for (Eigen::Index i = 0; i < kWideLanes * blocks; ++i) {
    const int edge = elements.edges[std::min(at(i), elements.edges.size() - 1)];
    const int hinge = elements.hingeOfEdge[at(edge)];
    const auto setRest = [&](EdgeRestRow row, double value) {
      edgeRest_[rowOffset(i, kEdgeRestRows, row)] = static_cast<float>(value);
    };
    for (int end = 0; end < 2; ++end) {
      const int face = hinge < 0 ? elements.faceOfEdge[at(edge)] : mesh.hingeFaces(end, hinge);
      edgeEnds_[rowOffset(i, 4, end)] = 4 * mesh.springs(end, edge);
      edgeEnds_[rowOffset(i, 4, 2 + end)] =
          vectorOffset(elements.localFace[at(face)], kNormalStride);
    }
    if (at(i) >= elements.edges.size()) {
      continue;  // a copy without stiffness, so without energy
    }
    setRest(kHalfStiffness, mesh.springStiffness[edge] * (hinge < 0 ? 0.5 : 0.25));
    setRest(kRestLength, mesh.springRestLengths[edge]);
    if (hinge >= 0) {
      setRest(kTorsion, mesh.hingeStiffness[hinge]);
      setRest(kRestAngle, mesh.hingeRestAngles[hinge]);
    }
  }
  edgeStates_.assign(at(2 * kWideLanes * blocks), 0.0F);
  edgeEnergies_.assign(at(kWideLanes * blocks), 0.0F);
}

void WideCloth::packVertices(const ClothMesh& mesh, const Elements& elements) {
  const Eigen::Index count = domain_.vertexEnd - domain_.vertexBegin;
  std::vector<std::vector<std::int32_t>> slotsOf(at(kWideLanes * blocksOf(at(count))));
  for (Eigen::Index i = 0; at(i) < 3 * elements.numForceFaces; ++i) {
    const int vertex = mesh.faces(i % 3, elements.faces[at(i / 3)]);
    if (vertex >= domain_.vertexBegin && vertex < domain_.vertexEnd) {
      slotsOf[at(vertex - domain_.vertexBegin)].push_back(
          vectorOffset(i / 3, kCornerStride) + static_cast<std::int32_t>(kNormalStride * (i % 3)));
    }
  }
  const auto zero = static_cast<std::int32_t>(cornerForces_.size() - 4);
  groupSlots_.assign(1, 0);
  for (auto group = slotsOf.begin(); group != slotsOf.end(); group += kWideLanes) {
    const std::size_t most =
        std::max_element(group, group + kWideLanes, [](const auto& a, const auto& b) {
          return a.size() < b.size();
        })->size();
    for (auto vertex = group; vertex != group + kWideLanes; ++vertex) {
      vertex->resize(most, zero);
      slots_.insert(slots_.end(), vertex->begin(), vertex->end());
    }
    groupSlots_.push_back(static_cast<std::int32_t>(slots_.size()));
  }
}

void WideCloth::addForces(Eigen::Matrix4Xf& forces) const {
  for (Eigen::Index v = domain_.vertexBegin; v < domain_.vertexEnd; ++v) {
    const Eigen::Index own = v - domain_.vertexBegin;
    const std::int32_t* group = domain_.groupSlots + own / kWideLanes;
    const std::int32_t perVertex = (group[1] - group[0]) / kWideLanes;
    const std::int32_t* slots = domain_.slots + group[0] + (own % kWideLanes) * perVertex;
    for (std::int32_t i = 0; i < perVertex; ++i) {
      forces.col(v) += Eigen::Vector4f::Map(domain_.cornerForces + slots[i]);
    }
  }
}

}  // namespace bullet_ext
