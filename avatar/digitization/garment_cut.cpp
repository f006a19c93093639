#include "avatar/digitization/garment_cut.h"

#include "avatar/garment_binding.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

bool isGarment(std::uint8_t label) {
  return label == kUpperLabel || label == kLowerLabel;
}

/// Vertices of garments that stand across the skin, as the walls of a step do.
std::vector<bool> acrossSkin(
    const MeshView& mesh,
    const std::vector<std::uint8_t>& labels,
    const SignedDistance& skin,
    double cosine) {
  const Eigen::Matrix3Xd normals = vertexNormals(mesh);
  std::vector<bool> across(labels.size(), false);
  for (std::size_t v = 0; v < labels.size(); ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    across[v] = isGarment(labels[v]) &&
                skin(mesh.vertices.col(column)).normal.dot(normals.col(column)) < cosine;
  }
  return across;
}

/// But for those of the lower garment between the legs.
std::vector<bool> withoutWebs(
    std::vector<bool> across,
    const MeshView& mesh,
    const std::vector<std::uint8_t>& labels,
    const std::function<bool(const Eigen::Vector3d&)>& betweenLegs) {
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (across[v] && labels[v] == kLowerLabel)
      across[v] = !betweenLegs(mesh.vertices.col(static_cast<Eigen::Index>(v)));
  }
  return across;
}

/// The vertices in `allowed` that are connected within it to the border with a label.
std::vector<bool> grownFromBorder(
    const std::vector<bool>& allowed,
    const std::vector<std::uint8_t>& labels,
    const Adjacency& adjacency,
    const auto& isBorder) {
  std::vector<bool> reached(allowed.size(), false);
  std::vector<int> front;
  const auto reach = [&](int v) {
    const auto i = static_cast<std::size_t>(v);
    if (!allowed[i] || reached[i])
      return;
    reached[i] = true;
    front.push_back(v);
  };
  for (Eigen::Index e = 0; e < adjacency.numEdges(); ++e) {
    const int a = adjacency.edges(0, e);
    const int b = adjacency.edges(1, e);
    if (isBorder(labels[static_cast<std::size_t>(a)], labels[static_cast<std::size_t>(b)])) {
      reach(a);
      reach(b);
    }
  }
  while (!front.empty()) {
    const int v = front.back();
    front.pop_back();
    for (const int next : adjacency.vertexVertices[v])
      reach(next);
  }
  return reached;
}

std::vector<int> verticesWhere(std::size_t numVertices, const auto& holds) {
  std::vector<int> vertices;
  for (std::size_t v = 0; v < numVertices; ++v) {
    if (holds(v))
      vertices.push_back(static_cast<int>(v));
  }
  return vertices;
}

/// The vertices of a set that are connected within it to `first`, taken out of it.
std::vector<int> takeConnected(int first, std::vector<bool>& set, const Adjacency& adjacency) {
  std::vector<int> connected = {first};
  set[static_cast<std::size_t>(first)] = false;
  for (std::size_t i = 0; i < connected.size(); ++i) {
    for (const int next : adjacency.vertexVertices[connected[i]]) {
      if (!set[static_cast<std::size_t>(next)])
        continue;
      set[static_cast<std::size_t>(next)] = false;
      connected.push_back(next);
    }
  }
  return connected;
}

/// In how many separate places a piece joins what lies around it in `rest`.
int joints(
    const std::vector<int>& piece, const std::vector<bool>& rest, const Adjacency& adjacency) {
  std::vector<bool> around(rest.size(), false);
  std::vector<int> ring;
  for (const int v : piece) {
    for (const int next : adjacency.vertexVertices[v]) {
      const auto i = static_cast<std::size_t>(next);
      if (!rest[i] || around[i])
        continue;
      around[i] = true;
      ring.push_back(next);
    }
  }
  int count = 0;
  for (const int v : ring) {
    if (!around[static_cast<std::size_t>(v)])
      continue;
    takeConnected(v, around, adjacency);
    ++count;
  }
  return count;
}

/// Vertices of one label on strips narrower than a width that lead nowhere: what morphological
/// opening takes away, but for what connects parts that it leaves.
std::vector<int> looseEnds(
    const MeshView& mesh,
    const std::vector<std::uint8_t>& labels,
    std::uint8_t label,
    const Adjacency& adjacency,
    double width) {
  // Ways along edges are up to a tenth longer or shorter than straight ones.
  constexpr double kSlack = 1.2;
  const Eigen::VectorXd fromBorder = edgeDistances(
      mesh, verticesWhere(labels.size(), [&](std::size_t v) { return labels[v] != label; }));
  const Eigen::VectorXd fromCore =
      edgeDistances(mesh, verticesWhere(labels.size(), [&](std::size_t v) {
                      return fromBorder[static_cast<Eigen::Index>(v)] > 0.5 * width;
                    }));
  std::vector<bool> narrow(labels.size(), false);
  std::vector<bool> rest(labels.size(), false);
  for (std::size_t v = 0; v < labels.size(); ++v) {
    const bool isNear = fromCore[static_cast<Eigen::Index>(v)] <= kSlack * 0.5 * width;
    narrow[v] = labels[v] == label && !isNear;
    rest[v] = labels[v] == label && isNear;
  }
  std::vector<int> loose;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (!narrow[v])
      continue;
    const std::vector<int> piece = takeConnected(static_cast<int>(v), narrow, adjacency);
    if (joints(piece, rest, adjacency) == 1)
      loose.insert(loose.end(), piece.begin(), piece.end());
  }
  return loose;
}

