#include "bullet_ext/core/contact_elements.h"

#include "bullet_ext/core/element_index.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>

namespace bullet_ext {
namespace {

constexpr std::ptrdiff_t kVerticesPerPatch = 16;

void requireValid(const ContactGarment& garment, std::size_t index) {
  const std::string name = "contact: garment " + std::to_string(index);
  if (garment.mesh == nullptr) {
    throw std::invalid_argument(name + " has no mesh");
  }
  if (!(garment.thickness >= 1e-6 && garment.thickness <= 0.1)) {
    throw std::invalid_argument(name + ": thickness must be within [1e-6, 0.1] m");
  }
  if (!(garment.friction >= 0.0 && garment.friction <= 10.0)) {
    throw std::invalid_argument(name + ": friction must be within [0, 10]");
  }
}

/// Halves the vertices across their longest extent until the halves are small; calls
/// `accept(begin, end)` for each.
template <typename Accept>
void bisect(
    const Eigen::Matrix4Xf& positions,
    std::vector<int>::iterator begin,
    std::vector<int>::iterator end,
    const Accept& accept) {
  if (end - begin <= kVerticesPerPatch) {
    accept(begin, end);
    return;
  }
  Eigen::Array4f low = positions.col(*begin);
  Eigen::Array4f high = low;
  std::for_each(begin, end, [&](int v) {
    low = low.min(positions.col(v).array());
    high = high.max(positions.col(v).array());
  });
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const auto middle = begin + (end - begin) / 2;
  std::sort(begin, end, [&](int a, int b) {
    const float xa = positions(axis, a);
    const float xb = positions(axis, b);
    return xa < xb || (xa == xb && a < b);
  });
  bisect(positions, begin, middle, accept);
  bisect(positions, middle, end, accept);
}

void addGarment(ContactElements& all, const ContactGarment& garment) {
  const ClothMesh& mesh = *garment.mesh;
  const Eigen::Index vertices = all.numVertices();
  const Eigen::Index faces = all.faces.cols();
  const Eigen::Index edges = all.edges.cols();
  const int index = static_cast<int>(all.layers.size());
  all.restPositions.conservativeResize(4, vertices + mesh.numVertices());
  all.restPositions.rightCols(mesh.numVertices()).setZero();
  all.restPositions.rightCols(mesh.numVertices()).topRows<3>() = mesh.restPositions.cast<float>();
  all.faces.conservativeResize(3, faces + mesh.faces.cols());
  all.faces.rightCols(mesh.faces.cols()) = mesh.faces.array() + static_cast<int>(vertices);
  all.edges.conservativeResize(2, edges + mesh.springs.cols());
  all.edges.rightCols(mesh.springs.cols()) = mesh.springs.array() + static_cast<int>(vertices);
  all.garments.resize(at(all.numVertices()), index);
  all.masses.insert(all.masses.end(), mesh.masses.begin(), mesh.masses.end());
  for (const double inverseMass : mesh.inverseMasses) {
    all.inverseMasses.push_back(static_cast<float>(inverseMass));
  }
  all.layers.push_back(garment.layer);
  all.firstVertices.push_back(static_cast<int>(all.numVertices()));
  all.firstFaces.push_back(static_cast<int>(all.faces.cols()));
}

void addPatches(ContactElements& all, std::size_t garment) {
  std::vector<int> order(at(all.firstVertices[garment + 1] - all.firstVertices[garment]));
  std::iota(order.begin(), order.end(), all.firstVertices[garment]);
  bisect(all.restPositions, order.begin(), order.end(), [&](auto begin, auto end) {
    ContactPatch patch = {.garment = static_cast<int>(garment), .vertices = {begin, end}};
    std::sort(patch.vertices.begin(), patch.vertices.end());
    all.patches.push_back(std::move(patch));
  });
}

void assignElements(ContactElements& all) {
  std::vector<std::size_t> patchOf(at(all.numVertices()));
  for (std::size_t p = 0; p < all.patches.size(); ++p) {
    for (const int v : all.patches[p].vertices) {
      patchOf[at(v)] = p;
    }
    all.patches[p].corners = all.patches[p].vertices;
  }
  const auto assign = [&](const auto& elements, std::vector<int> ContactPatch::*list) {
    for (Eigen::Index e = 0; e < elements.cols(); ++e) {
      ContactPatch& patch = all.patches[patchOf[at(elements(0, e))]];
      (patch.*list).push_back(static_cast<int>(e));
      const auto element = elements.col(e);
      patch.corners.insert(patch.corners.end(), element.begin(), element.end());
    }
  };
  assign(all.edges, &ContactPatch::edges);
  assign(all.faces, &ContactPatch::faces);
  for (ContactPatch& patch : all.patches) {
    std::sort(patch.corners.begin(), patch.corners.end());
    patch.corners.erase(
        std::unique(patch.corners.begin(), patch.corners.end()), patch.corners.end());
  }
}

/// G × G means of a value per garment.
Eigen::MatrixXf means(std::span<const ContactGarment> garments, double ContactGarment::*value) {
  const auto count = static_cast<Eigen::Index>(garments.size());
  return Eigen::MatrixXf::NullaryExpr(count, count, [&](Eigen::Index a, Eigen::Index b) {
    return static_cast<float>(0.5 * (garments[at(a)].*value + garments[at(b)].*value));
  });
}

}  // namespace

ContactElements buildContactElements(std::span<const ContactGarment> garments) {
  ContactElements all;
  all.firstVertices = {0};
  all.firstFaces = {0};
  for (std::size_t g = 0; g < garments.size(); ++g) {
    requireValid(garments[g], g);
    addGarment(all, garments[g]);
    addPatches(all, g);
  }
  all.thickness = means(garments, &ContactGarment::thickness);
  all.friction = means(garments, &ContactGarment::friction);
  assignElements(all);
  return all;
}

}  // namespace bullet_ext
