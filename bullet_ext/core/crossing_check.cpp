#include "bullet_ext/core/crossing_check.h"

#include "bullet_ext/core/element_index.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <tuple>

namespace bullet_ext {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// A sum of doubles without rounding (Shewchuk 1997): its terms don't overlap and grow, so the
/// last one has the sign of the sum.
class ExactSum {
 public:
  void add(double value) {
    std::size_t kept = 0;
    for (const double term : terms_) {
      const double sum = value + term;
      const double virtualTerm = sum - value;
      const double error = (value - (sum - virtualTerm)) + (term - virtualTerm);
      value = sum;
      if (error != 0.0) {
        terms_[kept++] = error;
      }
    }
    terms_.resize(kept);
    if (value != 0.0) {
      terms_.push_back(value);
    }
  }

  static ExactSum difference(double a, double b) {
    ExactSum result;
    result.add(a);
    result.add(-b);
    return result;
  }

  ExactSum operator*(const ExactSum& other) const {
    ExactSum product;
    for (const double a : terms_) {
      for (const double b : other.terms_) {
        const double rounded = a * b;
        product.add(std::fma(a, b, -rounded));
        product.add(rounded);
      }
    }
    return product;
  }

  void add(const ExactSum& other, double sign) {
    for (const double term : other.terms_) {
      add(sign * term);
    }
  }

  int sign() const { return terms_.empty() ? 0 : (terms_.back() > 0.0 ? 1 : -1); }

 private:
  std::vector<double> terms_;
};

int signOf(double value) {
  return static_cast<int>(value > 0.0) - static_cast<int>(value < 0.0);
}

using ExactVector = std::array<ExactSum, 3>;

ExactVector exactDifference(const Vector3d& a, const Vector3d& b) {
  return {
      ExactSum::difference(a[0], b[0]),
      ExactSum::difference(a[1], b[1]),
      ExactSum::difference(a[2], b[2])};
}

int exactOrientation(const Matrix3d& corners, const Vector3d& d) {
  const ExactVector u = exactDifference(corners.col(0), d);
  const ExactVector v = exactDifference(corners.col(1), d);
  const ExactVector w = exactDifference(corners.col(2), d);
  ExactSum determinant;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    determinant.add(u[i] * (v[j] * w[k]), -1.0);
    determinant.add(u[i] * (v[k] * w[j]), 1.0);
  }
  return determinant.sign();
}

/// Sign of the area of a b c: 1 when they turn counterclockwise.
int orientation2(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const double left = (a[0] - c[0]) * (b[1] - c[1]);
  const double right = (a[1] - c[1]) * (b[0] - c[0]);
  const double bound = 3.3306690738754716e-16 * (std::abs(left) + std::abs(right));
  if (std::abs(left - right) > bound) {
    return signOf(left - right);
  }
  ExactSum area = ExactSum::difference(a[0], c[0]) * ExactSum::difference(b[1], c[1]);
  area.add(ExactSum::difference(a[1], c[1]) * ExactSum::difference(b[0], c[0]), -1.0);
  return area.sign();
}

/// Whether two closed segments of a plane have a common point.
bool segmentsMeet(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d) {
  if ((a.cwiseMin(b).array() > c.cwiseMax(d).array()).any() ||
      (c.cwiseMin(d).array() > a.cwiseMax(b).array()).any()) {
    return false;
  }
  return orientation2(a, b, c) * orientation2(a, b, d) <= 0 &&
         orientation2(c, d, a) * orientation2(c, d, b) <= 0;
}

bool meetsInPlane(
    const Vector2d& p, const Vector2d& q, const Eigen::Matrix<double, 2, 3>& triangle) {
  const int turn = orientation2(triangle.col(0), triangle.col(1), triangle.col(2));
  bool inside = true;
  for (int k = 0; k < 3; ++k) {
    const Vector2d a = triangle.col(k);
    const Vector2d b = triangle.col((k + 1) % 3);
    if (segmentsMeet(p, q, a, b)) {
      return true;
    }
    inside = inside && orientation2(a, b, p) * turn >= 0;
  }
  return inside;
}

/// A segment in the plane of a triangle, seen along an axis that shows the triangle's area.
bool meetsCoplanar(const Vector3d& p, const Vector3d& q, const Matrix3d& triangle) {
  constexpr std::array<std::array<int, 2>, 3> kPlanes = {{{0, 1}, {1, 2}, {2, 0}}};
  for (const std::array<int, 2>& plane : kPlanes) {
    const Eigen::Matrix<double, 2, 3> flat = triangle(plane, Eigen::all);
    if (orientation2(flat.col(0), flat.col(1), flat.col(2)) != 0) {
      return meetsInPlane(p(plane), q(plane), flat);
    }
  }
  return false;
}

/// One triangle of one surface with its box.
struct Triangle {
  int surface = 0;
  int face = 0;
  Eigen::Vector3i vertices;
  Matrix3d corners;
  Vector3d low, high;
};

void addTriangles(std::vector<Triangle>& triangles, const TriangleSurface& surface, int index) {
  for (Eigen::Index f = 0; f < surface.faces.cols(); ++f) {
    const Eigen::Vector3i vertices = surface.faces.col(f);
    if (vertices.minCoeff() < 0 || vertices.maxCoeff() >= surface.vertices.cols()) {
      throw std::invalid_argument(
          "findCrossings: face " + std::to_string(f) + " of surface " + std::to_string(index) +
          " names a vertex that does not exist");
    }
    const Matrix3d corners = surface.vertices(Eigen::all, vertices);
    if (corners.allFinite()) {
      triangles.push_back(
          {index,
           static_cast<int>(f),
           vertices,
           corners,
           corners.rowwise().minCoeff(),
           corners.rowwise().maxCoeff()});
    }
  }
}

