#include "avatar/geometry/adjacency.h"

#include "avatar/geometry/element_index.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace avatar {
namespace {

void requireProperFaces(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices) {
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const Eigen::Vector3i v = faces.col(f);
    if (v.minCoeff() < 0 || v.maxCoeff() >= numVertices) {
      throw std::invalid_argument(
          "buildAdjacency: face " + std::to_string(f) + " names a vertex outside [0, " +
          std::to_string(numVertices) + ")");
    }
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
      throw std::invalid_argument(
          "buildAdjacency: face " + std::to_string(f) + " names a vertex twice");
    }
  }
}

/// Rows from (row, value) pairs in the given order, by counting.
template <typename RowOf, typename ValueOf>
IndexRows collectRows(
    Eigen::Index rows, Eigen::Index items, const RowOf& row, const ValueOf& value) {
  IndexRows result;
  result.offsets.assign(at(rows) + 1, 0);
  for (Eigen::Index i = 0; i < items; ++i) {
    ++result.offsets[at(row(i)) + 1];
  }
  for (std::size_t r = 1; r < result.offsets.size(); ++r) {
    result.offsets[r] += result.offsets[r - 1];
  }
  std::vector<int> next(result.offsets.begin(), result.offsets.end() - 1);
  result.values.resize(at(items));
  for (Eigen::Index i = 0; i < items; ++i) {
    result.values[at(next[at(row(i))]++)] = static_cast<int>(value(i));
  }
  return result;
}

/// Half-edge h = 3f + k runs from corner k of face f to corner k + 1.
struct HalfEdge {
  int from, to;
};

HalfEdge halfEdge(const Eigen::Matrix3Xi& faces, Eigen::Index h) {
  return {faces(h % 3, h / 3), faces((h + 1) % 3, h / 3)};
}

int lowerEnd(const HalfEdge& h) {
  return std::min(h.from, h.to);
}

int upperEnd(const HalfEdge& h) {
  return std::max(h.from, h.to);
}

/// Half-edges in the order of their lower ends, those with the same in the order of the upper.
std::vector<int> sortedHalfEdges(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices) {
  IndexRows byLower = collectRows(
      numVertices,
      3 * faces.cols(),
      [&](Eigen::Index h) { return lowerEnd(halfEdge(faces, h)); },
      [](Eigen::Index h) { return h; });
  for (std::size_t row = 0; row < at(numVertices); ++row) {
    std::stable_sort(
        byLower.values.begin() + byLower.offsets[row],
        byLower.values.begin() + byLower.offsets[row + 1],
        [&](int a, int b) { return upperEnd(halfEdge(faces, a)) < upperEnd(halfEdge(faces, b)); });
  }
  return byLower.values;
}

/// Numbers the undirected edges.
void buildEdges(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices, Adjacency& adjacency) {
  adjacency.edges.resize(2, 3 * faces.cols());
  adjacency.faceEdges.resize(3, faces.cols());
  int numEdges = 0;
  Eigen::Vector2i previous(-1, -1);
  for (const int h : sortedHalfEdges(faces, numVertices)) {
    const Eigen::Vector2i ends(lowerEnd(halfEdge(faces, h)), upperEnd(halfEdge(faces, h)));
    if (ends != previous) {
      adjacency.edges.col(numEdges++) = ends;
      previous = ends;
    }
    adjacency.faceEdges(h % 3, h / 3) = numEdges - 1;
  }
  adjacency.edges.conservativeResize(2, numEdges);
}

/// The face beside `face` at an edge, or −1.
int neighbour(const Adjacency& adjacency, int edge, int face) {
  for (const int other : adjacency.edgeFaces[edge]) {
    if (other != face) {
      return other;
    }
  }
  return -1;
}

int cornerOf(const Eigen::Matrix3Xi& faces, int face, int vertex) {
  return faces(0, face) == vertex ? 0 : faces(1, face) == vertex ? 1 : 2;
}

/// True when the face runs along its edge from the edge's lower to its upper vertex.
bool runsUpwards(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency, int edge, int face) {
  const int corner = cornerOf(faces, face, adjacency.edges(0, edge));
  return faces((corner + 1) % 3, face) == adjacency.edges(1, edge);
}

bool facesAgree(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency, int edge) {
  const std::span<const int> pair = adjacency.edgeFaces[edge];
  return pair.size() < 2 || runsUpwards(faces, adjacency, edge, pair[0]) !=
                                runsUpwards(faces, adjacency, edge, pair[1]);
}

/// The boundary half-edge that follows boundary half-edge h: turns around its end through the
/// faces of the same fan, so loops that touch in a vertex stay apart.
int nextOnBoundary(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency, int h) {
  const int pivot = halfEdge(faces, h).to;
  int face = h / 3;
  while (true) {
    const int corner = cornerOf(faces, face, pivot);
    const int edge = adjacency.faceEdges(corner, face);
    if (adjacency.isBoundaryEdge(edge)) {
      return 3 * face + corner;
    }
    face = neighbour(adjacency, edge, face);
  }
}

