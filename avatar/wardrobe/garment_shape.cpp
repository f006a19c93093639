#include "avatar/wardrobe/garment_shape.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/mesh_clip.h"
#include "avatar/geometry/polygonise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace avatar {
namespace {

// The solid ends this far past an opening, so that the opening cuts the tube's wall and not its
// end.
constexpr double kPastOpening = 0.03;  // [m]

FieldSample larger(const FieldSample& a, const FieldSample& b) {
  return a.distance >= b.distance ? a : b;
}

FieldSample pieceDistance(const GarmentPiece& piece, const Eigen::Vector3d& point) {
  FieldSample sample = piece.tube(point);
  for (const Region& end : piece.ends)
    sample = larger(sample, end(point));
  for (const Region& opening : piece.openings) {
    FieldSample beyond = opening(point);
    beyond.distance -= kPastOpening;
    sample = larger(sample, beyond);
  }
  return sample;
}

/// How far past the openings of the piece it belongs to a point is; −∞ without openings.
double pastOpenings(const GarmentShape& shape, const Eigen::Vector3d& point) {
  double nearest = std::numeric_limits<double>::infinity();
  double past = -std::numeric_limits<double>::infinity();
  for (const GarmentPiece& piece : shape.pieces) {
    const double distance = pieceDistance(piece, point).distance;
    if (distance >= nearest)
      continue;
    nearest = distance;
    past = -std::numeric_limits<double>::infinity();
    for (const Region& opening : piece.openings)
      past = std::max(past, opening(point).distance);
  }
  return past;
}

TriangleMesh largestComponent(const TriangleMesh& mesh) {
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  const Components components = connectedComponents(mesh.faces, adjacency);
  std::vector<int> sizes(static_cast<std::size_t>(components.count), 0);
  for (const int label : components.faceLabels)
    ++sizes[static_cast<std::size_t>(label)];
  const auto largest =
      static_cast<int>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  TriangleMesh result{mesh.vertices, Eigen::Matrix3Xi(3, sizes[static_cast<std::size_t>(largest)])};
  Eigen::Index count = 0;
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    if (components.faceLabels[static_cast<std::size_t>(face)] == largest)
      result.faces.col(count++) = mesh.faces.col(face);
  }
  return result;
}

}  // namespace

Region halfSpace(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  return [=](const Eigen::Vector3d& p) { return FieldSample{normal.dot(p - point), normal}; };
}

/// Union with a fillet (polynomial smooth minimum, Quilez 2013). Its width shrinks to nothing where
/// both surfaces face the same way: there is no corner to round, and no bulge.
FieldSample joined(const FieldSample& a, const FieldSample& b, double blend) {
  const double width = blend * std::clamp(1.0 - a.normal.dot(b.normal), 0.0, 1.0);
  const FieldSample& nearer = a.distance <= b.distance ? a : b;
  const FieldSample& other = a.distance <= b.distance ? b : a;
  const double gap = other.distance - nearer.distance;
  if (gap >= width)
    return nearer;
  const double share = 0.5 * (1.0 - gap / width);
  const double depth = (width - gap) * (width - gap) / (4.0 * width);
  const Eigen::Vector3d normal = (1.0 - share) * nearer.normal + share * other.normal;
  const double length = normal.norm();
  return {
      nearer.distance - depth, length > 1e-9 ? Eigen::Vector3d(normal / length) : nearer.normal};
}

FieldSample shapeDistance(const GarmentShape& shape, const Eigen::Vector3d& point) {
  FieldSample sample = pieceDistance(shape.pieces.front(), point);
  for (std::size_t i = 1; i < shape.pieces.size(); ++i)
    sample = joined(sample, pieceDistance(shape.pieces[i], point), shape.blend);
  return sample;
}

TriangleMesh shapeSurface(
    const GarmentShape& shape, const Eigen::AlignedBox3d& box, double cellSize) {
  PolygoniseOptions options;
  options.box = box;
  options.cellSize = cellSize;
  options.steepestSlope = 2.0;
  const TriangleMesh closed = polygonise(
      [&shape](const Eigen::Vector3d& p) { return shapeDistance(shape, p).distance; }, options);
  if (closed.numFaces() == 0)
    throw std::invalid_argument("garment: the pattern encloses nothing");
  Eigen::VectorXd past(closed.numVertices());
  for (Eigen::Index v = 0; v < closed.numVertices(); ++v)
    past[v] = pastOpenings(shape, closed.vertices.col(v));
  const TriangleMesh cut = clippedMesh(closed, past);
  if (cut.numFaces() == 0)
    throw std::invalid_argument("garment: its openings leave nothing of it");
  return largestComponent(cut);
}

}  // namespace avatar