/// Whether an edge of a meets b; edges that begin or end in a common vertex don't count.
bool edgesMeet(const Triangle& a, const Triangle& b) {
  for (int k = 0; k < 3; ++k) {
    const int p = a.vertices[k];
    const int q = a.vertices[(k + 1) % 3];
    const bool common = a.surface == b.surface &&
                        ((b.vertices.array() == p).any() || (b.vertices.array() == q).any());
    if (!common && meets(a.corners.col(k), a.corners.col((k + 1) % 3), b.corners)) {
      return true;
    }
  }
  return false;
}

bool cross(const Triangle& a, const Triangle& b) {
  if ((a.low.array() > b.high.array()).any() || (b.low.array() > a.high.array()).any()) {
    return false;
  }
  return edgesMeet(a, b) || edgesMeet(b, a);
}

Crossing crossingOf(const Triangle& a, const Triangle& b) {
  const bool inOrder = std::tie(a.surface, a.face) < std::tie(b.surface, b.face);
  const Triangle& first = inOrder ? a : b;
  const Triangle& second = inOrder ? b : a;
  return {first.surface, first.face, second.surface, second.face};
}

void addCrossings(
    std::vector<Crossing>& crossings,
    const Triangle& a,
    std::span<const Triangle> others,
    const CrossingOptions& options) {
  for (const Triangle& b : others) {
    const bool wanted = a.surface == b.surface ? options.within : options.between;
    if (wanted && cross(a, b)) {
      crossings.push_back(crossingOf(a, b));
    }
  }
}

/// Whether a triangle reaches into the box of another surface.
bool isNearOthers(const Triangle& triangle, const std::vector<Eigen::AlignedBox3d>& boxes) {
  const Eigen::AlignedBox3d own(triangle.low, triangle.high);
  for (std::size_t other = 0; other < boxes.size(); ++other) {
    if (other != at(triangle.surface) && boxes[other].intersects(own)) {
      return true;
    }
  }
  return false;
}

void keepNearOthers(std::vector<Triangle>& triangles, std::size_t numSurfaces) {
  std::vector<Eigen::AlignedBox3d> boxes(numSurfaces);
  for (const Triangle& triangle : triangles) {
    boxes[at(triangle.surface)].extend(Eigen::AlignedBox3d(triangle.low, triangle.high));
  }
  std::erase_if(
      triangles, [&](const Triangle& triangle) { return !isNearOthers(triangle, boxes); });
}

/// Index of the longest side of the box around all triangles.
int longestAxis(const std::vector<Triangle>& triangles) {
  Vector3d low = Vector3d::Constant(1e300);
  Vector3d high = -low;
  for (const Triangle& triangle : triangles) {
    low = low.cwiseMin(triangle.low);
    high = high.cwiseMax(triangle.high);
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  return static_cast<int>(axis);
}

}  // namespace

int orientation(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = a - d;
  const Vector3d v = b - d;
  const Vector3d w = c - d;
  const double determinant = -u.dot(v.cross(w));
  const Vector3d sizes(
      std::abs(v[1] * w[2]) + std::abs(v[2] * w[1]),
      std::abs(v[2] * w[0]) + std::abs(v[0] * w[2]),
      std::abs(v[0] * w[1]) + std::abs(v[1] * w[0]));
  if (std::abs(determinant) > 7.7715611723761027e-16 * u.cwiseAbs().dot(sizes)) {
    return signOf(determinant);
  }
  Matrix3d corners;
  corners << a, b, c;
  return exactOrientation(corners, d);
}

bool meets(const Vector3d& p, const Vector3d& q, const Matrix3d& triangle) {
  const Vector3d a = triangle.col(0);
  const Vector3d b = triangle.col(1);
  const Vector3d c = triangle.col(2);
  const int sideOfP = orientation(a, b, c, p);
  const int sideOfQ = orientation(a, b, c, q);
  if (sideOfP == 0 && sideOfQ == 0) {
    return meetsCoplanar(p, q, triangle);
  }
  if (sideOfP * sideOfQ > 0) {
    return false;
  }
  const int ab = orientation(p, q, a, b);
  const int bc = orientation(p, q, b, c);
  const int ca = orientation(p, q, c, a);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

std::vector<Crossing> findCrossings(
    std::span<const TriangleSurface> surfaces, const CrossingOptions& options) {
  std::vector<Triangle> triangles;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    addTriangles(triangles, surfaces[s], static_cast<int>(s));
  }
  if (!options.within) {
    keepNearOthers(triangles, surfaces.size());
  }
  const int axis = longestAxis(triangles);
  std::stable_sort(triangles.begin(), triangles.end(), [&](const Triangle& a, const Triangle& b) {
    return a.low[axis] < b.low[axis];
  });
  std::vector<Crossing> crossings;
  for (auto a = triangles.begin(); a != triangles.end(); ++a) {
    const auto end = std::find_if(
        a, triangles.end(), [&](const Triangle& b) { return b.low[axis] > a->high[axis]; });
    addCrossings(crossings, *a, {a + 1, std::max(a + 1, end)}, options);
  }
  const auto key = [](const Crossing& c) {
    return std::tie(c.surface1, c.face1, c.surface2, c.face2);
  };
  std::sort(crossings.begin(), crossings.end(), [&](const Crossing& a, const Crossing& b) {
    return key(a) < key(b);
  });
  return crossings;
}

}  // namespace bullet_ext
