#include "bullet_ext/core/vertex_zones.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>

namespace bullet_ext {
namespace {

struct Zone {
  std::vector<int> vertices;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero(), pinSum = Eigen::Vector4d::Zero();
  double mass = 0.0;
  int pins = 0;

  void add(int vertex, const Eigen::Vector4d& displacement, const ContactElements& elements) {
    vertices.push_back(vertex);
    if (elements.inverseMasses[at(vertex)] == 0.0F) {
      pinSum += displacement;
      ++pins;
    } else {
      sum += elements.masses[at(vertex)] * displacement;
      mass += elements.masses[at(vertex)];
    }
  }

  void translate(const ContactElements& elements, SubstepMotion& motion) const {
    const Eigen::Vector4f displacement =
        (pins > 0 ? Eigen::Vector4d(pinSum / pins) : Eigen::Vector4d(sum / mass)).cast<float>();
    for (const int v : vertices) {
      if (elements.inverseMasses[at(v)] != 0.0F) {
        motion.end.col(v) = motion.start.col(v) + displacement;
      }
    }
  }
};

}  // namespace

VertexZones::VertexZones(Eigen::Index numVertices) : parents_(at(numVertices)) {
  std::iota(parents_.begin(), parents_.end(), 0);
}

int VertexZones::root(int vertex) {
  while (parents_[at(vertex)] != vertex) {
    int& parent = parents_[at(vertex)];
    parent = parents_[at(parent)];
    vertex = parent;
  }
  return vertex;
}

bool VertexZones::join(const std::array<int, 4>& vertices) {
  std::array<int, 4> roots = {};
  std::transform(
      vertices.begin(), vertices.end(), roots.begin(), [this](int v) { return root(v); });
  const int smallest = *std::min_element(roots.begin(), roots.end());
  bool joined = false;
  for (const int r : roots) {
    joined = joined || r != smallest;
    parents_[at(r)] = smallest;
  }
  return joined;
}

int VertexZones::translate(const ContactElements& elements, SubstepMotion& motion) {
  std::map<int, Zone> zones;  // without those of single vertices
  const int count = static_cast<int>(parents_.size());
  for (int v = 0; v < count; ++v) {
    if (root(v) != v) {
      zones[root(v)];
    }
  }
  for (int v = 0; v < count; ++v) {
    const auto zone = zones.find(root(v));
    if (zone != zones.end()) {
      zone->second.add(v, (motion.end.col(v) - motion.start.col(v)).cast<double>(), elements);
    }
  }
  for (const auto& [r, zone] : zones) {
    zone.translate(elements, motion);
  }
  return static_cast<int>(zones.size());
}

}  // namespace bullet_ext
