#include "bullet_ext/core/cloth_mesh.h"

#include "bullet_ext/core/cloth_topology.h"
#include "bullet_ext/core/element_index.h"
#include "bullet_ext/core/torsion_force.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

namespace bullet_ext {
namespace {

[[noreturn]] void fail(const std::string& problem) {
  throw std::invalid_argument("cloth: " + problem);
}

std::string numbered(const std::string& what, Eigen::Index i) {
  return what + " " + std::to_string(i);
}

void requireVertices(const Eigen::Matrix3Xd& vertices) {
  constexpr double kFarthest = 1e4;  // float keeps a millimetre there
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    if (!(vertices.col(v).cwiseAbs().maxCoeff() <= kFarthest) || !vertices.col(v).allFinite()) {
      fail(numbered("vertex", v) + " has a coordinate that is not finite or beyond 10 km");
    }
  }
}

void requireArea(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces, Eigen::Index f) {
  constexpr double kShortestEdge = 1e-6;  // [m]
  constexpr double kFlattest = 1e-4;      // altitude / longest edge
  const Eigen::Vector3d a = vertices.col(faces(0, f));
  const Eigen::Vector3d b = vertices.col(faces(1, f));
  const Eigen::Vector3d c = vertices.col(faces(2, f));
  const std::array<double, 3> lengths = {(b - a).norm(), (c - b).norm(), (a - c).norm()};
  const auto [shortest, longest] = std::minmax_element(lengths.begin(), lengths.end());
  const double doubleArea = (b - a).cross(c - a).norm();
  if (*shortest < kShortestEdge || doubleArea < kFlattest * *longest * *longest) {
    fail(numbered("face", f) + " has no area (its corners coincide or are on one line)");
  }
}

void requireCorners(const Eigen::Matrix3Xi& faces, Eigen::Index f, Eigen::Index numVertices) {
  for (const int vertex : faces.col(f)) {
    if (vertex < 0 || vertex >= numVertices) {
      fail(
          numbered("face", f) + " names " + numbered("vertex", vertex) + ", there are " +
          std::to_string(numVertices));
    }
  }
}

void requireFaces(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces) {
  std::vector<bool> used(at(vertices.cols()), false);
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    requireCorners(faces, f, vertices.cols());
    requireArea(vertices, faces, f);
    for (const int vertex : faces.col(f)) {
      used[at(vertex)] = true;
    }
  }
  const auto unused = std::find(used.begin(), used.end(), false);
  if (unused != used.end()) {
    fail(numbered("vertex", unused - used.begin()) + " belongs to no face: remove it");
  }
}

/// Per-item values from options, checked: written so that NaN fails.
struct ValueRange {
  std::string name;
  double lowest, highest;
};

void requireValues(
    const std::vector<double>& values, Eigen::Index expected, const ValueRange& range) {
  if (!values.empty() && values.size() != at(expected)) {
    fail(
        range.name + " has " + std::to_string(values.size()) + " values, must have " +
        std::to_string(expected) + " or none");
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] >= range.lowest && values[i] <= range.highest)) {
      fail(
          range.name + "[" + std::to_string(i) + "] is " + std::to_string(values[i]) +
          ", outside its range");
    }
  }
}

void setOrder(ClothMesh& mesh, const Eigen::Matrix3Xd& vertices, VertexOrder order) {
  mesh.inputFromSolver.resize(at(vertices.cols()));
  std::iota(mesh.inputFromSolver.begin(), mesh.inputFromSolver.end(), 0);
  if (order == VertexOrder::kMorton) {
    mesh.inputFromSolver = mortonOrder(vertices);
  }
  mesh.solverFromInput.resize(mesh.inputFromSolver.size());
  for (std::size_t i = 0; i < mesh.inputFromSolver.size(); ++i) {
    mesh.solverFromInput[at(mesh.inputFromSolver[i])] = static_cast<int>(i);
  }
  mesh.restPositions = toSolverOrder(mesh, vertices);
}

/// Faces that share vertices become neighbours in memory, too.
void setFaces(ClothMesh& mesh, const Eigen::Matrix3Xi& faces) {
  Eigen::Matrix3Xi renamed = faces.unaryExpr([&](int v) { return mesh.solverFromInput[at(v)]; });
  std::vector<int> order(at(faces.cols()));
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int f) {
    std::array<int, 3> corners = {renamed(0, f), renamed(1, f), renamed(2, f)};
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  mesh.faces = renamed(Eigen::all, order);
}

void setElements(ClothMesh& mesh) {
  ClothTopology topology = buildClothTopology(mesh.faces, mesh.inputFromSolver);
  mesh.springs = std::move(topology.edges);
  mesh.faceSprings = std::move(topology.faceEdges);
  mesh.hingeSprings = std::move(topology.hingeEdges);
  mesh.hingeFaces = std::move(topology.hingeFaces);
  mesh.hinges.resize(4, topology.hingeWings.cols());
  mesh.hinges.topRows<2>() = mesh.springs(Eigen::all, mesh.hingeSprings);
  mesh.hinges.bottomRows<2>() = topology.hingeWings;
}

