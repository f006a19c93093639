#include "avatar/digitization/outer_surface.h"

#include "avatar/digitization/garment_cut.h"
#include "avatar/digitization/point_grid.h"
#include "avatar/garment_openings.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/mesh_cleanup.h"

#include <pcl/PolygonMesh.h>
#include <pcl/conversions.h>
#include <pcl/point_types.h>
#include <pcl/surface/poisson.h>

#include <algorithm>
#include <queue>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

pcl::PointNormal orientedPoint(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  pcl::PointNormal result;
  result.getVector3fMap() = point.cast<float>();
  result.getNormalVector3fMap() = normal.cast<float>();
  return result;
}

/// Is there a surface that was seen from outside, from a little beneath a point outwards?
bool isCovered(
    const Eigen::Vector3d& point,
    const Eigen::Vector3d& normal,
    const FusedPoints& fused,
    const PointGrid& grid,
    const OuterSurfaceOptions& options) {
  constexpr double kBeneath = 0.03;   // errors of the body [m]
  constexpr double kMinCosine = 0.3;  // of what faces the same way
  const double step = options.seenDistance;
  const int numSteps = static_cast<int>((kBeneath + options.coverDistance) / step);
  for (int i = 0; i <= numSteps; ++i) {
    for (const int near : grid.within(point + (i * step - kBeneath) * normal)) {
      if (fused.normals.col(near).dot(normal) > kMinCosine)
        return true;
    }
  }
  return false;
}

/// Vertices of the body that nothing seen lies over: soles, the inner side of an arm.
std::vector<int> unseenBody(
    const FusedPoints& fused,
    const MeshView& body,
    const Eigen::Matrix3Xd& normals,
    const OuterSurfaceOptions& options) {
  const PointGrid grid(fused.points, options.seenDistance);
  std::vector<int> unseen;
  for (int v = 0; v < body.numVertices(); ++v) {
    if (!isCovered(body.vertices.col(v), normals.col(v), fused, grid, options))
      unseen.push_back(v);
  }
  return unseen;
}

/// The mesh with all its holes closed, each by a fan.
TriangleMesh closed(const TriangleMesh& mesh) {
  std::vector<GarmentOpening> holes;
  for (std::vector<int>& loop :
       boundaryLoops(mesh.faces, buildAdjacency(mesh.faces, mesh.numVertices())))
    holes.push_back({.loop = std::move(loop)});
  return closeHoles(mesh, holes, 0.0).mesh;
}

TriangleMesh poisson(const pcl::PointCloud<pcl::PointNormal>::Ptr& cloud, int depth) {
  pcl::Poisson<pcl::PointNormal> reconstruction;
  reconstruction.setDepth(depth);
  reconstruction.setManifold(true);
  reconstruction.setOutputPolygons(false);
  reconstruction.setInputCloud(cloud);
  pcl::PointCloud<pcl::PointNormal> points;
  std::vector<pcl::Vertices> polygons;
  reconstruction.reconstruct(points, polygons);
  TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    mesh.vertices.col(static_cast<Eigen::Index>(i)) = points[i].getVector3fMap().cast<double>();
  std::vector<int> corners;
  for (const pcl::Vertices& polygon : polygons) {
    for (std::size_t i = 2; i < polygon.vertices.size(); ++i) {
      for (const std::size_t corner : {std::size_t{0}, i - 1, i})
        corners.push_back(static_cast<int>(polygon.vertices[corner]));
    }
  }
  mesh.faces = Eigen::Map<Eigen::Matrix3Xi>(
      corners.data(), 3, static_cast<Eigen::Index>(corners.size() / 3));
  return mesh;
}

