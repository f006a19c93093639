#include "avatar/geometry/rasterizer.h"

#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

using test::Noise;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Vertices are rounded to 1/256 px: an edge moves by at most half a diagonal step. [px]
constexpr double kEdgeTolerance = 0.71 / 256.0;

Camera testCamera(int width = 160, int height = 120) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = 0.9 * width;
  camera.fy = 0.7 * width;
  camera.cx = 0.4 * width;
  camera.cy = 0.6 * height;
  camera.cameraFromWorld = lookAt({0.3, 1.1, 3.0}, {0.1, -0.1, 0.2}, {0.2, 1.0, 0.1});
  return camera;
}

struct Hit {
  double z = kInfinity;    // [m]
  Eigen::Index face = -1;  // nearest
  bool nearEdge = false;   // some face's edge passes within the tolerance in front of that
};

double distanceToSegment(
    const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d ab = b - a;
  const double t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-300), 0.0, 1.0);
  return (p - a - t * ab).norm();
}

/// A face in the camera's frame [m] and in the image [px].
struct ViewedFace {
  std::array<Eigen::Vector3d, 3> p;
  std::array<Eigen::Vector2d, 3> q;
};

std::vector<ViewedFace> viewFaces(const MeshView& mesh, const Camera& camera) {
  std::vector<ViewedFace> result(static_cast<std::size_t>(mesh.numFaces()));
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    ViewedFace& face = result[static_cast<std::size_t>(f)];
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d world = mesh.vertices.col(mesh.faces(k, f));
      face.p[k] = camera.cameraFromWorld * world;
      face.q[k] = project(camera, world).head<2>();
    }
  }
  return result;
}

bool passesNear(const Eigen::Vector2d& pixel, const ViewedFace& face) {
  return std::min(
             {distanceToSegment(pixel, face.q[0], face.q[1]),
              distanceToSegment(pixel, face.q[1], face.q[2]),
              distanceToSegment(pixel, face.q[2], face.q[0])}) < kEdgeTolerance;
}

/// Depth at which a ray with z = 1 meets a face (Möller & Trumbore), infinite beside it.
double intersect(const Eigen::Vector3d& ray, const ViewedFace& face) {
  const Eigen::Vector3d e1 = face.p[1] - face.p[0];
  const Eigen::Vector3d e2 = face.p[2] - face.p[0];
  const Eigen::Vector3d h = ray.cross(e2);
  const Eigen::Vector3d q = e1.cross(face.p[0]);
  const double det = e1.dot(h);
  const double u = -face.p[0].dot(h) / det;
  const double v = ray.dot(q) / det;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 ? e2.dot(q) / det : kInfinity;
}

/// The slow, obvious ray caster: every face, in double. All points lie in front of the camera, so
/// the edges' distances in the image tell the pixels whose answer may differ.
Hit castPixel(const std::vector<ViewedFace>& faces, const Camera& camera, int x, int y) {
  Hit hit;
  const Eigen::Vector3d ray = rayInCamera(camera, x, y);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    hit.nearEdge = hit.nearEdge || passesNear({x, y}, faces[f]);
    const double z = intersect(ray, faces[f]);
    if (z < hit.z) {
      hit.z = z;
      hit.face = static_cast<Eigen::Index>(f);
    }
  }
  return hit;
}

struct Comparison {
  int covered = 0, compared = 0;
};

/// Compares every pixel that is not within the tolerance of an edge with the ray caster.
Comparison expectSameAsRayCaster(const TriangleMesh& mesh, const Camera& camera) {
  const RasterImage image = rasterize(mesh, camera);
  const std::vector<ViewedFace> faces = viewFaces(mesh, camera);
  Comparison result;
  for (int i = 0; i < camera.width * camera.height; ++i) {
    const Hit hit = castPixel(faces, camera, i % camera.width, i / camera.width);
    if (hit.nearEdge) {
      continue;
    }
    const auto pixel = static_cast<std::size_t>(i);
    ++result.compared;
    result.covered += hit.face >= 0 ? 1 : 0;
    EXPECT_EQ(image.triangle[pixel], hit.face) << i;
    // One rounding to float (6e-8) and the conditioning of slanted faces in double.
    const double expected = hit.face >= 0 ? hit.z : 0.0;
    EXPECT_NEAR(image.depth[pixel], expected, 1.2e-7 * expected) << i;
  }
  return result;
}