/// Vertices in slits of one label's parts narrower than a width: what morphological closing adds.
std::vector<int> slits(
    const MeshView& mesh,
    const std::vector<std::uint8_t>& labels,
    std::uint8_t label,
    double width) {
  const auto verticesBeyond = [&](const Eigen::VectorXd& distances) {
    return verticesWhere(labels.size(), [&](std::size_t v) {
      return distances[static_cast<Eigen::Index>(v)] > 0.5 * width;
    });
  };
  const Eigen::VectorXd fromLabel = edgeDistances(
      mesh, verticesWhere(labels.size(), [&](std::size_t v) { return labels[v] == label; }));
  std::vector<int> closed = verticesBeyond(edgeDistances(mesh, verticesBeyond(fromLabel)));
  std::erase_if(closed, [&](int v) { return labels[static_cast<std::size_t>(v)] == label; });
  return closed;
}

}  // namespace

void CutOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("CutOptions: ") + what);
  };
  demand(stepCosine >= 0.0 && stepCosine < 1.0, "stepCosine is expected in [0, 1)");
  demand(overlapTrim >= 0.0, "overlapTrim is expected at 0 m or above");
  demand(narrowest >= 0.0, "narrowest is expected at 0 m or above");
  demand(smoothingRounds >= 0 && smoothingRounds <= 100, "smoothingRounds: 0 to 100");
}

std::vector<std::uint8_t> fabricLabels(
    const OuterSurface& surface,
    const std::vector<std::uint8_t>& labels,
    const SignedDistance& skin,
    const std::function<bool(const Eigen::Vector3d&)>& betweenLegs,
    const CutOptions& options) {
  options.validate();
  const Adjacency adjacency = buildAdjacency(surface.mesh.faces, surface.mesh.numVertices());
  const std::vector<bool> across = acrossSkin(surface.mesh, labels, skin, options.stepCosine);
  const std::vector<bool> stepsOfOverlap = grownFromBorder(
      withoutWebs(across, surface.mesh, labels, betweenLegs),
      labels,
      adjacency,
      [](std::uint8_t a, std::uint8_t b) {
        return std::minmax(a, b) == std::minmax<std::uint8_t>(kUpperLabel, kLowerLabel);
      });
  const std::vector<bool> stepsToSkin =
      grownFromBorder(across, labels, adjacency, [](std::uint8_t a, std::uint8_t b) {
        return isGarment(a) != isGarment(b);
      });
  std::vector<int> upper;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (labels[v] == kUpperLabel || stepsOfOverlap[v])
      upper.push_back(static_cast<int>(v));
  }
  const Eigen::VectorXd fromUpper = edgeDistances(surface.mesh, upper);
  std::vector<std::uint8_t> result = labels;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (stepsToSkin[v] || stepsOfOverlap[v])
      result[v] = kNoLabel;
  }
  for (const SurfaceLabel garment : {kUpperLabel, kLowerLabel}) {
    for (const int v : looseEnds(surface.mesh, result, garment, adjacency, options.narrowest))
      result[static_cast<std::size_t>(v)] = kNoLabel;
    for (const int v : slits(surface.mesh, result, garment, options.narrowest)) {
      if (labels[static_cast<std::size_t>(v)] == garment)
        result[static_cast<std::size_t>(v)] = garment;
    }
  }
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (labels[v] == kLowerLabel && fromUpper[static_cast<Eigen::Index>(v)] < options.overlapTrim)
      result[v] = kNoLabel;
  }
  return result;
}

TriangleMesh withoutPinches(const TriangleMesh& mesh) {
  TriangleMesh result = mesh;
  for (;;) {
    const Adjacency adjacency = buildAdjacency(result.faces, result.numVertices());
    std::vector<bool> dropped(static_cast<std::size_t>(result.numFaces()), false);
    for (const int edge : nonManifoldEdges(adjacency)) {
      for (const int face : adjacency.edgeFaces[edge])
        dropped[static_cast<std::size_t>(face)] = true;
    }
    for (const int v : nonManifoldVertices(result.faces, adjacency)) {
      for (const int face : adjacency.vertexFaces[v])
        dropped[static_cast<std::size_t>(face)] = true;
    }
    std::vector<Eigen::Index> kept;
    kept.reserve(dropped.size());
    for (std::size_t face = 0; face < dropped.size(); ++face) {
      if (!dropped[face])
        kept.push_back(static_cast<Eigen::Index>(face));
    }
    if (kept.size() == dropped.size())
      return result;
    result.faces = Eigen::Matrix3Xi(result.faces(Eigen::all, kept));
  }
}

}  // namespace avatar
