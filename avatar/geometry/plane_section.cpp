#include "avatar/geometry/plane_section.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// The edges along which a face's rim leads from above the plane to below and back; −1: not cut.
struct FaceCut {
  int down = -1;
  int up = -1;
};

FaceCut cutFace(
    const MeshView& mesh,
    const Adjacency& adjacency,
    const Eigen::VectorXd& heights,
    Eigen::Index face) {
  FaceCut cut;
  for (int k = 0; k < 3; ++k) {
    const bool fromAbove = heights[mesh.faces(k, face)] >= 0.0;
    const bool toAbove = heights[mesh.faces((k + 1) % 3, face)] >= 0.0;
    if (fromAbove != toAbove) {
      (fromAbove ? cut.down : cut.up) = adjacency.faceEdges(k, face);
    }
  }
  return cut;
}

/// For every cut edge the next one along its loop, −1 for the others. Walked from the edge down to
/// the edge up, a face has the inside on its left. A neighbour runs along the shared edge the other
/// way, so that the edge up is the edge down of the next face.
std::vector<int> nextCutEdges(
    const MeshView& mesh, const Adjacency& adjacency, const Eigen::VectorXd& heights) {
  std::vector<int> next(static_cast<std::size_t>(adjacency.numEdges()), -1);
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    const FaceCut cut = cutFace(mesh, adjacency, heights, face);
    if (cut.down < 0) {
      continue;
    }
    int& follower = next[static_cast<std::size_t>(cut.down)];
    if (follower >= 0) {
      throw std::invalid_argument("plane section: two faces run along an edge the same way");
    }
    follower = cut.up;
  }
  return next;
}

Eigen::Vector2d cutPoint(
    const MeshView& mesh,
    const Eigen::Vector2i& edge,
    const Eigen::VectorXd& heights,
    const PlaneFrame& plane) {
  const double a = heights[edge[0]];
  const double b = heights[edge[1]];
  const Eigen::Vector3d from = mesh.vertices.col(edge[0]);
  const Eigen::Vector3d to = mesh.vertices.col(edge[1]);
  return plane.project(from + a / (a - b) * (to - from));
}

/// Appends the lower hull of points sorted from left to right (the upper one from right to left),
/// without its last point, with which the other chain begins.
void addHullChain(auto first, auto last, std::vector<Eigen::Vector2d>& hull) {
  const std::size_t start = hull.size();
  const auto turnsLeft = [&hull](const Eigen::Vector2d& point) {
    return cross(hull.back() - *(hull.end() - 2), point - hull.back()) > 0.0;
  };
  for (auto point = first; point != last; ++point) {
    while (hull.size() >= start + 2 && !turnsLeft(*point)) {
      hull.pop_back();
    }
    hull.push_back(*point);
  }
  hull.pop_back();
}

}  // namespace

PlaneFrame planeThrough(const Eigen::Vector3d& origin, const Eigen::Vector3d& normal) {
  constexpr double kRounding = 1e-9;  // of a vector that was normalised once
  if (!origin.allFinite() || !(std::abs(normal.norm() - 1.0) < kRounding)) {
    throw std::invalid_argument("plane: the origin must be finite, the normal of unit length");
  }
  PlaneFrame plane;
  plane.origin = origin;
  plane.axes.col(0) = normal.unitOrthogonal();
  plane.axes.col(1) = normal.cross(plane.axes.col(0));
  return plane;
}

std::vector<PlaneLoop> planeSection(
    const MeshView& mesh, const Adjacency& adjacency, const PlaneFrame& plane) {
  if (adjacency.faceEdges.cols() != mesh.numFaces()) {
    throw std::invalid_argument("plane section: the adjacency is that of another mesh");
  }
  const Eigen::VectorXd heights =
      ((mesh.vertices.colwise() - plane.origin).transpose() * plane.normal());
  std::vector<int> next = nextCutEdges(mesh, adjacency, heights);
  std::vector<PlaneLoop> loops;
  std::vector<int> cutEdges;
  for (std::size_t first = 0; first < next.size(); ++first) {
    cutEdges.clear();
    int edge = static_cast<int>(first);
    while (next[static_cast<std::size_t>(edge)] >= 0) {
      cutEdges.push_back(edge);
      edge = std::exchange(next[static_cast<std::size_t>(edge)], -1);
    }
    if (cutEdges.empty()) {
      continue;
    }
    if (edge != static_cast<int>(first)) {
      throw std::invalid_argument("plane section: the mesh is not closed");
    }
    PlaneLoop& loop = loops.emplace_back(2, std::ssize(cutEdges));
    for (Eigen::Index i = 0; i < loop.cols(); ++i) {
      const int cut = cutEdges[static_cast<std::size_t>(i)];
      loop.col(i) = cutPoint(mesh, adjacency.edges.col(cut), heights, plane);
    }
  }
  return loops;
}

double signedArea(const PlaneLoop& loop) {
  double area = 0.0;
  for (Eigen::Index i = 0; i < loop.cols(); ++i) {
    // Relative to the first point: no cancellation far from the plane's origin.
    const Eigen::Index j = (i + 1) % loop.cols();
    area += 0.5 * cross(loop.col(i) - loop.col(0), loop.col(j) - loop.col(0));
  }
  return area;
}

bool encloses(const PlaneLoop& loop, const Eigen::Vector2d& point) {
  bool inside = false;
  for (Eigen::Index i = 0; i < loop.cols(); ++i) {
    const Eigen::Vector2d a = loop.col(i) - point;
    const Eigen::Vector2d b = loop.col((i + 1) % loop.cols()) - point;
    if ((a.y() > 0.0) != (b.y() > 0.0) && a.x() + a.y() / (a.y() - b.y()) * (b.x() - a.x()) > 0.0) {
      inside = !inside;
    }
  }
  return inside;
}

Eigen::Matrix2Xd convexHull(const Eigen::Matrix2Xd& points) {
  std::vector<Eigen::Vector2d> sorted(points.colwise().begin(), points.colwise().end());
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Eigen::Vector2d> hull;
  if (sorted.size() > 1) {
    addHullChain(sorted.begin(), sorted.end(), hull);
    addHullChain(sorted.rbegin(), sorted.rend(), hull);
  } else {
    hull = sorted;
  }
  Eigen::Matrix2Xd result(2, std::ssize(hull));
  for (Eigen::Index i = 0; i < result.cols(); ++i) {
    result.col(i) = hull[static_cast<std::size_t>(i)];
  }
  return result;
}

double perimeter(const PlaneLoop& loop) {
  double length = 0.0;
  for (Eigen::Index i = 0; i < loop.cols(); ++i) {
    length += (loop.col((i + 1) % loop.cols()) - loop.col(i)).norm();
  }
  return length;
}

}  // namespace avatar