void setRestShape(ClothMesh& mesh) {
  mesh.springRestLengths.resize(mesh.springs.cols());
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    mesh.springRestLengths[s] =
        (mesh.restPositions.col(mesh.springs(1, s)) - mesh.restPositions.col(mesh.springs(0, s)))
            .norm();
  }
  mesh.squaredWidthLimits.resize(mesh.faces.cols());
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    mesh.squaredWidthLimits[f] = squaredWidthLimit(mesh, f);
  }
  mesh.hingeRestAngles.resize(mesh.hinges.cols());
  for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
    const HingeVectors<double> x = mesh.restPositions(Eigen::all, mesh.hinges.col(h));
    mesh.hingeRestAngles[h] = hingeAngle(x).angle;
  }
}

/// The springs as the input has its edges: lexicographic in the input's vertices.
std::vector<int> springsInInputOrder(const ClothMesh& mesh) {
  std::vector<int> order(at(mesh.springs.cols()));
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int s) {
    return std::minmax(
        {mesh.inputFromSolver[at(mesh.springs(0, s))],
         mesh.inputFromSolver[at(mesh.springs(1, s))]});
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  return order;
}

void setStiffness(ClothMesh& mesh, const ClothMeshOptions& options) {
  requireValues(
      options.edgeStretchStiffness, mesh.springs.cols(), {"edgeStretchStiffness", 0.0, 1e7});
  requireValues(
      options.hingeTorsionStiffness, mesh.hinges.cols(), {"hingeTorsionStiffness", 0.0, 1e4});
  mesh.springStiffness.setConstant(mesh.springs.cols(), mesh.material.stretchStiffness);
  mesh.hingeStiffness.setConstant(mesh.hinges.cols(), mesh.material.torsionStiffness);
  std::vector<int> hingeOfSpring(at(mesh.springs.cols()), -1);
  for (std::size_t h = 0; h < mesh.hingeSprings.size(); ++h) {
    hingeOfSpring[at(mesh.hingeSprings[h])] = static_cast<int>(h);
  }
  std::size_t edge = 0;
  std::size_t inputHinge = 0;
  for (const int spring : springsInInputOrder(mesh)) {
    if (!options.edgeStretchStiffness.empty()) {
      mesh.springStiffness[spring] = options.edgeStretchStiffness[edge++];
    }
    const int hinge = hingeOfSpring[at(spring)];
    if (hinge >= 0 && !options.hingeTorsionStiffness.empty()) {
      mesh.hingeStiffness[hinge] = options.hingeTorsionStiffness[inputHinge++];
    }
  }
}

Eigen::VectorXd arealMasses(const ClothMesh& mesh) {
  Eigen::VectorXd masses = Eigen::VectorXd::Zero(mesh.numVertices());
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    const Eigen::Matrix3d x = mesh.restPositions(Eigen::all, mesh.faces.col(f));
    const double area = 0.5 * (x.col(1) - x.col(0)).cross(x.col(2) - x.col(0)).norm();
    masses(mesh.faces.col(f)).array() += mesh.material.arealDensity * area / 3.0;
  }
  return masses;
}

void setMasses(ClothMesh& mesh, const ClothMeshOptions& options) {
  requireValues(options.vertexMasses, mesh.numVertices(), {"vertexMasses", 1e-9, 1e3});
  if (!options.vertexMasses.empty()) {
    const Eigen::Map<const Eigen::RowVectorXd> given(
        options.vertexMasses.data(), mesh.numVertices());
    mesh.masses = toSolverOrder(mesh, Eigen::RowVectorXd(given)).transpose();
  } else if (mesh.material.massMode == MassMode::kAreal) {
    mesh.masses = arealMasses(mesh);
  } else {
    mesh.masses.setConstant(mesh.numVertices(), mesh.material.vertexMass);
  }
  mesh.inverseMasses = mesh.masses.cwiseInverse();
}

void setPins(ClothMesh& mesh, const std::vector<int>& pins) {
  for (const int pin : pins) {
    if (pin < 0 || pin >= mesh.numVertices()) {
      fail(
          numbered("pin", pin) + " is not a vertex, there are " +
          std::to_string(mesh.numVertices()));
    }
    mesh.pins.push_back(mesh.solverFromInput[at(pin)]);
  }
  std::sort(mesh.pins.begin(), mesh.pins.end());
  mesh.pins.erase(std::unique(mesh.pins.begin(), mesh.pins.end()), mesh.pins.end());
  for (const int pin : mesh.pins) {
    mesh.inverseMasses[pin] = 0.0;
  }
}

}  // namespace

ClothMesh buildClothMesh(
    const Eigen::Matrix3Xd& vertices,
    const Eigen::Matrix3Xi& faces,
    const ClothMaterial& material,
    const ClothMeshOptions& options) {
  material.validate();
  if (faces.cols() == 0) {
    fail("the mesh has no faces");
  }
  requireVertices(vertices);
  requireFaces(vertices, faces);
  ClothMesh mesh;
  mesh.material = material;
  setOrder(mesh, vertices, options.vertexOrder);
  setFaces(mesh, faces);
  setElements(mesh);
  setRestShape(mesh);
  setStiffness(mesh, options);
  setMasses(mesh, options);
  setPins(mesh, options.pins);
  return mesh;
}

}  // namespace bullet_ext