/// Follows one loop from half-edge `start`, marking its edges.
std::vector<int> followLoop(
    const Eigen::Matrix3Xi& faces,
    const Adjacency& adjacency,
    int start,
    std::vector<bool>& visited) {
  std::vector<int> loop;
  int h = start;
  do {
    visited[at(adjacency.faceEdges(h % 3, h / 3))] = true;
    loop.push_back(halfEdge(faces, h).from);
    h = nextOnBoundary(faces, adjacency, h);
  } while (h != start);
  std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
  return loop;
}

void appendMissing(std::vector<int>& list, std::span<const int> values) {
  for (const int value : values) {
    if (std::find(list.begin(), list.end(), value) == list.end()) {
      list.push_back(value);
    }
  }
}

/// Number of faces reachable from a vertex' first face by crossing edges at the vertex.
std::size_t fanSize(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency, int vertex) {
  std::vector<int> fan = {adjacency.vertexFaces[vertex][0]};
  for (std::size_t i = 0; i < fan.size(); ++i) {
    const int face = fan[i];
    const int corner = cornerOf(faces, face, vertex);
    appendMissing(fan, adjacency.edgeFaces[adjacency.faceEdges(corner, face)]);
    appendMissing(fan, adjacency.edgeFaces[adjacency.faceEdges((corner + 2) % 3, face)]);
  }
  return fan.size();
}

/// Gives every face a side, from neighbour to neighbour, so that neighbours agree.
class FaceSideSearch {
 public:
  FaceSideSearch(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency)
      : faces_(faces), adjacency_(adjacency) {
    result_.turned.assign(at(faces.cols()), false);
    visited_.assign(at(faces.cols()), false);
  }

  FaceSides run() {
    for (int seed = 0; seed < faces_.cols(); ++seed) {
      if (!visited_[at(seed)]) {
        spreadFrom(seed);
        keepMajority();
      }
    }
    return std::move(result_);
  }

 private:
  void spreadFrom(int seed) {
    patch_ = {seed};
    visited_[at(seed)] = true;
    for (std::size_t i = 0; i < patch_.size(); ++i) {
      const int face = patch_[i];
      for (int k = 0; k < 3; ++k) {
        crossEdge(face, adjacency_.faceEdges(k, face));
      }
    }
  }

  void crossEdge(int face, int edge) {
    for (const int other : adjacency_.edgeFaces[edge]) {
      if (other == face) {
        continue;
      }
      const bool agree = runsUpwards(faces_, adjacency_, edge, face) !=
                         runsUpwards(faces_, adjacency_, edge, other);
      const bool wanted = result_.turned[at(face)] == agree;
      if (!visited_[at(other)]) {
        visited_[at(other)] = true;
        result_.turned[at(other)] = wanted;
        patch_.push_back(other);
      }
      result_.consistent = result_.consistent && result_.turned[at(other)] == wanted;
    }
  }

  void keepMajority() {
    const auto turned = std::count_if(
        patch_.begin(), patch_.end(), [&](int face) { return result_.turned[at(face)]; });
    if (2 * turned > std::ssize(patch_)) {
      for (const int face : patch_) {
        result_.turned[at(face)] = !result_.turned[at(face)];
      }
    }
  }

  const Eigen::Matrix3Xi& faces_;
  const Adjacency& adjacency_;
  FaceSides result_;
  std::vector<bool> visited_;
  std::vector<int> patch_;  // faces connected over edges, in the order of their discovery
};

/// Gives the label to everything that hangs together with a vertex.
void floodLabel(const Adjacency& adjacency, int seed, int label, std::vector<int>& labels) {
  std::vector<int> pending = {seed};
  while (!pending.empty()) {
    const int vertex = pending.back();
    pending.pop_back();
    if (labels[at(vertex)] < 0) {
      labels[at(vertex)] = label;
      const std::span<const int> ring = adjacency.vertexVertices[vertex];
      pending.insert(pending.end(), ring.begin(), ring.end());
    }
  }
}

}  // namespace

