#include "src/comparison/reference_solver.h"

#include "src/simulation/cloth_setup.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace simulcap {
namespace {

using Edge = std::pair<int, int>;  // smaller vertex first, input order

Edge edgeOf(int a, int b) {
  return std::minmax(a, b);
}

/// k or w by edge, as the scene says. Given values alone are taken from the other solver's mesh:
/// which edges there are, their rest lengths and angles are the reference's own finding.
std::map<Edge, double> byEdge(
    const bullet_ext::ClothMesh& mesh,
    const Eigen::Ref<const Eigen::Matrix2Xi>& edges,
    const Eigen::VectorXd& values) {
  std::map<Edge, double> result;
  for (Eigen::Index i = 0; i < edges.cols(); ++i) {
    const int a = mesh.inputFromSolver[static_cast<std::size_t>(edges(0, i))];
    const int b = mesh.inputFromSolver[static_cast<std::size_t>(edges(1, i))];
    result[edgeOf(a, b)] = values[i];
  }
  return result;
}

reference::Cloth referenceCloth(const StagedCloth& staged) {
  reference::Cloth cloth = reference::buildCloth(staged.rest.vertices, staged.rest.faces);
  const bullet_ext::ClothMesh mesh = clothMesh(staged);
  const auto stretch = byEdge(mesh, mesh.springs, mesh.springStiffness);
  for (reference::StretchSpring& spring : cloth.springs)
    spring.stiffness = stretch.at(edgeOf(spring.a, spring.b));
  const auto torsion = byEdge(mesh, mesh.hinges.topRows<2>(), mesh.hingeStiffness);
  for (reference::TorsionSpring& hinge : cloth.hinges)
    hinge.stiffness = torsion.at(edgeOf(hinge.p[0], hinge.p[1]));
  for (std::size_t v = 0; v < cloth.vertices.size(); ++v) {
    cloth.vertices[v].mass = mesh.masses[mesh.solverFromInput[v]];
    cloth.vertices[v].position = staged.start.col(static_cast<Eigen::Index>(v));
  }
  for (const int pin : staged.pins)
    cloth.vertices[static_cast<std::size_t>(pin)].pinned = true;
  return cloth;
}

/// Pairs of vertices that are two edges apart, and not one.
std::set<Edge> secondNeighbours(const reference::Cloth& cloth) {
  std::vector<std::set<int>> neighbours(cloth.vertices.size());
  for (const reference::StretchSpring& spring : cloth.springs) {
    neighbours[static_cast<std::size_t>(spring.a)].insert(spring.b);
    neighbours[static_cast<std::size_t>(spring.b)].insert(spring.a);
  }
  std::set<Edge> pairs;
  for (const std::set<int>& around : neighbours) {
    std::set<int> others = around;
    for (const int a : around) {
      others.erase(a);
      std::set<int> far;
      const std::set<int>& near = neighbours[static_cast<std::size_t>(a)];
      std::set_difference(
          others.begin(), others.end(), near.begin(), near.end(), std::inserter(far, far.end()));
      for (const int b : far)
        pairs.emplace(a, b);
    }
  }
  return pairs;
}

/// The same cloth with the links that Bullet has instead of hinges.
reference::Cloth withBendingLinks(reference::Cloth cloth, const StagedCloth& staged) {
  const std::set<Edge> pairs = secondNeighbours(cloth);
  double sum = 0.0;
  for (const reference::StretchSpring& spring : cloth.springs)
    sum += spring.stiffness;
  const double mean = sum / static_cast<double>(cloth.springs.size());
  for (reference::StretchSpring& spring : cloth.springs)
    spring.stiffness = mean;
  for (const auto& [a, b] : pairs) {
    const double length = (staged.rest.vertices.col(a) - staged.rest.vertices.col(b)).norm();
    cloth.springs.push_back({a, b, length, mean});
  }
  cloth.hinges.clear();
  return cloth;
}

}  // namespace

ReferenceSolver::ReferenceSolver(const ComparisonTask& task, ClothEnergy energy, int stepsPerFrame)
    : task_(task), stepsPerFrame_(stepsPerFrame) {
  for (const StagedCloth& staged : task.stage.cloths) {
    const bool perSubstep = staged.parameters.dampingMode == avatar::DampingMode::kPerSubstep;
    reference::Cloth cloth = referenceCloth(staged);
    if (energy == ClothEnergy::kBendingLinks)
      cloth = withBendingLinks(std::move(cloth), staged);
    pieces_.push_back(
        {std::move(cloth),
         {.duration = task.frameDuration() / stepsPerFrame,
          .gravity = task.scene.gravity,
          .dampingMode =
              perSubstep ? reference::DampingMode::kPerSubstep : reference::DampingMode::kPerSecond,
          .damping = staged.parameters.damping}});
  }
}

bool ReferenceSolver::advance() {
  ++frame_;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    Piece& piece = pieces_[i];
    const StagedCloth& staged = task_.stage.cloths[i];
    const Eigen::Matrix3Xd targets = task_.pinsAt(staged, frame_);
    for (std::size_t p = 0; p < staged.pins.size(); ++p) {
      reference::Vertex& vertex = piece.cloth.vertices[static_cast<std::size_t>(staged.pins[p])];
      const Eigen::Vector3d way = targets.col(static_cast<Eigen::Index>(p)) - vertex.position;
      vertex.velocity = way / task_.frameDuration();
    }
    for (int step = 0; step < stepsPerFrame_; ++step)
      reference::step(piece.cloth, piece.options);
  }
  return true;
}

Eigen::Matrix3Xd ReferenceSolver::vertices(int cloth) const {
  const auto& vertices = pieces_[static_cast<std::size_t>(cloth)].cloth.vertices;
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t v = 0; v < vertices.size(); ++v)
    result.col(static_cast<Eigen::Index>(v)) = vertices[v].position;
  return result;
}

}  // namespace simulcap
