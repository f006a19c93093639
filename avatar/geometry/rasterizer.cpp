#include "avatar/geometry/rasterizer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

using std::int32_t;
using std::int64_t;

constexpr int kSubpixelBits = 8;
constexpr int64_t kSubpixels = 1 << kSubpixelBits;

/// Farthest image position that is kept without clipping [px]: 2^23 subpixels, so products of two
/// differences stay below 2^49.
constexpr double kGuard = 32768.0;
constexpr int kMaxImageSide = 16384;

/// Boxes up to this wide are tested pixel by pixel; wider ones solve each row for its span [px].
constexpr int kSmallBoxWidth = 8;

int32_t toSubpixel(double pixel) {
  constexpr double kShift = 1 << 24;  // makes the number positive, so that truncation rounds down
  return static_cast<int32_t>(
      static_cast<int64_t>(pixel * kSubpixels + (0.5 + kShift)) - static_cast<int64_t>(kShift));
}

struct SubpixelPoint {
  int64_t x, y;  // [1/256 px]
};

/// The half plane right of a directed edge, as exact integers: value ≥ 0 inside.
struct Edge {
  int64_t value;         // at the box's first pixel, then at the row's first pixel
  int64_t stepX, stepY;  // per pixel

  Edge(SubpixelPoint a, SubpixelPoint b, SubpixelPoint pixel) {
    const int64_t dx = b.x - a.x;
    const int64_t dy = b.y - a.y;
    // Top-left rule: a centre exactly on the edge counts only for left and for upper edges.
    const int64_t bias = dy < 0 || (dy == 0 && dx > 0) ? 0 : -1;
    value = dx * (pixel.y - a.y) - dy * (pixel.x - a.x) + bias;
    stepX = -dy * kSubpixels;
    stepY = dx * kSubpixels;
  }

  /// Shrinks [first, last], counted from the row's first pixel, to where the value is ≥ 0.
  void limit(int64_t& first, int64_t& last) const {
    if (stepX > 0) {
      first = std::max(first, value < 0 ? (-value + stepX - 1) / stepX : 0);
    } else if (value < 0) {
      last = -1;
    } else if (stepX < 0) {
      last = std::min(last, value / -stepX);
    }
  }
};

/// The triangle's plane over the image (Olano & Greer 1997): weights over z are affine in (u, v),
/// b_i / z = ray(u, v) · (p_j × p_k) / det(p_0, p_1, p_2), and their sum is 1 / z.
struct PlaneFunctions {
  Eigen::Matrix3d weights;  // row i: constant, per u, per v of b_i / z [1/m]
  Eigen::RowVector3d sum;   // of the rows
  Eigen::Vector3d z;        // of the three vertices [m]
};

PlaneFunctions planeFunctions(const std::array<Eigen::Vector3d, 3>& p, const Camera& camera) {
  PlaneFunctions plane;
  const Eigen::Vector3d c0 = p[1].cross(p[2]);
  const double inverse = 1.0 / p[0].dot(c0);
  plane.weights.row(0) = inverse * c0;
  plane.weights.row(1) = inverse * p[2].cross(p[0]);
  plane.weights.row(2) = inverse * p[0].cross(p[1]);
  plane.weights.col(0) /= camera.fx;
  plane.weights.col(1) /= camera.fy;
  plane.weights.col(2) -= camera.cx * plane.weights.col(0) + camera.cy * plane.weights.col(1);
  plane.sum = plane.weights.colwise().sum();
  plane.z << p[0].z(), p[1].z(), p[2].z();
  return plane;
}

struct Polygon {
  std::array<Eigen::Vector3d, 9> points;  // a triangle cut by five planes has at most 8 corners
  int size = 0;

  void add(const Eigen::Vector3d& p) { points[static_cast<std::size_t>(size++)] = p; }

  const Eigen::Vector3d& operator[](int i) const { return points[static_cast<std::size_t>(i)]; }
};

