#include "src/reference/cloth.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace reference {
namespace {

using Eigen::Vector3d;

const Vector3d& at(const Cloth& cloth, int vertex) {
  return cloth.vertices[static_cast<std::size_t>(vertex)].position;
}

Vector3d& at(Forces& forces, int vertex) {
  return forces[static_cast<std::size_t>(vertex)];
}

using DirectedEdges = std::map<std::pair<int, int>, int>;

/// Adds (from, to) with the corner opposite to it.
void addEdge(int from, int to, int opposite, DirectedEdges& edges) {
  if (!edges.emplace(std::pair(from, to), opposite).second) {
    throw std::invalid_argument(
        "reference::buildCloth: faces overlap or differ in orientation at an edge");
  }
}

DirectedEdges directedEdges(const Eigen::Matrix3Xi& faces, Eigen::Index numVertices) {
  if (faces.size() > 0 && (faces.minCoeff() < 0 || faces.maxCoeff() >= numVertices)) {
    throw std::invalid_argument("reference::buildCloth: a face names a vertex there isn't");
  }
  DirectedEdges edges;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      addEdge(faces(k, f), faces((k + 1) % 3, f), faces((k + 2) % 3, f), edges);
    }
  }
  return edges;
}

/// How far a hinge is bent [rad], the shorter way around.
double bendAngle(const Cloth& cloth, const TorsionSpring& hinge) {
  return std::remainder(torsionAngle(cloth, hinge.p) - hinge.restAngle, 2.0 * std::numbers::pi);
}

/// Fig. 4(d), and the statics of a door: the moment M pushes the wing p3 with M/h along its
/// triangle's normal, h being its distance from the hinge, and the hinge holds against it, each of
/// its ends by its share of the lever. All of it together has no resultant and no torque.
void pushWing(const Cloth& cloth, const std::array<int, 3>& triangle, double moment, Forces& to) {
  const auto [p1, p2, p3] = triangle;
  const Vector3d edge = at(cloth, p2) - at(cloth, p1);
  const Vector3d arm = at(cloth, p3) - at(cloth, p1);
  const double lever = arm.dot(edge) / edge.squaredNorm();  // 0 at p1, 1 at p2
  const double height = (arm - lever * edge).norm();
  const Vector3d force = moment / height * edge.cross(arm).normalized();
  at(to, p3) += force;
  at(to, p2) -= lever * force;
  at(to, p1) -= (1.0 - lever) * force;
}

}  // namespace

Cloth buildCloth(
    const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& faces, const Material& material) {
  const DirectedEdges edges = directedEdges(faces, vertices.cols());
  Cloth cloth;
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    cloth.vertices.push_back({.position = vertices.col(v), .mass = material.vertexMass});
  }
  for (const auto& [edge, opposite] : edges) {
    const auto [a, b] = edge;
    const auto other = edges.find({b, a});
    if (other != edges.end() && b < a) {
      continue;  // the same edge from its other side
    }
    cloth.springs.push_back(
        {a, b, (at(cloth, b) - at(cloth, a)).norm(), material.stretchStiffness});
    if (other != edges.end()) {
      const std::array<int, 4> p = {a, b, opposite, other->second};
      cloth.hinges.push_back({p, torsionAngle(cloth, p), material.torsionStiffness});
    }
  }
  return cloth;
}

double torsionAngle(const Cloth& cloth, const std::array<int, 4>& p) {
  const Vector3d edge = at(cloth, p[1]) - at(cloth, p[0]);
  const Vector3d first = edge.cross(at(cloth, p[2]) - at(cloth, p[0])).normalized();
  const Vector3d toFourth = at(cloth, p[3]) - at(cloth, p[0]);
  const Vector3d second = toFourth.cross(edge).normalized();
  const double angle = std::atan2(first.cross(second).norm(), first.dot(second));
  return toFourth.dot(first) > 0.0 ? -angle : angle;  // a valley: the wing rises to the normal
}

Forces noForces(const Cloth& cloth) {
  return Forces(cloth.vertices.size(), Vector3d::Zero());
}

void addStretchForces(const Cloth& cloth, Forces& forces) {
  for (const StretchSpring& spring : cloth.springs) {
    const Vector3d edge = at(cloth, spring.b) - at(cloth, spring.a);
    const double halfDifference = 0.5 * (edge.norm() - spring.restLength);  // Δx in Fig. 4(b)
    const Vector3d force = spring.stiffness * halfDifference * edge.normalized();
    at(forces, spring.a) += force;
    at(forces, spring.b) -= force;
  }
}

void addTorsionForces(const Cloth& cloth, Forces& forces) {
  for (const TorsionSpring& hinge : cloth.hinges) {
    const auto& p = hinge.p;
    const double moment = hinge.stiffness * bendAngle(cloth, hinge);
    pushWing(cloth, {p[0], p[1], p[2]}, moment, forces);
    pushWing(cloth, {p[1], p[0], p[3]}, moment, forces);
  }
}

void addGravity(const Cloth& cloth, const Vector3d& acceleration, Forces& forces) {
  for (std::size_t v = 0; v < cloth.vertices.size(); ++v) {
    forces[v] += cloth.vertices[v].mass * acceleration;
  }
}

double stretchEnergy(const Cloth& cloth) {
  double energy = 0.0;
  for (const StretchSpring& spring : cloth.springs) {
    const double extension = (at(cloth, spring.b) - at(cloth, spring.a)).norm() - spring.restLength;
    energy += 0.25 * spring.stiffness * extension * extension;
  }
  return energy;
}

double torsionEnergy(const Cloth& cloth) {
  double energy = 0.0;
  for (const TorsionSpring& hinge : cloth.hinges) {
    const double angle = bendAngle(cloth, hinge);
    energy += 0.5 * hinge.stiffness * angle * angle;
  }
  return energy;
}

double kineticEnergy(const Cloth& cloth) {
  double energy = 0.0;
  for (const Vertex& vertex : cloth.vertices) {
    energy += 0.5 * vertex.mass * vertex.velocity.squaredNorm();
  }
  return energy;
}

void step(Cloth& cloth, const StepOptions& options, const Forces& others) {
  Forces forces = others.empty() ? noForces(cloth) : others;
  addGravity(cloth, options.gravity, forces);
  addStretchForces(cloth, forces);
  addTorsionForces(cloth, forces);
  const double dt = options.duration;
  const double remaining = options.dampingMode == DampingMode::kPerSubstep
                               ? 1.0 - options.damping
                               : std::exp(-options.damping * dt);
  for (std::size_t v = 0; v < cloth.vertices.size(); ++v) {
    Vertex& vertex = cloth.vertices[v];
    const Vector3d oldVelocity = vertex.velocity;
    if (!vertex.pinned) {
      vertex.velocity = remaining * (oldVelocity + dt / vertex.mass * forces[v]);
    }
    const bool forward = options.integrator == Integrator::kForwardEuler;
    vertex.position += dt * (forward ? oldVelocity : vertex.velocity);
  }
}

}  // namespace reference
