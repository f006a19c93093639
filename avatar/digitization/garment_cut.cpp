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

}  // namespace

void CutOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("CutOptions: ") + what);
  };
  demand(stepCosine >= 0.0 && stepCosine < 1.0, "stepCosine is expected in [0, 1)");
  demand(overlapTrim >= 0.0, "overlapTrim is expected at 0 m or above");
  demand(smoothingRounds >= 0 && smoothingRounds <= 100, "smoothingRounds: 0 to 100");
}

std::vector<std::uint8_t> fabricLabels(
    const OuterSurface& surface,
    const std::vector<std::uint8_t>& labels,
    const SignedDistance& skin,
    const CutOptions& options) {
  options.validate();
  const Adjacency adjacency = buildAdjacency(surface.mesh.faces, surface.mesh.numVertices());
  const std::vector<bool> across = acrossSkin(surface.mesh, labels, skin, options.stepCosine);
  const auto between = [](std::uint8_t first, std::uint8_t second) {
    return [=](std::uint8_t a, std::uint8_t b) {
      return std::minmax(a, b) == std::minmax(first, second);
    };
  };
  const std::vector<bool> steps = grownFromBorder(
      across, labels, adjacency, [](std::uint8_t a, std::uint8_t b) { return a != b; });
  const std::vector<bool> stepsOfOverlap =
      grownFromBorder(across, labels, adjacency, between(kUpperLabel, kLowerLabel));
  std::vector<int> upper;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (labels[v] == kUpperLabel || stepsOfOverlap[v])
      upper.push_back(static_cast<int>(v));
  }
  const Eigen::VectorXd fromUpper = edgeDistances(surface.mesh, upper);
  std::vector<std::uint8_t> result = labels;
  for (std::size_t v = 0; v < labels.size(); ++v) {
    const bool isStrip =
        labels[v] == kLowerLabel && fromUpper[static_cast<Eigen::Index>(v)] < options.overlapTrim;
    if (steps[v] || isStrip)
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