/// Keeps the part with normal · p ≥ offset (Sutherland & Hodgman 1974). A cut is always computed
/// from the inner to the outer end, so both faces of an edge get the same point.
Polygon clip(const Polygon& polygon, const Eigen::Vector3d& normal, double offset) {
  Polygon result;
  for (int i = 0; i < polygon.size; ++i) {
    const Eigen::Vector3d& p = polygon[i];
    const Eigen::Vector3d& q = polygon[(i + 1) % polygon.size];
    const double dp = normal.dot(p) - offset;
    const double dq = normal.dot(q) - offset;
    if (dp >= 0.0) {
      result.add(p);
    }
    if (dp >= 0.0 && dq < 0.0) {
      result.add(p + dp / (dp - dq) * (q - p));
    } else if (dp < 0.0 && dq >= 0.0) {
      result.add(q + dq / (dq - dp) * (p - q));
    }
  }
  return result;
}

/// The part in front of the near plane and within the guard band around the image.
Polygon clipToGuardBand(
    const std::array<Eigen::Vector3d, 3>& triangle, const Camera& camera, double nearPlane) {
  Polygon polygon;
  for (const Eigen::Vector3d& p : triangle) {
    polygon.add(p);
  }
  polygon = clip(polygon, Eigen::Vector3d::UnitZ(), nearPlane);
  polygon = clip(polygon, {-camera.fx, 0.0, kGuard - camera.cx}, 0.0);
  polygon = clip(polygon, {camera.fx, 0.0, kGuard + camera.cx}, 0.0);
  polygon = clip(polygon, {0.0, -camera.fy, kGuard - camera.cy}, 0.0);
  return clip(polygon, {0.0, camera.fy, kGuard + camera.cy}, 0.0);
}

}  // namespace

/// Fills one face of one mesh.
class Rasterizer::TrianglePainter {
 public:
  TrianglePainter(const Rasterizer& rasterizer, RasterImage& image, int32_t object)
      : rasterizer_(rasterizer), image_(image), object_(object) {}

  void drawFace(const Eigen::Vector3i& face, int32_t index) {
    const ProjectedVertex& a = vertex(face[0]);
    const ProjectedVertex& b = vertex(face[1]);
    const ProjectedVertex& c = vertex(face[2]);
    const double nearPlane = rasterizer_.options_.nearPlane;
    if (a.point.z() < nearPlane && b.point.z() < nearPlane && c.point.z() < nearPlane) {
      return;
    }
    const bool inside = a.inside && b.inside && c.inside;
    if (inside && outsideImage(a, b, c)) {
      return;
    }
    const double det = a.point.dot(b.point.cross(c.point));
    // The outward normal n has n · a = det, and points towards the camera when that is negative.
    if (!(std::abs(det) > 1e-300) || (rasterizer_.options_.cullBackFaces && det > 0.0)) {
      return;
    }
    face_ = index;
    plane_ = planeFunctions({a.point, b.point, c.point}, rasterizer_.camera_);
    if (inside) {
      fill(a, b, c);
    } else {
      fillClipped({a.point, b.point, c.point});
    }
  }

 private:
  struct Box {
    int32_t x0, y0, x1, y1;  // pixels, both ends included

    bool empty() const { return x0 > x1 || y0 > y1; }
  };

  const ProjectedVertex& vertex(int i) const {
    return rasterizer_.projected_[static_cast<std::size_t>(i)];
  }

  Box pixelBox(const ProjectedVertex& a, const ProjectedVertex& b, const ProjectedVertex& c) const {
    constexpr int32_t kRoundUp = kSubpixels - 1;
    return {
        std::max(0, (std::min({a.x, b.x, c.x}) + kRoundUp) >> kSubpixelBits),
        std::max(0, (std::min({a.y, b.y, c.y}) + kRoundUp) >> kSubpixelBits),
        std::min(image_.width - 1, std::max({a.x, b.x, c.x}) >> kSubpixelBits),
        std::min(image_.height - 1, std::max({a.y, b.y, c.y}) >> kSubpixelBits)};
  }