Adjacency buildAdjacency(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices) {
  requireProperFaces(faces, numVertices);
  Adjacency adjacency;
  buildEdges(faces, numVertices, adjacency);
  const auto faceOfHalfEdge = [](Eigen::Index h) { return h / 3; };
  adjacency.edgeFaces = collectRows(
      adjacency.numEdges(),
      3 * faces.cols(),
      [&](Eigen::Index h) { return adjacency.faceEdges(h % 3, h / 3); },
      faceOfHalfEdge);
  adjacency.vertexFaces = collectRows(
      numVertices,
      3 * faces.cols(),
      [&](Eigen::Index h) { return faces(h % 3, h / 3); },
      faceOfHalfEdge);
  // Edges are sorted, so a vertex meets its lower neighbours (it is the upper end) before the
  // higher ones when all "upper end" entries come first.
  const Eigen::Index numEdges = adjacency.numEdges();
  adjacency.vertexVertices = collectRows(
      numVertices,
      2 * numEdges,
      [&](Eigen::Index i) {
        return i < numEdges ? adjacency.edges(1, i) : adjacency.edges(0, i - numEdges);
      },
      [&](Eigen::Index i) {
        return i < numEdges ? adjacency.edges(0, i) : adjacency.edges(1, i - numEdges);
      });
  return adjacency;
}

std::vector<std::vector<int>> boundaryLoops(
    const Eigen::Matrix3Xi& faces, const Adjacency& adjacency) {
  for (int edge = 0; edge < adjacency.numEdges(); ++edge) {
    if (adjacency.edgeFaces[edge].size() > 2 || !facesAgree(faces, adjacency, edge)) {
      throw std::invalid_argument(
          "boundaryLoops: the faces must be oriented alike, at most two at an edge");
    }
  }
  std::vector<std::vector<int>> loops;
  std::vector<bool> visited(at(adjacency.numEdges()), false);
  for (int edge = 0; edge < adjacency.numEdges(); ++edge) {
    if (!adjacency.isBoundaryEdge(edge) || visited[at(edge)]) {
      continue;
    }
    const int face = adjacency.edgeFaces[edge][0];
    const int from = adjacency.edges(runsUpwards(faces, adjacency, edge, face) ? 0 : 1, edge);
    loops.push_back(followLoop(faces, adjacency, 3 * face + cornerOf(faces, face, from), visited));
  }
  std::sort(loops.begin(), loops.end());
  return loops;
}

std::vector<int> nonManifoldEdges(const Adjacency& adjacency) {
  std::vector<int> edges;
  for (int edge = 0; edge < adjacency.numEdges(); ++edge) {
    if (adjacency.edgeFaces[edge].size() > 2) {
      edges.push_back(edge);
    }
  }
  return edges;
}

std::vector<int> nonManifoldVertices(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency) {
  std::vector<int> vertices;
  for (int vertex = 0; vertex < adjacency.vertexFaces.numRows(); ++vertex) {
    const std::size_t count = adjacency.vertexFaces[vertex].size();
    if (count > 0 && fanSize(faces, adjacency, vertex) != count) {
      vertices.push_back(vertex);
    }
  }
  return vertices;
}

FaceSides faceSides(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency) {
  return FaceSideSearch(faces, adjacency).run();
}

Components connectedComponents(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency) {
  Components result;
  const int numVertices = adjacency.vertexFaces.numRows();
  result.vertexLabels.assign(at(numVertices), -1);
  for (int vertex = 0; vertex < numVertices; ++vertex) {
    if (result.vertexLabels[at(vertex)] < 0 && !adjacency.vertexFaces[vertex].empty()) {
      floodLabel(adjacency, vertex, result.count++, result.vertexLabels);
    }
  }
  result.faceLabels.reserve(at(faces.cols()));
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    result.faceLabels.push_back(result.vertexLabels[at(faces(0, f))]);
  }
  return result;
}

Topology topology(const Eigen::Matrix3Xi& faces, const Adjacency& adjacency) {
  Topology result;
  for (int edge = 0; edge < adjacency.numEdges(); ++edge) {
    const std::size_t count = adjacency.edgeFaces[edge].size();
    result.closed = result.closed && count != 1;
    result.oriented = result.oriented && facesAgree(faces, adjacency, edge);
  }
  int usedVertices = 0;
  for (int vertex = 0; vertex < adjacency.vertexFaces.numRows(); ++vertex) {
    usedVertices += adjacency.vertexFaces[vertex].empty() ? 0 : 1;
  }
  result.edgeManifold = nonManifoldEdges(adjacency).empty();
  result.vertexManifold = nonManifoldVertices(faces, adjacency).empty();
  result.orientable = result.oriented || faceSides(faces, adjacency).consistent;
  result.components = connectedComponents(faces, adjacency).count;
  result.eulerCharacteristic =
      usedVertices - static_cast<int>(adjacency.numEdges()) + static_cast<int>(faces.cols());
  if (result.manifold() && result.oriented) {
    result.boundaryLoops = static_cast<int>(boundaryLoops(faces, adjacency).size());
    result.genus = (2 * result.components - result.boundaryLoops - result.eulerCharacteristic) / 2;
  }
  return result;
}

Topology topology(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices) {
  return topology(faces, buildAdjacency(faces, numVertices));
}

}  // namespace avatar
