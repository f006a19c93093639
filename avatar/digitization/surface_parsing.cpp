#include "avatar/digitization/surface_parsing.h"

#include "avatar/digitization/label_mrf.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/mesh_clip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

LabelProblem labelProblem(
    const OuterSurface& surface, const Adjacency& adjacency, const SurfaceParsingOptions& options) {
  LabelProblem problem;
  problem.costs.reserve(surface.labels.size());
  const double seldom = options.seldom * usualCount(surface.labels);
  for (const LabelCounts& counts : surface.labels) {
    const auto sum = static_cast<double>(timesSeen(counts));
    const double trust = sum / (sum + seldom + 1e-9);
    std::array<double, kNumSurfaceLabels> costs = {};
    for (std::size_t l = 0; l < costs.size(); ++l)
      costs[l] = -trust * std::log((counts[l] + 1.0) / (sum + 3.0));
    problem.costs.push_back(costs);
  }
  problem.edges = adjacency.edges;
  problem.edgeWeights.resize(adjacency.numEdges());
  double totalLength = 0.0;
  for (Eigen::Index e = 0; e < adjacency.numEdges(); ++e) {
    const int a = adjacency.edges(0, e);
    const int b = adjacency.edges(1, e);
    const double change = (surface.colors.col(a) - surface.colors.col(b)).norm();
    const double length = (surface.mesh.vertices.col(a) - surface.mesh.vertices.col(b)).norm();
    problem.edgeWeights[e] = std::exp(-0.5 * std::pow(change / options.colorScale, 2)) * length;
    totalLength += length;
  }
  if (totalLength > 0.0)
    problem.edgeWeights *=
        options.boundaryCost * static_cast<double>(adjacency.numEdges()) / totalLength;
  return problem;
}

/// Vertices of one label connected over edges.
struct Part {
  std::vector<int> vertices;
  double area = 0.0;  // [m²]
};

/// All that `start` is connected with; marks it as visited.
Part partFrom(
    int start,
    const std::vector<std::uint8_t>& labels,
    const Adjacency& adjacency,
    std::vector<bool>& visited) {
  const std::uint8_t label = labels[static_cast<std::size_t>(start)];
  Part part{.vertices = {start}};
  visited[static_cast<std::size_t>(start)] = true;
  for (std::size_t i = 0; i < part.vertices.size(); ++i) {
    for (const int next : adjacency.vertexVertices[part.vertices[i]]) {
      const auto n = static_cast<std::size_t>(next);
      if (visited[n] || labels[n] != label)
        continue;
      visited[n] = true;
      part.vertices.push_back(next);
    }
  }
  return part;
}

std::vector<Part> parts(
    const std::vector<std::uint8_t>& labels,
    const Adjacency& adjacency,
    const Eigen::VectorXd& vertexArea) {
  std::vector<Part> result;
  std::vector<bool> visited(labels.size(), false);
  for (std::size_t start = 0; start < labels.size(); ++start) {
    if (visited[start])
      continue;
    result.push_back(partFrom(static_cast<int>(start), labels, adjacency, visited));
    for (const int v : result.back().vertices)
      result.back().area += vertexArea[v];
  }
  return result;
}

/// The label that most edges out of a part lead to; its own when there are none.
std::uint8_t surroundingLabel(
    const Part& part, const std::vector<std::uint8_t>& labels, const Adjacency& adjacency) {
  const std::uint8_t own = labels[static_cast<std::size_t>(part.vertices.front())];
  std::array<int, kNumSurfaceLabels + 1> edges = {};
  for (const int v : part.vertices) {
    for (const int next : adjacency.vertexVertices[v]) {
      const std::uint8_t label = labels[static_cast<std::size_t>(next)];
      edges[label] += label != own ? 1 : 0;
    }
  }
  const auto most = std::max_element(edges.begin(), edges.end());
  return *most > 0 ? static_cast<std::uint8_t>(most - edges.begin()) : own;
}

void removeSmallParts(
    std::vector<std::uint8_t>& labels,
    const Adjacency& adjacency,
    const Eigen::VectorXd& vertexArea,
    double smallestPart) {
  std::vector<Part> all = parts(labels, adjacency, vertexArea);
  std::stable_sort(
      all.begin(), all.end(), [](const Part& a, const Part& b) { return a.area < b.area; });
  for (const Part& part : all) {
    if (part.area >= smallestPart)
      break;
    const std::uint8_t label = surroundingLabel(part, labels, adjacency);
    for (const int v : part.vertices)
      labels[static_cast<std::size_t>(v)] = label;
  }
}

Eigen::VectorXd vertexAreas(const MeshView& mesh) {
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(mesh.numVertices());
  const Eigen::VectorXd faces = faceAreas(mesh);
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    for (int corner = 0; corner < 3; ++corner)
      areas[mesh.faces(corner, f)] += faces[f] / 3.0;
  }
  return areas;
}

}  // namespace

void SurfaceParsingOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("SurfaceParsingOptions: ") + what);
  };
  demand(boundaryCost >= 0.0, "boundaryCost is expected at 0 or above");
  demand(colorScale > 0.0, "colorScale is expected above 0");
  demand(seldom >= 0.0, "seldom is expected at 0 or above");
  demand(smallestPart >= 0.0, "smallestPart is expected at 0 m² or above");
}

int timesSeen(const LabelCounts& counts) {
  return counts[0] + counts[1] + counts[2];
}

double usualCount(const std::vector<LabelCounts>& labels) {
  std::vector<int> seen;
  for (const LabelCounts& counts : labels) {
    if (const int times = timesSeen(counts); times > 0)
      seen.push_back(times);
  }
  if (seen.empty())
    return 1.0;
  const auto middle = seen.begin() + std::ssize(seen) / 2;
  std::nth_element(seen.begin(), middle, seen.end());
  return *middle;
}

std::vector<std::uint8_t> parsedSurface(
    const OuterSurface& surface, const SurfaceParsingOptions& options) {
  options.validate();
  const Adjacency adjacency = buildAdjacency(surface.mesh.faces, surface.mesh.numVertices());
  std::vector<std::uint8_t> labels = leastEnergyLabels(labelProblem(surface, adjacency, options));
  removeSmallParts(labels, adjacency, vertexAreas(surface.mesh), options.smallestPart);
  return labels;
}

TriangleMesh labelledPart(
    const MeshView& mesh, const std::vector<std::uint8_t>& labels, SurfaceLabel label, int rounds) {
  if (static_cast<Eigen::Index>(labels.size()) != mesh.numVertices())
    throw std::invalid_argument("labelledPart: one label per vertex is expected");
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  Eigen::VectorXd values(mesh.numVertices());
  for (Eigen::Index v = 0; v < values.size(); ++v)
    values[v] = labels[static_cast<std::size_t>(v)] == label ? -1.0 : 1.0;
  for (int round = 0; round < rounds; ++round) {
    Eigen::VectorXd next = values;
    for (int v = 0; v < values.size(); ++v) {
      double sum = values[v];
      for (const int neighbour : adjacency.vertexVertices[v])
        sum += values[neighbour];
      next[v] = sum / (1.0 + static_cast<double>(adjacency.vertexVertices[v].size()));
    }
    values = next;
  }
  return clippedMesh(mesh, values);
}

}  // namespace avatar
