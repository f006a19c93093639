// Times the geometry that runs per frame or per avatar, on meshes made by code.
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/isotropic_remesh.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/rasterizer.h"
#include "avatar/geometry/shading.h"
#include "tests/benchmarks/benchmark.h"
#include "tests/support/primitive_meshes.h"

#include <cmath>
#include <vector>

namespace {

using avatar::TriangleMesh;

avatar::Camera cameraFor(const TriangleMesh& mesh) {
  avatar::FramingOptions framing;
  framing.viewDirection = {-0.2, 0.8, -0.6};
  framing.up = {0.0, 0.0, 1.0};
  return avatar::frameBox(avatar::Camera{}, avatar::boundingBox(mesh), framing);
}

void rasterizing(const TriangleMesh& mesh) {
  const avatar::Camera camera = cameraFor(mesh);
  for (const bool cull : {false, true}) {
    avatar::RasterOptions options;
    options.cullBackFaces = cull;
    avatar::Rasterizer rasterizer(options);
    const benchmark::Timing timing = benchmark::measure(50, [&] {
      rasterizer.begin(camera);
      rasterizer.draw(mesh);
    });
    benchmark::report(
        cull ? "rasterize 640x480, 30k, cull" : "rasterize 640x480, 30k",
        timing,
        static_cast<double>(mesh.numFaces()));
  }
  const avatar::ShadedMesh shaded{mesh};
  benchmark::report("shade 640x480, 30k", benchmark::measure(10, [&] {
                      benchmark::keep(avatar::shade(shaded, camera));
                    }));
}

std::vector<Eigen::Vector3d> queriesNear(const TriangleMesh& mesh, int count, double distance) {
  avatar::test::Noise noise(1);
  std::vector<Eigen::Vector3d> queries;
  for (int i = 0; i < count; ++i) {
    const Eigen::Index vertex = (i * 7919L) % mesh.numVertices();
    queries.emplace_back(mesh.vertices.col(vertex) + distance * noise.nextPoint());
  }
  return queries;
}

void nearestPoints(
    const avatar::TriangleBvh& bvh, const std::vector<Eigen::Vector3d>& queries, const char* name) {
  const benchmark::Timing timing = benchmark::measure(5, [&] {
    for (const Eigen::Vector3d& query : queries) {
      benchmark::keep(bvh.closestPoint(query));
    }
  });
  benchmark::report(name, timing, static_cast<double>(queries.size()));
}

void searching(const TriangleMesh& mesh) {
  const double faces = static_cast<double>(mesh.numFaces());
  benchmark::report(
      "BVH build, 30k",
      benchmark::measure(10, [&] { benchmark::keep(avatar::TriangleBvh(mesh)); }),
      faces);
  avatar::TriangleBvh bvh(mesh);
  benchmark::report(
      "BVH refit, 30k", benchmark::measure(20, [&] { bvh.refit(mesh.vertices); }), faces);
  nearestPoints(bvh, queriesNear(mesh, 20000, 0.01), "closest point, 1 cm away");
  nearestPoints(bvh, queriesNear(mesh, 20000, 0.3), "closest point, 30 cm away");
  const std::vector<Eigen::Vector3d> origins = queriesNear(mesh, 20000, 1.0);
  const benchmark::Timing timing = benchmark::measure(5, [&] {
    for (const Eigen::Vector3d& origin : origins) {
      benchmark::keep(bvh.firstHit({origin, -origin}));
    }
  });
  benchmark::report("first hit of a ray", timing, static_cast<double>(origins.size()));
}

void remeshing() {
  avatar::RemeshOptions options;
  options.boundary = avatar::BoundaryMode::kResample;
  options.sizing = [](const Eigen::Vector3d& p) {
    return 0.005 + 0.015 * std::min(1.0, std::abs(p.x()) / 0.5);
  };
  const TriangleMesh mesh = avatar::test::torus(0.5, 0.2, 500, 300);
  benchmark::report(
      "remesh 300k faces, sizes 5-20 mm",
      benchmark::measure(2, [&] { benchmark::keep(avatar::isotropicRemesh(mesh, options)); }),
      static_cast<double>(mesh.numFaces()));
}

}  // namespace

int main() {
  const TriangleMesh mesh = avatar::test::torus(0.5, 0.25, 150, 100);
  benchmark::reportCalibration();
  rasterizing(mesh);
  searching(mesh);
  remeshing();
  benchmark::reportCalibration();
  return 0;
}
