#include "avatar/default_body/template_mesh.h"

#include "avatar/geometry/isotropic_remesh.h"
#include "avatar/geometry/polygonise.h"

#include <algorithm>
#include <cmath>

namespace avatar {
namespace {

// Around a centre the edges have a given length; it grows linearly with distance from there.
struct DetailZone {
  Eigen::Vector3d center;
  double radius;      // [m]
  double edgeLength;  // [m]
};

// Edge length that the template aims for at a point of the surface [m].
double templateEdgeLength(const Eigen::Vector3d& point) {
  constexpr double kElsewhere = 0.0240;  // [m]
  constexpr double kGrowth = 0.20;       // [m] of edge per metre of distance
  static const DetailZone kZones[] = {
      {{0.000, 0.615, 0.108}, 0.026, 0.0048},   // mouth
      {{0.031, 0.677, 0.105}, 0.018, 0.0054},   // eye
      {{0.000, 0.648, 0.125}, 0.018, 0.0054},   // nose
      {{0.000, 0.650, 0.090}, 0.060, 0.0098},   // face
      {{0.077, 0.668, 0.004}, 0.028, 0.0068},   // ear
      {{0.000, 0.690, 0.000}, 0.100, 0.0165},   // head
      {{0.730, 0.450, 0.010}, 0.050, 0.0115},   // palm
      {{0.805, 0.450, 0.000}, 0.055, 0.0082},   // fingers
      {{0.770, 0.438, 0.065}, 0.025, 0.0084},   // thumb
      {{0.110, -0.870, 0.040}, 0.080, 0.0155},  // foot
      {{0.120, -0.895, 0.130}, 0.045, 0.0092},  // toes
      {{0.435, 0.462, -0.010}, 0.050, 0.0175},  // elbow
      {{0.094, -0.440, 0.000}, 0.060, 0.0200},  // knee
  };
  double result = kElsewhere;
  for (const DetailZone& zone : kZones) {
    const double outside = std::max(0.0, (point - zone.center).norm() - zone.radius);
    result = std::min(result, zone.edgeLength + kGrowth * outside);
  }
  return result;
}

TriangleMesh makeHalf(const BodyField& field) {
  const auto distance = [&](const Eigen::Vector3d& p) { return field.distance(p); };
  PolygoniseOptions options;
  options.box = {Eigen::Vector3d(0.0, -0.925, -0.16), Eigen::Vector3d(0.92, 0.82, 0.20)};
  options.cellSize = 0.0035;
  const TriangleMesh fine = polygonise(distance, options);

  RemeshOptions remesh;
  remesh.sizing = templateEdgeLength;
  remesh.boundary = BoundaryMode::kResample;
  remesh.iterations = 10;
  remesh.project = [&](const Eigen::Vector3d& p) { return projectOntoZeroSet(distance, p); };
  return isotropicRemesh(fine, remesh).mesh;
}

// Vertices on the cut plane stay on it; their projection onto the surface is in the plane by
// symmetry, up to rounding.
void settleOnSurface(const BodyField& field, TriangleMesh& half) {
  constexpr double kOnPlane = 1e-6;  // [m]
  const auto distance = [&](const Eigen::Vector3d& p) { return field.distance(p); };
  for (Eigen::Index v = 0; v < half.numVertices(); ++v) {
    const bool isOnPlane = half.vertices(0, v) < kOnPlane;
    half.vertices.col(v) = projectOntoZeroSet(distance, half.vertices.col(v));
    if (isOnPlane)
      half.vertices(0, v) = 0.0;
  }
}

// The half mesh, open at x = 0 with its boundary exactly there, and its mirror image.
SymmetricMesh joinedWithMirrorImage(const TriangleMesh& half) {
  SymmetricMesh result;
  const Eigen::Index numHalf = half.numVertices();
  result.mirrorVertex.resize(numHalf);
  Eigen::Index numVertices = numHalf;
  for (Eigen::Index v = 0; v < numHalf; ++v) {
    result.mirrorVertex[v] = static_cast<int>(half.vertices(0, v) == 0.0 ? v : numVertices++);
  }
  result.mirrorVertex.resize(numVertices);
  result.mesh.vertices.resize(3, numVertices);
  result.mesh.vertices.leftCols(numHalf) = half.vertices;
  for (Eigen::Index v = 0; v < numHalf; ++v) {
    const int other = result.mirrorVertex[v];
    if (other == v)
      continue;
    result.mirrorVertex[other] = static_cast<int>(v);
    result.mesh.vertices.col(other) =
        half.vertices.col(v).cwiseProduct(Eigen::Vector3d(-1.0, 1.0, 1.0));
  }
  const Eigen::Index numHalfFaces = half.numFaces();
  result.mesh.faces.resize(3, 2 * numHalfFaces);
  result.mesh.faces.leftCols(numHalfFaces) = half.faces;
  for (Eigen::Index f = 0; f < numHalfFaces; ++f) {
    const Eigen::Vector3i face = half.faces.col(f);
    result.mesh.faces.col(numHalfFaces + f) << result.mirrorVertex[face[0]],
        result.mirrorVertex[face[2]], result.mirrorVertex[face[1]];
  }
  return result;
}

}  // namespace

SymmetricMesh makeTemplateMesh(const BodyField& field) {
  TriangleMesh half = makeHalf(field);
  settleOnSurface(field, half);
  return joinedWithMirrorImage(half);
}

}  // namespace avatar