  bool outsideImage(
      const ProjectedVertex& a, const ProjectedVertex& b, const ProjectedVertex& c) const {
    return pixelBox(a, b, c).empty();
  }

  void fillClipped(const std::array<Eigen::Vector3d, 3>& triangle) {
    const Polygon polygon =
        clipToGuardBand(triangle, rasterizer_.camera_, rasterizer_.options_.nearPlane);
    for (int i = 2; i < polygon.size; ++i) {
      fill(
          rasterizer_.projected(polygon[0]),
          rasterizer_.projected(polygon[i - 1]),
          rasterizer_.projected(polygon[i]));
    }
  }

  void fill(const ProjectedVertex& a, const ProjectedVertex& b, const ProjectedVertex& c) {
    const Box box = pixelBox(a, b, c);
    const int64_t area = int64_t{b.x - a.x} * (c.y - a.y) - int64_t{b.y - a.y} * (c.x - a.x);
    if (area == 0 || box.empty()) {
      return;
    }
    const SubpixelPoint first{a.x, a.y};
    const SubpixelPoint second = area > 0 ? SubpixelPoint{b.x, b.y} : SubpixelPoint{c.x, c.y};
    const SubpixelPoint third = area > 0 ? SubpixelPoint{c.x, c.y} : SubpixelPoint{b.x, b.y};
    const SubpixelPoint corner{int64_t{box.x0} << kSubpixelBits, int64_t{box.y0} << kSubpixelBits};
    std::array<Edge, 3> edges = {
        Edge(first, second, corner), Edge(second, third, corner), Edge(third, first, corner)};
    for (int32_t y = box.y0; y <= box.y1; ++y) {
      if (box.x1 - box.x0 < kSmallBoxWidth) {
        fillSmallRow(box, y, edges);
      } else {
        fillLongRow(box, y, edges);
      }
      for (Edge& edge : edges) {
        edge.value += edge.stepY;
      }
    }
  }

  void fillSmallRow(const Box& box, int32_t y, const std::array<Edge, 3>& edges) {
    int64_t e0 = edges[0].value;
    int64_t e1 = edges[1].value;
    int64_t e2 = edges[2].value;
    for (int32_t x = box.x0; x <= box.x1; ++x) {
      if ((e0 | e1 | e2) >= 0) {  // no sign bit set
        fillPixel(x, y);
      }
      e0 += edges[0].stepX;
      e1 += edges[1].stepX;
      e2 += edges[2].stepX;
    }
  }

  void fillLongRow(const Box& box, int32_t y, const std::array<Edge, 3>& edges) {
    int64_t first = 0;
    int64_t last = box.x1 - box.x0;
    for (const Edge& edge : edges) {
      edge.limit(first, last);
    }
    for (int64_t x = first; x <= last; ++x) {
      fillPixel(box.x0 + static_cast<int32_t>(x), y);
    }
  }

  void fillPixel(int32_t x, int32_t y) {
    const double inverseZ = plane_.sum[0] * x + plane_.sum[1] * y + plane_.sum[2];
    const std::size_t pixel = image_.index(x, y);
    Eigen::Vector3d b =
        plane_.weights.col(0) * x + plane_.weights.col(1) * y + plane_.weights.col(2);
    double z = 1.0 / inverseZ;
    b *= z;
    if (!(b.minCoeff() >= 0.0 && inverseZ > 0.0)) {
      z = nearestPointInFace(b, inverseZ);
    }
    const float depth = static_cast<float>(z);
    const float old = image_.depth[pixel];
    if (!(depth > 0.0F) || (old > 0.0F && depth >= old)) {
      return;
    }
    image_.depth[pixel] = depth;
    image_.triangle[pixel] = face_;
    image_.object[pixel] = object_;
    if (rasterizer_.options_.barycentrics) {
      image_.barycentrics[2 * pixel] = static_cast<float>(b[0]);
      image_.barycentrics[2 * pixel + 1] = static_cast<float>(b[1]);
    }
  }