TEST(Rasterizer, ShowsTheSphereThatARayCasterSees) {
  const Comparison result = expectSameAsRayCaster(test::icosphere(0.8, 2), testCamera(80, 60));
  EXPECT_GT(result.covered, 700);
  EXPECT_GT(result.compared, 0.95 * 80 * 60);
}

TEST(Rasterizer, ShowsTheRandomTrianglesThatARayCasterSees) {
  const Comparison result =
      expectSameAsRayCaster(test::triangleSoup(120, 0.4, 7), testCamera(80, 60));
  EXPECT_GT(result.covered, 1000);
  EXPECT_GT(result.compared, 0.9 * 80 * 60);
}

Eigen::Vector2d pixelCentre(const RasterImage& image, std::size_t pixel) {
  const int index = static_cast<int>(pixel);
  const int row = index / image.width;
  return {index % image.width, row};
}

TEST(Rasterizer, BarycentricsGiveThePointOnThePixelsRay) {
  const TriangleMesh mesh = test::triangleSoup(120, 0.4, 11);
  const Camera camera = testCamera();
  const RasterImage image = rasterize(mesh, camera);
  int covered = 0;
  for (std::size_t pixel = 0; pixel < image.depth.size(); ++pixel) {
    const std::int32_t face = image.triangle[pixel];
    if (face < 0) {
      continue;
    }
    ++covered;
    const double b0 = image.barycentrics[2 * pixel];
    const double b1 = image.barycentrics[2 * pixel + 1];
    EXPECT_GE(b0, 0.0);
    EXPECT_GE(b1, 0.0);
    EXPECT_LE(b0 + b1, 1.0 + 1.2e-7);  // two roundings to float
    const Eigen::Vector3d point = b0 * mesh.vertices.col(mesh.faces(0, face)) +
                                  b1 * mesh.vertices.col(mesh.faces(1, face)) +
                                  (1.0 - b0 - b1) * mesh.vertices.col(mesh.faces(2, face));
    const Eigen::Vector3d back = project(camera, point);
    // Two weights rounded to float times edges of up to 1 m give 1e-7 m, 144 px/m / 2 m of that.
    EXPECT_NEAR(back.z(), image.depth[pixel], 4e-7);
    const bool onBorder = std::min({b0, b1, 1.0 - b0 - b1}) < 1e-6;
    // On the border the pixel may lie outside by the rounding of the vertices and is moved back
    // along the face: by that over the sine of the corner's angle, in needles ten times as much.
    const double tolerance = onBorder ? 10.0 * kEdgeTolerance : 5e-5;
    EXPECT_LT((back.head<2>() - pixelCentre(image, pixel)).norm(), tolerance);
  }
  EXPECT_GT(covered, 5000);
}

TEST(Rasterizer, CoversEveryPixelOfATiledPlaneExactlyOnce) {
  // Jittered grid whose outer border lies outside the image: with exact edge rules the sum of all
  // faces drawn alone is one per pixel. Jitter on multiples of 1/4 px puts edges onto centres.
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.fx = camera.fy = 64.0;
  camera.cx = 31.0;
  camera.cy = 23.0;
  Noise noise(3);
  TriangleMesh mesh = test::rectangle(80.0, 64.0, 10, 8);
  for (Eigen::Index i = 0; i < mesh.numVertices(); ++i) {
    const Eigen::Vector3d jitter = 2.0 * noise.nextPoint();
    const double u = mesh.vertices(0, i) - 8.0 + 0.25 * std::round(4.0 * jitter.x());
    const double v = mesh.vertices(1, i) - 8.0 + 0.25 * std::round(4.0 * jitter.y());
    const double z = 2.0 + 0.3 * jitter.z();
    mesh.vertices.col(i) = unproject(camera, {u, v, z});
  }
  std::vector<int> count(rasterize(mesh, camera).depth.size(), 0);
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    const Eigen::Matrix3Xi face = mesh.faces.col(f);
    const RasterImage image = rasterize(MeshView(mesh.vertices, face), camera);
    for (std::size_t pixel = 0; pixel < count.size(); ++pixel) {
      count[pixel] += image.triangle[pixel] >= 0 ? 1 : 0;
    }
  }
  EXPECT_EQ(*std::min_element(count.begin(), count.end()), 1);
  EXPECT_EQ(*std::max_element(count.begin(), count.end()), 1);
}