void addAppearance(OuterSurface& surface, const FusedPoints& fused, double radius) {
  const PointGrid grid(fused.points, radius);
  const auto numVertices = static_cast<std::size_t>(surface.mesh.numVertices());
  surface.colors = Eigen::Matrix3Xd::Constant(3, surface.mesh.numVertices(), -1.0);
  surface.labels.resize(numVertices);
  for (std::size_t v = 0; v < numVertices; ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    int colored = 0;
    for (const int i : grid.within(surface.mesh.vertices.col(column))) {
      for (std::size_t label = 0; label < kNumSurfaceLabels; ++label)
        surface.labels[v][label] = static_cast<std::uint16_t>(std::min(
            65535, surface.labels[v][label] + fused.labels[static_cast<std::size_t>(i)][label]));
      if (fused.colors(0, i) < 0.0F)
        continue;
      color += fused.colors.col(i).cast<double>();
      ++colored;
    }
    if (colored > 0)
      surface.colors.col(column) = color / colored;
  }
}

/// Vertices without a colour take the one that is nearest along the edges.
void spreadColors(OuterSurface& surface) {
  const Adjacency adjacency = buildAdjacency(surface.mesh.faces, surface.mesh.numVertices());
  std::queue<int> front;
  for (int v = 0; v < surface.mesh.numVertices(); ++v) {
    if (surface.colors(0, v) >= 0.0)
      front.push(v);
  }
  while (!front.empty()) {
    const int v = front.front();
    front.pop();
    for (const int next : adjacency.vertexVertices[v]) {
      if (surface.colors(0, next) >= 0.0)
        continue;
      surface.colors.col(next) = surface.colors.col(v);
      front.push(next);
    }
  }
  surface.colors = surface.colors.unaryExpr([](double c) { return c < 0.0 ? 0.7 : c; });
}

}  // namespace

void OuterSurfaceOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("OuterSurfaceOptions: ") + what);
  };
  demand(poissonDepth >= 5 && poissonDepth <= 10, "poissonDepth is expected in 5 … 10");
  demand(seenDistance > 0.0, "seenDistance is expected above 0");
  demand(coverDistance > seenDistance, "coverDistance is expected above seenDistance");
  demand(appearanceRadius > 0.0, "appearanceRadius is expected above 0");
}

OuterSurface completeOuterSurface(
    const FusedPoints& fused, const MeshView& body, const OuterSurfaceOptions& options) {
  options.validate();
  constexpr Eigen::Index kFewestPoints = 1000;  // of 4 mm voxels: less than a hand
  if (fused.size() < kFewestPoints)
    throw std::runtime_error(
        "the turn shows too little of a person (" + std::to_string(fused.size()) +
        " surface points): check that the person stands alone, 1 to 4 m from the camera");
  pcl::PointCloud<pcl::PointNormal>::Ptr cloud(new pcl::PointCloud<pcl::PointNormal>);
  for (Eigen::Index i = 0; i < fused.size(); ++i)
    cloud->push_back(orientedPoint(fused.points.col(i), fused.normals.col(i)));
  const Eigen::Matrix3Xd bodyNormals = vertexNormals(body);
  const std::vector<int> unseen = unseenBody(fused, body, bodyNormals, options);
  for (const int v : unseen)
    cloud->push_back(orientedPoint(body.vertices.col(v), bodyNormals.col(v)));
  OuterSurface surface;
  surface.holesFilledByBody = static_cast<int>(unseen.size());
  // Reconstructions leave crumbs about. PCL 1.13 also leaves a hole now and then where its octree's
  // levels meet ("Vertex pair not in list").
  const TriangleMesh clean = withoutPinches(cleanMesh(poisson(cloud, options.poissonDepth)).mesh);
  surface.mesh = closed(connectedParts(clean).front());
  if (signedVolume(surface.mesh) < 0.0)
    surface.mesh.faces.row(1).swap(surface.mesh.faces.row(2));
  const Topology shape = topology(surface.mesh.faces, surface.mesh.numVertices());
  if (!shape.manifold() || !shape.closed || !shape.oriented)
    surface.warnings.emplace_back("the outer surface is not a closed manifold");
  const PointGrid grid(fused.points, options.seenDistance);
  surface.seen.resize(static_cast<std::size_t>(surface.mesh.numVertices()));
  for (std::size_t v = 0; v < surface.seen.size(); ++v)
    surface.seen[v] = grid.nearest(surface.mesh.vertices.col(static_cast<Eigen::Index>(v))) >= 0;
  addAppearance(surface, fused, options.appearanceRadius);
  spreadColors(surface);
  return surface;
}

}  // namespace avatar
