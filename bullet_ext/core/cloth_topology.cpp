#include "bullet_ext/core/cloth_topology.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

namespace bullet_ext {
namespace {

struct HalfEdge {
  int low, high;  ///< its vertices
  int face, corner;
  bool rising;  ///< the face runs from low to high
};

std::vector<HalfEdge> sortedHalfEdges(const Eigen::Matrix3Xi& faces) {
  std::vector<HalfEdge> halfEdges;
  halfEdges.reserve(static_cast<std::size_t>(faces.size()));
  for (int face = 0; face < faces.cols(); ++face) {
    for (int corner = 0; corner < 3; ++corner) {
      const int from = faces(corner, face);
      const int to = faces((corner + 1) % 3, face);
      halfEdges.push_back({std::min(from, to), std::max(from, to), face, corner, from < to});
    }
  }
  // The rising one of a pair first.
  std::sort(halfEdges.begin(), halfEdges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, b.rising, a.face) < std::tie(b.low, b.high, a.rising, b.face);
  });
  return halfEdges;
}

void requireManifold(
    const HalfEdge* first, std::ptrdiff_t count, const std::vector<int>& vertexNames) {
  const auto name = [&](int vertex) {
    return std::to_string(vertexNames[static_cast<std::size_t>(vertex)]);
  };
  const std::string edge =
      "cloth: the edge between vertices " + name(first->low) + " and " + name(first->high);
  if (count > 2) {
    throw std::invalid_argument(
        edge + " has " + std::to_string(count) + " faces, at most 2 can meet in one");
  }
  if (count == 2 && first[0].rising == first[1].rising) {
    throw std::invalid_argument(
        edge + " is run along in the same direction by both of its faces: orient the faces alike");
  }
}

/// Spreads the lowest 21 bits to every third.
std::uint64_t spreadBits(std::uint64_t x) {
  x = (x | x << 32U) & 0x001F00000000FFFFU;
  x = (x | x << 16U) & 0x001F0000FF0000FFU;
  x = (x | x << 8U) & 0x100F00F00F00F00FU;
  x = (x | x << 4U) & 0x10C30C30C30C30C3U;
  x = (x | x << 2U) & 0x1249249249249249U;
  return x;
}

}  // namespace

ClothTopology buildClothTopology(
    const Eigen::Matrix3Xi& faces, const std::vector<int>& vertexNames) {
  const std::vector<HalfEdge> halfEdges = sortedHalfEdges(faces);
  ClothTopology result;
  result.faceEdges.resize(3, faces.cols());
  result.edges.resize(2, faces.size());
  result.hingeFaces.resize(2, faces.size());
  result.hingeWings.resize(2, faces.size());
  const auto wing = [&](const HalfEdge& h) { return faces((h.corner + 2) % 3, h.face); };
  int edge = 0;
  for (std::size_t i = 0; i < halfEdges.size(); ++edge) {
    const HalfEdge& first = halfEdges[i];
    std::size_t end = i;
    for (; end < halfEdges.size() && halfEdges[end].low == first.low &&
           halfEdges[end].high == first.high;
         ++end) {
      result.faceEdges(halfEdges[end].corner, halfEdges[end].face) = edge;
    }
    requireManifold(&first, static_cast<std::ptrdiff_t>(end - i), vertexNames);
    result.edges.col(edge) << first.low, first.high;
    if (end == i + 2) {
      const auto hinge = static_cast<Eigen::Index>(result.hingeEdges.size());
      result.hingeEdges.push_back(edge);
      result.hingeFaces.col(hinge) << first.face, halfEdges[i + 1].face;
      result.hingeWings.col(hinge) << wing(first), wing(halfEdges[i + 1]);
    }
    i = end;
  }
  result.edges.conservativeResize(2, edge);
  const auto numHinges = static_cast<Eigen::Index>(result.hingeEdges.size());
  result.hingeFaces.conservativeResize(2, numHinges);
  result.hingeWings.conservativeResize(2, numHinges);
  return result;
}

std::vector<int> mortonOrder(const Eigen::Matrix3Xd& positions) {
  std::vector<int> order(static_cast<std::size_t>(positions.cols()));
  std::iota(order.begin(), order.end(), 0);
  if (order.empty()) {
    return order;
  }
  const Eigen::Vector3d origin = positions.rowwise().minCoeff();
  const double size =
      std::max((positions.rowwise().maxCoeff() - origin).maxCoeff(), 1e-30);  // all in one point
  constexpr double kCells = (1U << 21U) - 1U;
  std::vector<std::uint64_t> codes(order.size());
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const Eigen::Vector3d cell =
        (positions.col(static_cast<Eigen::Index>(i)) - origin) * (kCells / size);
    codes[i] = spreadBits(static_cast<std::uint64_t>(cell.x())) |
               spreadBits(static_cast<std::uint64_t>(cell.y())) << 1U |
               spreadBits(static_cast<std::uint64_t>(cell.z())) << 2U;
  }
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return codes[static_cast<std::size_t>(a)] < codes[static_cast<std::size_t>(b)];
  });
  return order;
}

}  // namespace bullet_ext