/// A floor from behind the camera to the horizon has the depth of the plane at every pixel below
/// the horizon: closed form for clipping at the near plane and at the guard band.
TEST(Rasterizer, ClipsAFloorThatPassesUnderTheCamera) {
  Camera camera;
  camera.width = 80;
  camera.height = 60;
  camera.fx = camera.fy = 60.0;
  camera.cx = 39.3;
  camera.cy = 29.7;
  const double height = 1.5;  // y down
  TriangleMesh floor;
  floor.vertices.resize(3, 4);
  floor.vertices << -1e6, 1e6, 1e6, -1e6, height, height, height, height, -1e6, -1e6, 1e6, 1e6;
  floor.faces.resize(3, 2);
  floor.faces << 0, 0, 1, 2, 2, 3;
  const RasterImage image = rasterize(floor, camera);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double expected = y > camera.cy ? camera.fy * height / (y - camera.cy) : 0.0;
      // One rounding to float.
      EXPECT_NEAR(image.depth[image.index(x, y)], expected, 1.2e-7 * expected) << x << " " << y;
    }
  }
}

TEST(Rasterizer, CutsAtTheNearPlane) {
  // A ramp through the camera: z = −y/2 + 0.5 seen where z ≥ near.
  Camera camera;
  camera.width = 64;
  camera.height = 64;
  camera.fx = camera.fy = 32.0;
  camera.cx = camera.cy = 31.5;
  TriangleMesh ramp;
  ramp.vertices.resize(3, 4);
  ramp.vertices << -9, 9, 9, -9, -9, -9, 9, 9, 5, 5, -4, -4;
  ramp.faces.resize(3, 2);
  ramp.faces << 0, 0, 1, 2, 2, 3;
  RasterOptions options;
  options.nearPlane = 0.4;
  const RasterImage image = rasterize(ramp, camera, options);
  for (int y = 0; y < 64; ++y) {
    const double slope = (y - camera.cy) / camera.fy;
    const double z = 0.5 / (1.0 + 0.5 * slope);
    // The cut is at z = 0.4, slope 0.5: v = 47.5, half a pixel from the nearest centres.
    const double expected = z >= options.nearPlane ? z : 0.0;
    EXPECT_NEAR(image.depth[image.index(20, y)], expected, 1.2e-7) << y;
  }
}

TEST(Rasterizer, CullsBackFacesByTheirOutside) {
  const TriangleMesh sphere = test::icosphere(0.5, 2);
  TriangleMesh insideOut = sphere;
  insideOut.faces.row(1).swap(insideOut.faces.row(2));
  RasterOptions cull;
  cull.cullBackFaces = true;
  const Camera camera = testCamera();
  const RasterImage all = rasterize(sphere, camera);
  const RasterImage front = rasterize(sphere, camera, cull);
  const RasterImage back = rasterize(insideOut, camera, cull);
  EXPECT_EQ(all.depth, front.depth) << "a closed surface shows no back face";
  for (std::size_t pixel = 0; pixel < all.depth.size(); ++pixel) {
    EXPECT_EQ(front.triangle[pixel] < 0, back.triangle[pixel] < 0);
    EXPECT_LE(front.depth[pixel], back.depth[pixel]);
  }
}

