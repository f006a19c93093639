#include "avatar/geometry/polygonise.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <unordered_map>
#include <vector>

namespace avatar {
namespace {

constexpr int kBlock = 8;  // cells along the edge of a block

// A grid node packed into one integer: 20 bits per axis.
std::int64_t nodeKey(const Eigen::Vector3i& node) {
  return (static_cast<std::int64_t>(node.x()) << 40) | (static_cast<std::int64_t>(node.y()) << 20) |
         static_cast<std::int64_t>(node.z());
}

// Corner c of a cube is offset by its bits: x = bit 0, y = bit 1, z = bit 2.
Eigen::Vector3i cornerOffset(int corner) {
  return {corner & 1, (corner >> 1) & 1, corner >> 2};
}

// Kuhn's six tetrahedra around the diagonal 0–7, all positively oriented.
constexpr int kTetrahedra[6][4] = {
    {0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};

class Polygoniser {
 public:
  Polygoniser(
      const std::function<double(const Eigen::Vector3d&)>& field, const PolygoniseOptions& options)
      : field_(field), options_(options) {
    const Eigen::Vector3d extent = options.box.sizes() / options.cellSize;
    numCells_ = extent.array().ceil().cast<int>();
    if (numCells_.minCoeff() < 1 || numCells_.maxCoeff() >= (1 << 20)) {
      throw std::invalid_argument("polygonise: box and cell size give an unusable grid");
    }
  }

  TriangleMesh run() {
    const Eigen::Vector3i numBlocks = (numCells_.array() + kBlock - 1) / kBlock;
    for (int bx = 0; bx < numBlocks.x(); ++bx) {
      for (int by = 0; by < numBlocks.y(); ++by) {
        for (int bz = 0; bz < numBlocks.z(); ++bz)
          visitBlock(kBlock * Eigen::Vector3i(bx, by, bz));
      }
    }
    return mesh();
  }

 private:
  Eigen::Vector3d position(const Eigen::Vector3i& node) const {
    return options_.box.min() + options_.cellSize * node.cast<double>();
  }

  void visitBlock(const Eigen::Vector3i& first) {
    const double reach = 0.5 * std::sqrt(3.0) * kBlock * options_.cellSize;
    const Eigen::Vector3d center =
        position(first) + Eigen::Vector3d::Constant(0.5 * kBlock * options_.cellSize);
    if (std::abs(field_(center)) > options_.steepestSlope * reach)
      return;
    sampleBlock(first);
    const Eigen::Vector3i last = (first.array() + kBlock).min(numCells_.array());
    for (int x = first.x(); x < last.x(); ++x) {
      for (int y = first.y(); y < last.y(); ++y) {
        for (int z = first.z(); z < last.z(); ++z)
          visitCell({x, y, z}, first);
      }
    }
  }

  // Corners of the block's cells, z fastest.
  void sampleBlock(const Eigen::Vector3i& first) {
    constexpr int kSide = kBlock + 1;
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const Eigen::Vector3i inBlock(i / (kSide * kSide), i / kSide % kSide, i % kSide);
      samples_[static_cast<std::size_t>(i)] = field_(position(first + inBlock));
    }
  }

  double sample(const Eigen::Vector3i& inBlock) const {
    return samples_[(inBlock.x() * (kBlock + 1) + inBlock.y()) * (kBlock + 1) + inBlock.z()];
  }

  void visitCell(const Eigen::Vector3i& cell, const Eigen::Vector3i& blockFirst) {
    std::array<double, 8> values{};
    int numInside = 0;
    for (int corner = 0; corner < 8; ++corner) {
      values[corner] = sample(cell + cornerOffset(corner) - blockFirst);
      numInside += values[corner] < 0.0 ? 1 : 0;
    }
    if (numInside == 0 || numInside == 8)
      return;
    for (const auto& tetrahedron : kTetrahedra)
      visitTetrahedron(cell, tetrahedron, values);
  }

  void visitTetrahedron(
      const Eigen::Vector3i& cell, const int (&corners)[4], const std::array<double, 8>& values) {
    std::array<int, 4> inside{};
    std::array<int, 4> outside{};
    int numInside = 0;
    int numOutside = 0;
    for (const int corner : corners) {
      (values[corner] < 0.0 ? inside[numInside++] : outside[numOutside++]) = corner;
    }
    const auto cut = [&](int a, int b) { return vertexOnEdge(cell, a, b, values); };
    if (numInside == 1 || numOutside == 1) {
      const int lone = numInside == 1 ? inside[0] : outside[0];
      const auto& rest = numInside == 1 ? outside : inside;
      addTriangle(
          {cut(lone, rest[0]), cut(lone, rest[1]), cut(lone, rest[2])}, cell, lone, numInside == 1);
    } else if (numInside == 2) {
      const int a = cut(inside[0], outside[0]);
      const int b = cut(inside[0], outside[1]);
      const int c = cut(inside[1], outside[1]);
      const int d = cut(inside[1], outside[0]);
      addTriangle({a, b, c}, cell, inside[0], true);
      addTriangle({a, c, d}, cell, inside[0], true);
    }
  }

  // The reference corner tells which side is inside; the triangle is turned to face outward.
  void addTriangle(
      Eigen::Vector3i triangle,
      const Eigen::Vector3i& cell,
      int reference,
      bool referenceIsInside) {
    const Eigen::Vector3d& p = vertices_[triangle[0]];
    const Eigen::Vector3d normal = (vertices_[triangle[1]] - p).cross(vertices_[triangle[2]] - p);
    const double side = normal.dot(position(cell + cornerOffset(reference)) - p);
    if ((side > 0.0) == referenceIsInside)
      std::swap(triangle[1], triangle[2]);
    faces_.push_back(triangle);
  }

  int vertexOnEdge(const Eigen::Vector3i& cell, int a, int b, const std::array<double, 8>& values) {
    if (a > b)
      std::swap(a, b);
    const Eigen::Vector3i nodeA = cell + cornerOffset(a);
    const Eigen::Vector3i direction = cornerOffset(b) - cornerOffset(a);
    const int code = direction.x() + 2 * direction.y() + 4 * direction.z();
    const std::int64_t key = nodeKey(nodeA) * 8 + code;
    const auto [entry, isNew] = vertexOfEdge_.try_emplace(key, static_cast<int>(vertices_.size()));
    if (isNew) {
      // Keep clear of the nodes, so that no triangle collapses to a point.
      constexpr double kMargin = 0.02;
      const double t = std::clamp(values[a] / (values[a] - values[b]), kMargin, 1.0 - kMargin);
      vertices_.push_back(position(nodeA) + t * options_.cellSize * direction.cast<double>());
    }
    return entry->second;
  }

  TriangleMesh mesh() const {
    TriangleMesh result;
    result.vertices.resize(3, static_cast<Eigen::Index>(vertices_.size()));
    result.faces.resize(3, static_cast<Eigen::Index>(faces_.size()));
    for (std::size_t i = 0; i < vertices_.size(); ++i)
      result.vertices.col(i) = vertices_[i];
    for (std::size_t i = 0; i < faces_.size(); ++i)
      result.faces.col(i) = faces_[i];
    return result;
  }

  const std::function<double(const Eigen::Vector3d&)>& field_;
  const PolygoniseOptions& options_;
  Eigen::Vector3i numCells_;
  std::array<double, (kBlock + 1) * (kBlock + 1) * (kBlock + 1)> samples_{};
  std::unordered_map<std::int64_t, int> vertexOfEdge_;  // looked up only, never iterated
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> faces_;
};

}  // namespace

TriangleMesh polygonise(
    const std::function<double(const Eigen::Vector3d&)>& signedDistance,
    const PolygoniseOptions& options) {
  return Polygoniser(signedDistance, options).run();
}

}  // namespace avatar
