#include "src/evaluation/moving_surface.h"

#include "avatar/geometry/measures.h"
#include "src/program/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace simulcap {
namespace {

constexpr long kBlock = 256;  // points of one task

void forEachPoint(Eigen::Index count, int threads, const std::function<void(Eigen::Index)>& body) {
  const long blocks = (count + kBlock - 1) / kBlock;
  parallelFor(blocks, threads, [&](long block) {
    for (Eigen::Index i = block * kBlock; i < std::min<Eigen::Index>(count, (block + 1) * kBlock);
         ++i)
      body(i);
  });
}

avatar::TriangleMesh joined(const std::vector<avatar::TriangleMesh>& layers) {
  if (layers.empty())
    throw std::invalid_argument("MovingSurface: no layers");
  avatar::TriangleMesh all;
  for (const avatar::TriangleMesh& layer : layers) {
    const Eigen::Index numVertices = all.numVertices();
    const Eigen::Index numFaces = all.numFaces();
    all.vertices.conservativeResize(3, numVertices + layer.numVertices());
    all.vertices.rightCols(layer.numVertices()) = layer.vertices;
    all.faces.conservativeResize(3, numFaces + layer.numFaces());
    all.faces.rightCols(layer.numFaces()) = layer.faces.array() + static_cast<int>(numVertices);
  }
  return all;
}

Eigen::VectorXd areasOfVertices(const avatar::TriangleMesh& mesh) {
  const Eigen::VectorXd faceAreas = avatar::faceAreas(mesh);
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(mesh.numVertices());
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f)
    for (int corner = 0; corner < 3; ++corner)
      areas[mesh.faces(corner, f)] += faceAreas[f] / 3.0;
  return areas;
}

bool isVisible(
    const avatar::ClosestPoint& point,
    const Eigen::Matrix3Xi& faces,
    const std::vector<bool>& seen) {
  double share = 0.0;
  for (int corner = 0; corner < 3; ++corner)
    share +=
        seen[static_cast<std::size_t>(faces(corner, point.face))] ? point.weights[corner] : 0.0;
  return share >= 0.5;
}

double millimetres(const avatar::ClosestPoint& point) {
  return 1000.0 * std::sqrt(point.squaredDistance);
}

/// From what is seen of one surface to the other.
void addSeen(
    const SeenSurface& from, const MovingSurface& to, int threads, Distribution& distances) {
  std::vector<Eigen::Index> indices;
  for (std::size_t v = 0; v < from.visible.size(); ++v)
    if (from.visible[v])
      indices.push_back(static_cast<Eigen::Index>(v));
  const Eigen::Matrix3Xd points = from.surface.mesh().vertices(Eigen::all, indices);
  const std::vector<avatar::ClosestPoint> nearest = to.nearest(points, threads);
  for (std::size_t i = 0; i < nearest.size(); ++i)
    distances.add(millimetres(nearest[i]), from.surface.vertexAreas()[indices[i]]);
}

}  // namespace

MovingSurface::MovingSurface(const avatar::TriangleMesh& mesh)
    : mesh_(mesh), vertexAreas_(areasOfVertices(mesh_)), bvh_(mesh_) {}

MovingSurface::MovingSurface(const std::vector<avatar::TriangleMesh>& layers)
    : MovingSurface(joined(layers)) {}

void MovingSurface::move(const Eigen::Matrix3Xd& vertices) {
  bvh_.refit(vertices);
  mesh_.vertices = vertices;
}

void MovingSurface::move(const std::vector<Eigen::Matrix3Xd>& layers) {
  Eigen::Index count = 0;
  for (const Eigen::Matrix3Xd& layer : layers)
    count += layer.cols();
  Eigen::Matrix3Xd all(3, count);
  Eigen::Index at = 0;
  for (const Eigen::Matrix3Xd& layer : layers) {
    all.middleCols(at, layer.cols()) = layer;
    at += layer.cols();
  }
  move(all);
}

std::vector<avatar::ClosestPoint> MovingSurface::nearest(
    const Eigen::Matrix3Xd& points, int threads) const {
  std::vector<avatar::ClosestPoint> nearest(static_cast<std::size_t>(points.cols()));
  forEachPoint(points.cols(), threads, [&](Eigen::Index i) {
    nearest[static_cast<std::size_t>(i)] = bvh_.closestPoint(points.col(i));
  });
  return nearest;
}

std::vector<bool> MovingSurface::visible(
    const Eigen::Matrix3Xd& points, const avatar::Camera& camera, int threads) const {
  constexpr double kOwnSurface = 0.001;  // [m]
  avatar::Camera atOrigin = camera;
  atOrigin.cameraFromWorld.setIdentity();
  std::vector<char> seen(static_cast<std::size_t>(points.cols()), 0);
  forEachPoint(points.cols(), threads, [&](Eigen::Index i) {
    const Eigen::Vector3d point = points.col(i);
    const double distance = point.norm();
    if (!(point.z() > 0.0) || distance <= kOwnSurface)
      return;
    const Eigen::Vector3d pixel = avatar::project(atOrigin, point);
    if (!(pixel.x() >= -0.5 && pixel.x() < camera.width - 0.5 && pixel.y() >= -0.5 &&
          pixel.y() < camera.height - 0.5))
      return;
    const avatar::Ray ray{.direction = point, .tMin = 0.0, .tMax = 1.0 - kOwnSurface / distance};
    seen[static_cast<std::size_t>(i)] = bvh_.anyHit(ray) ? 0 : 1;
  });
  return {seen.begin(), seen.end()};
}

void addSurfaceErrors(
    const SeenSurface& truth, const MovingSurface& ours, int threads, SurfaceErrors& errors) {
  const auto add = [&](bool seen, const avatar::ClosestPoint& point, double area) {
    (seen ? errors.visible : errors.hidden).add(millimetres(point), area);
  };
  const avatar::TriangleMesh& trueMesh = truth.surface.mesh();
  const auto onOurs = ours.nearest(trueMesh.vertices, threads);
  for (std::size_t v = 0; v < onOurs.size(); ++v)
    add(truth.visible[v], onOurs[v], truth.surface.vertexAreas()[static_cast<Eigen::Index>(v)]);
  const auto onTruth = truth.surface.nearest(ours.mesh().vertices, threads);
  for (std::size_t v = 0; v < onTruth.size(); ++v)
    add(isVisible(onTruth[v], trueMesh.faces, truth.visible),
        onTruth[v],
        ours.vertexAreas()[static_cast<Eigen::Index>(v)]);
}

void addOuterSurfaceErrors(
    const SeenSurface& truth, const SeenSurface& ours, int threads, Distribution& distances) {
  addSeen(truth, ours.surface, threads, distances);
  addSeen(ours, truth.surface, threads, distances);
}

}  // namespace simulcap