  /// A pixel within the rounding of an edge, or of a face seen edge-on, lies a little outside the
  /// exact triangle: moves its weights back inside and returns its depth (0: none).
  double nearestPointInFace(Eigen::Vector3d& b, double inverseZ) const {
    b = (inverseZ < 0.0 ? Eigen::Vector3d(-b) : b).cwiseMax(0.0);
    const double sum = b.sum();
    if (!(sum > 0.0 && std::isfinite(sum))) {
      return 0.0;
    }
    b /= sum;
    return std::max(b.dot(plane_.z), rasterizer_.options_.nearPlane);
  }

  const Rasterizer& rasterizer_;
  RasterImage& image_;
  int32_t object_;
  int32_t face_ = -1;
  PlaneFunctions plane_;
};

void RasterOptions::validate() const {
  if (!(nearPlane > 0.0 && std::isfinite(nearPlane))) {
    throw std::invalid_argument("RasterOptions: nearPlane must be positive");
  }
}

Rasterizer::Rasterizer(const RasterOptions& options) : options_(options) {
  options_.validate();
}

void Rasterizer::begin(const Camera& camera) {
  requireValid(camera);
  if (camera.width > kMaxImageSide || camera.height > kMaxImageSide) {
    throw std::invalid_argument("Rasterizer: the image must not be larger than 16384 px a side");
  }
  camera_ = camera;
  image_.width = camera.width;
  image_.height = camera.height;
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  image_.depth.assign(pixels, 0.0F);
  image_.triangle.assign(pixels, -1);
  image_.object.assign(pixels, -1);
  image_.barycentrics.assign(options_.barycentrics ? 2 * pixels : 0, 0.0F);
}

void Rasterizer::draw(const MeshView& mesh, int32_t object) {
  if (image_.depth.empty()) {
    throw std::invalid_argument("Rasterizer: draw() needs begin() first");
  }
  requireValid(mesh, "Rasterizer");
  projected_.resize(static_cast<std::size_t>(mesh.numVertices()));
  for (Eigen::Index i = 0; i < mesh.numVertices(); ++i) {
    projected_[static_cast<std::size_t>(i)] =
        projected(camera_.cameraFromWorld * mesh.vertices.col(i));
  }
  TrianglePainter painter(*this, image_, object);
  for (Eigen::Index i = 0; i < mesh.numFaces(); ++i) {
    painter.drawFace(mesh.faces.col(i), static_cast<int32_t>(i));
  }
}

Rasterizer::ProjectedVertex Rasterizer::projected(const Eigen::Vector3d& pointInCamera) const {
  ProjectedVertex vertex{pointInCamera, 0, 0, false};
  // Cuts at the near plane and at the guard band may lie beyond them by rounding: hence the slack.
  if (pointInCamera.z() < 0.5 * options_.nearPlane) {
    return vertex;
  }
  const double inverseZ = 1.0 / pointInCamera.z();
  const double u = camera_.fx * pointInCamera.x() * inverseZ + camera_.cx;
  const double v = camera_.fy * pointInCamera.y() * inverseZ + camera_.cy;
  vertex.x = toSubpixel(std::clamp(u, -kGuard - 1.0, kGuard + 1.0));
  vertex.y = toSubpixel(std::clamp(v, -kGuard - 1.0, kGuard + 1.0));
  vertex.inside =
      pointInCamera.z() >= options_.nearPlane && std::abs(u) <= kGuard && std::abs(v) <= kGuard;
  return vertex;
}

RasterImage Rasterizer::takeImage() {
  return std::exchange(image_, RasterImage{});
}

RasterImage rasterize(const MeshView& mesh, const Camera& camera, const RasterOptions& options) {
  return rasterize(std::span<const MeshView>(&mesh, 1), camera, options);
}

RasterImage rasterize(
    std::span<const MeshView> meshes, const Camera& camera, const RasterOptions& options) {
  Rasterizer rasterizer(options);
  rasterizer.begin(camera);
  int32_t object = 0;
  for (const MeshView& mesh : meshes) {
    rasterizer.draw(mesh, object++);
  }
  return rasterizer.takeImage();
}

}  // namespace avatar