TEST(Rasterizer, DrawsSeveralMeshesWithTheirIds) {
  const Camera camera = testCamera();
  const TriangleMesh nearSphere = test::icosphere(0.5, 2);
  TriangleMesh farSphere = test::icosphere(0.9, 2);
  farSphere.vertices.row(2).array() -= 1.5;
  Rasterizer rasterizer;
  rasterizer.begin(camera);
  rasterizer.draw(farSphere, 5);
  rasterizer.draw(nearSphere, 9);
  const RasterImage nearImage = rasterize(nearSphere, camera);
  const RasterImage farImage = rasterize(farSphere, camera);
  const RasterImage& both = rasterizer.image();
  std::array<int, 2> seen = {0, 0};
  for (std::size_t pixel = 0; pixel < both.depth.size(); ++pixel) {
    const bool showsNear = nearImage.depth[pixel] > 0.0F;
    const bool showsFar = !showsNear && farImage.depth[pixel] > 0.0F;
    EXPECT_EQ(both.object[pixel], showsNear ? 9 : showsFar ? 5 : -1);
    EXPECT_EQ(both.depth[pixel], showsNear ? nearImage.depth[pixel] : farImage.depth[pixel]);
    seen[0] += showsNear ? 1 : 0;
    seen[1] += showsFar ? 1 : 0;
  }
  EXPECT_GT(seen[0], 500);
  EXPECT_GT(seen[1], 500);
}

TEST(Rasterizer, ReusedTargetGivesTheSameImage) {
  const TriangleMesh mesh = test::triangleSoup(60, 0.4, 5);
  const RasterImage fresh = rasterize(mesh, testCamera());
  Rasterizer rasterizer;
  rasterizer.begin(testCamera(200, 90));
  rasterizer.draw(test::icosphere(1.0, 1));
  rasterizer.begin(testCamera());
  rasterizer.draw(mesh);
  EXPECT_EQ(rasterizer.image().depth, fresh.depth);
  EXPECT_EQ(rasterizer.image().triangle, fresh.triangle);
  EXPECT_EQ(rasterizer.image().barycentrics, fresh.barycentrics);
}

TEST(Rasterizer, RejectsBrokenInput) {
  TriangleMesh mesh = test::cube();
  mesh.faces(1, 3) = 8;
  EXPECT_THROW(rasterize(mesh, testCamera()), std::invalid_argument);
  mesh = test::cube();
  mesh.vertices(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(rasterize(mesh, testCamera()), std::invalid_argument);
  Camera camera = testCamera();
  camera.fx = 0.0;
  EXPECT_THROW(rasterize(test::cube(), camera), std::invalid_argument);
  RasterOptions options;
  options.nearPlane = 0.0;
  EXPECT_THROW(rasterize(test::cube(), testCamera(), options), std::invalid_argument);
  EXPECT_THROW(Rasterizer().draw(test::cube()), std::invalid_argument);
}

TEST(Rasterizer, DegenerateAndEdgeOnFacesDrawNothingOrTheirOwnDepth) {
  Camera camera;
  camera.width = camera.height = 32;
  camera.fx = camera.fy = 30.0;
  camera.cx = camera.cy = 15.5;
  TriangleMesh mesh;
  mesh.vertices.resize(3, 6);
  // A point, a needle, and a face through the camera's centre.
  mesh.vertices << 0.1, 0.1, 0.2, 0.0, 0.4, 0.0, 0.1, 0.1, 0.2, 0.1, 0.1, -0.2, 1, 1, 1, 1, 1, 2;
  mesh.faces.resize(3, 3);
  mesh.faces << 0, 0, 3, 0, 1, 5, 1, 2, 3;
  const RasterImage image = rasterize(mesh, camera);
  for (const float depth : image.depth) {
    EXPECT_TRUE(depth == 0.0F || (depth >= 1.0F && depth <= 2.0F));
  }
}

}  // namespace
}  // namespace avatar
