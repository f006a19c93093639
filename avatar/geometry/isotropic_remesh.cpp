#include "avatar/geometry/isotropic_remesh.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closed_polyline.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/triangle_quality.h"

// EigenVectorT specializes templates that the first header declares.
// clang-format off
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Geometry/EigenVectorT.hh>
// clang-format on

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>

namespace avatar {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

/// An edge is split above and collapsed below these multiples of its wanted length: both leave an
/// edge that is nearer to it than before (Botsch & Kobbelt 2004).
constexpr double kSplitAbove = 4.0 / 3.0;
constexpr double kCollapseBelow = 4.0 / 5.0;

/// Edges above this multiple are split longest first.
constexpr double kFarTooLong = 4.0;

/// The angle that the last passes work for [rad].
constexpr double kGoodAngle = 35.0 * kPi / 180.0;
constexpr int kPolishPasses = 6;

struct RemeshTraits : OpenMesh::DefaultTraits {
  using Point = Eigen::Vector3d;
  using Normal = Eigen::Vector3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge | OpenMesh::Attributes::Status);
  VertexTraits {
    double size = 0.0;       // wanted edge length [m]
    double arcLength = 0.0;  // on its boundary curve [m]
    int curve = -1;          // boundary curve that it slides on
    int input = -1;          // input vertex, while it is still at its place
    bool fixed = false;
  };
};

using Mesh = OpenMesh::TriMesh_ArrayKernelT<RemeshTraits>;
using Vertex = Mesh::VertexHandle;
using Edge = Mesh::EdgeHandle;
using Face = Mesh::FaceHandle;
using HalfEdge = Mesh::HalfedgeHandle;

class Remesher {
 public:
  Remesher(const MeshView& input, const RemeshOptions& options) : options_(options) {
    if (!options.project)
      bvh_.emplace(input);
    load(input);
    loadBoundary(input);
  }

  RemeshResult run() {
    splitFarTooLongEdges();
    for (int i = 0; i < options_.iterations; ++i) {
      splitLongEdges();
      collapseShortEdges();
      flipForValence();
      relax(0.0);
    }
    for (int i = 0; i < kPolishPasses; ++i) {
      flipForAngles();
      relax(kGoodAngle);
    }
    return extract();
  }

 private:
  double sizeAt(const Vector3d& point) const {
    const double size = options_.sizing ? options_.sizing(point) : options_.targetEdgeLength;
    if (!(size > 0.0 && std::isfinite(size)))
      throw std::invalid_argument("isotropicRemesh: the size field must be positive and finite");
    return size;
  }

  Vertex addVertex(const Vector3d& point) {
    const Vertex v(mesh_.add_vertex(point).idx());
    mesh_.data(v).size = sizeAt(point);
    return v;
  }

  void load(const MeshView& input) {
    std::vector<bool> used(static_cast<std::size_t>(input.numVertices()), false);
    for (const int v : input.faces.reshaped())
      used[static_cast<std::size_t>(v)] = true;
    vertices_.assign(used.size(), Vertex());
    mesh_.reserve(used.size(), 3 * used.size(), static_cast<std::size_t>(input.numFaces()));
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (used[i]) {
        const Vector3d point = input.vertices.col(static_cast<Eigen::Index>(i));
        vertices_[i] = addVertex(point);
        mesh_.data(vertices_[i]).input = static_cast<int>(i);
      }
    }
    for (Eigen::Index f = 0; f < input.numFaces(); ++f) {
      const auto corner = [&](int k) { return inputVertex(input.faces(k, f)); };
      mesh_.add_face(corner(0), corner(1), corner(2));
    }
    for (const int i : options_.fixedVertices) {
      if (i < 0 || i >= input.numVertices()) {
        throw std::invalid_argument(
            "isotropicRemesh: fixed vertex " + std::to_string(i) + " does not exist");
      }
      if (inputVertex(i).is_valid())
        mesh_.data(inputVertex(i)).fixed = true;
    }
  }

  Vertex inputVertex(int i) const { return vertices_[static_cast<std::size_t>(i)]; }

  void loadBoundary(const MeshView& input) {
    const Adjacency adjacency = buildAdjacency(input.faces, input.numVertices());
    for (const std::vector<int>& loop : boundaryLoops(input.faces, adjacency)) {
      const ClosedPolyline curve(input.vertices(Eigen::all, loop));
      std::vector<double> reach;
      for (std::size_t i = 0; i < loop.size(); ++i) {
        auto& data = mesh_.data(inputVertex(loop[i]));
        data.curve = static_cast<int>(curves_.size());
        data.arcLength = curve.arcLength(static_cast<Eigen::Index>(i));
        data.fixed = data.fixed || options_.boundary == BoundaryMode::kKeep;
        reach.push_back(0.5 * data.size);
      }
      for (const Eigen::Index corner : curve.corners(reach, options_.cornerAngle))
        mesh_.data(inputVertex(loop[static_cast<std::size_t>(corner)])).fixed = true;
      curves_.push_back(curve);
    }
  }

  std::array<Vertex, 3> cornerVertices(Face f) const {
    const HalfEdge h = mesh_.halfedge_handle(f);
    return {
        mesh_.from_vertex_handle(h),
        mesh_.to_vertex_handle(h),
        mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h))};
  }

  Corners corners(Face f) const {
    const std::array<Vertex, 3> v = cornerVertices(f);
    return {mesh_.point(v[0]), mesh_.point(v[1]), mesh_.point(v[2])};
  }

  /// The face's corners with one vertex put elsewhere.
  Corners cornersWith(Face f, Vertex moved, const Vector3d& place) const {
    const std::array<Vertex, 3> v = cornerVertices(f);
    return {
        v[0] == moved ? place : mesh_.point(v[0]),
        v[1] == moved ? place : mesh_.point(v[1]),
        v[2] == moved ? place : mesh_.point(v[2])};
  }

  double wantedLength(Vertex a, Vertex b) const {
    return std::min(mesh_.data(a).size, mesh_.data(b).size);
  }

  /// Length over wanted length.
  double relativeLength(Edge e) const {
    const HalfEdge h = mesh_.halfedge_handle(e, 0);
    return relativeLength(mesh_.from_vertex_handle(h), mesh_.to_vertex_handle(h));
  }

  double relativeLength(Vertex a, Vertex b) const {
    return (mesh_.point(a) - mesh_.point(b)).norm() / wantedLength(a, b);
  }

  // --- split ---

  bool maySplit(Edge e) const {
    return !mesh_.is_boundary(e) || options_.boundary == BoundaryMode::kResample;
  }

  void splitLongEdges() {
    // New edges are appended, so this goes on until none is too long.
    for (std::size_t i = 0; i < mesh_.n_edges(); ++i) {
      const Edge e(static_cast<int>(i));
      while (maySplit(e) && relativeLength(e) > kSplitAbove)
        split(e);
    }
  }

  /// Split in any order, long needles fall into thinner ones whose number grows with the power of
  /// their length. Longest first, every face is cut across its length (Rivara 1984).
  void splitFarTooLongEdges() {
    std::priority_queue<std::pair<double, int>> longest;
    const auto look = [&](Edge e) {
      const double length = maySplit(e) ? relativeLength(e) : 0.0;
      if (length > kFarTooLong)
        longest.emplace(length, e.idx());
    };
    for (std::size_t i = 0; i < mesh_.n_edges(); ++i)
      look(Edge(static_cast<int>(i)));
    while (!longest.empty()) {
      const Edge e(longest.top().second);
      longest.pop();
      const std::size_t firstNew = mesh_.n_edges();
      split(e);
      look(e);
      for (std::size_t i = firstNew; i < mesh_.n_edges(); ++i)
        look(Edge(static_cast<int>(i)));
    }
  }

  void split(Edge e) {
    HalfEdge h = mesh_.halfedge_handle(e, 0);
    if (mesh_.is_boundary(h))
      h = mesh_.opposite_halfedge_handle(h);
    const Vertex a = mesh_.from_vertex_handle(h);
    const Vertex b = mesh_.to_vertex_handle(h);
    Vector3d point = 0.5 * (mesh_.point(a) + mesh_.point(b));
    int curve = -1;
    double arcLength = 0.0;
    if (mesh_.is_boundary(e)) {
      curve = mesh_.data(a).curve;
      arcLength = between(a, b, 0.5);
      point = this->curve(curve).at(arcLength);
    }
    const Vertex v = addVertex(point);
    mesh_.data(v).curve = curve;
    mesh_.data(v).arcLength = arcLength;
    mesh_.split(e, v);
  }

  const ClosedPolyline& curve(int index) const { return curves_[static_cast<std::size_t>(index)]; }

  /// Arc length at a fraction of the way along the boundary from a to b, with the faces.
  double between(Vertex a, Vertex b, double fraction) const {
    const double start = mesh_.data(a).arcLength;
    const ClosedPolyline& boundary = curve(mesh_.data(a).curve);
    return start + fraction * boundary.forward(start, mesh_.data(b).arcLength);
  }

  // --- collapse ---

  void collapseShortEdges() {
    for (std::size_t i = 0; i < mesh_.n_edges(); ++i) {
      const Edge e(static_cast<int>(i));
      if (mesh_.status(e).deleted() || relativeLength(e) >= kCollapseBelow)
        continue;
      const HalfEdge h = mesh_.halfedge_handle(e, 0);
      const HalfEdge opposite = mesh_.opposite_halfedge_handle(h);
      if (canCollapse(h)) {
        mesh_.collapse(h);
      } else if (canCollapse(opposite)) {
        mesh_.collapse(opposite);
      }
    }
    mesh_.garbage_collection();
  }

  /// May the start of h be merged into its end?
  bool canCollapse(HalfEdge h) {
    const Vertex from = mesh_.from_vertex_handle(h);
    const Vertex to = mesh_.to_vertex_handle(h);
    const bool edgeOnBoundary = mesh_.is_boundary(mesh_.edge_handle(h));
    if (mesh_.data(from).fixed || (mesh_.is_boundary(from) && !edgeOnBoundary) ||
        !mesh_.is_collapse_ok(h)) {
      return false;
    }
    for (const Vertex v : mesh_.vv_range(from)) {
      if (v != to && relativeLength(v, to) > kSplitAbove)
        return false;
    }
    return keepsFaces(from, to);
  }

  /// Do the faces that stay when `from` moves to `to` keep their sides?
  bool keepsFaces(Vertex from, Vertex to) const {
    for (const Face f : mesh_.vf_range(from)) {
      const std::array<Vertex, 3> v = cornerVertices(f);
      const bool stays = v[0] != to && v[1] != to && v[2] != to;
      const Vector3d newArea = areaVector(cornersWith(f, from, mesh_.point(to)));
      if (stays && !keepsSide(areaVector(corners(f)), newArea))
        return false;
    }
    return true;
  }

  // --- flip ---

  /// The two faces of an inner edge before and after it is flipped.
  struct FlipView {
    Vertex a, b;  // ends of the edge
    Vertex c, d;  // ends of the flipped edge
    std::array<Corners, 2> before, after;
  };

  FlipView flipView(Edge e) const {
    const HalfEdge h = mesh_.halfedge_handle(e, 0);
    const HalfEdge o = mesh_.opposite_halfedge_handle(h);
    const Vertex va = mesh_.from_vertex_handle(h);
    const Vertex vb = mesh_.to_vertex_handle(h);
    const Vertex vc = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h));
    const Vertex vd = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(o));
    const Vector3d& a = mesh_.point(va);
    const Vector3d& b = mesh_.point(vb);
    const Vector3d& c = mesh_.point(vc);
    const Vector3d& d = mesh_.point(vd);
    return {
        va, vb, vc, vd, {Corners{a, b, c}, Corners{b, a, d}}, {Corners{a, d, c}, Corners{d, b, c}}};
  }

  static double smallerAngle(const std::array<Corners, 2>& pair) {
    return std::min(smallestAngle(pair[0]), smallestAngle(pair[1]));
  }

  /// Do both new faces look to the side of the old pair?
  static bool flipKeepsSide(const FlipView& view) {
    const Vector3d side = areaVector(view.before[0]) + areaVector(view.before[1]);
    return keepsSide(side, areaVector(view.after[0])) && keepsSide(side, areaVector(view.after[1]));
  }

  int valenceError(Vertex v, int change) const {
    const int error = static_cast<int>(mesh_.valence(v)) + change - (mesh_.is_boundary(v) ? 4 : 6);
    return error * error;
  }

  /// Flips the inner edges for which this holds and both new faces keep their side.
  void flipWhere(const auto& isBetter) {
    for (std::size_t i = 0; i < mesh_.n_edges(); ++i) {
      const Edge e(static_cast<int>(i));
      if (mesh_.is_boundary(e) || !mesh_.is_flip_ok(e))
        continue;
      const FlipView view = flipView(e);
      if (isBetter(view) && flipKeepsSide(view))
        mesh_.flip(e);
    }
  }

  void flipForValence() {
    flipWhere([this](const FlipView& view) {
      const int before = valenceError(view.a, 0) + valenceError(view.b, 0) +
                         valenceError(view.c, 0) + valenceError(view.d, 0);
      const int after = valenceError(view.a, -1) + valenceError(view.b, -1) +
                        valenceError(view.c, 1) + valenceError(view.d, 1);
      return after < before && smallerAngle(view.after) > std::min(0.4, smallerAngle(view.before));
    });
  }

  void flipForAngles() {
    flipWhere([](const FlipView& view) {
      const double before = smallerAngle(view.before);
      return before < kGoodAngle && smallerAngle(view.after) > before;
    });
  }

  // --- smoothing ---

  /// Moves every free vertex once. Above an angle goal of 0, a move must not make the smallest
  /// angle around the vertex smaller, unless that stays above the goal.
  void relax(double angleGoal) {
    for (std::size_t i = 0; i < mesh_.n_vertices(); ++i) {
      const Vertex v(static_cast<int>(i));
      if (!mesh_.data(v).fixed)
        mesh_.is_boundary(v) ? slide(v, angleGoal) : relaxInside(v, angleGoal);
    }
  }

  void relaxInside(Vertex v, double angleGoal) {
    const Vector3d aim = relaxedPoint(v);
    if (!tryMove(v, aim, angleGoal))
      tryMove(v, 0.5 * (mesh_.point(v) + aim), angleGoal);
  }

  /// Mean of the surrounding faces' centres by area over the square of the wanted size, within the
  /// tangent plane. In equilibrium the faces' areas follow the size field.
  Vector3d relaxedPoint(Vertex v) const {
    Vector3d mean = Vector3d::Zero();
    Vector3d normal = Vector3d::Zero();
    double sum = 0.0;
    for (const Face f : mesh_.vf_range(v)) {
      const Corners p = corners(f);
      const std::array<Vertex, 3> c = cornerVertices(f);
      const double size =
          (mesh_.data(c[0]).size + mesh_.data(c[1]).size + mesh_.data(c[2]).size) / 3.0;
      const Vector3d area = areaVector(p);
      const double weight = area.norm() / (size * size);
      mean += weight / 3.0 * (p[0] + p[1] + p[2]);
      sum += weight;
      normal += area;
    }
    const Vector3d& point = mesh_.point(v);
    if (!(sum > 0.0))
      return point;
    const Vector3d move = mean / sum - point;
    normal = normal.stableNormalized();
    return point + move - normal.dot(move) * normal;
  }

  Vector3d projected(const Vector3d& point) const {
    return options_.project ? options_.project(point) : bvh_->closestPoint(point).point;
  }

  bool tryMove(Vertex v, const Vector3d& aim, double angleGoal) {
    const Vector3d place = projected(aim);
    if (!mayMove(v, place, angleGoal))
      return false;
    mesh_.set_point(v, place);
    mesh_.data(v).size = sizeAt(place);
    mesh_.data(v).input = -1;
    return true;
  }

  bool mayMove(Vertex v, const Vector3d& place, double angleGoal) const {
    double before = kPi;
    double after = kPi;
    for (const Face f : mesh_.vf_range(v)) {
      const Corners oldCorners = corners(f);
      const Corners newCorners = cornersWith(f, v, place);
      if (!keepsSide(areaVector(oldCorners), areaVector(newCorners)))
        return false;
      before = std::min(before, smallestAngle(oldCorners));
      after = std::min(after, smallestAngle(newCorners));
    }
    return angleGoal <= 0.0 || after >= std::min(before, angleGoal);
  }

  /// Moves a boundary vertex along its curve to where the ways to both neighbours are in the
  /// proportion of their wanted lengths.
  void slide(Vertex v, double angleGoal) {
    const HalfEdge out = mesh_.halfedge_handle(v);  // a boundary vertex keeps its boundary one
    const Vertex previous = mesh_.to_vertex_handle(out);  // faceless: against the faces' direction
    const Vertex next = mesh_.from_vertex_handle(mesh_.prev_halfedge_handle(out));
    const double toPrevious = wantedLength(v, previous);
    const double toNext = wantedLength(v, next);
    const double arcLength = between(previous, next, toPrevious / (toPrevious + toNext));
    const Vector3d place = curve(mesh_.data(v).curve).at(arcLength);
    if (mayMove(v, place, angleGoal)) {
      mesh_.set_point(v, place);
      mesh_.data(v).size = sizeAt(place);
      mesh_.data(v).arcLength = arcLength;
      mesh_.data(v).input = -1;
    }
  }

  RemeshResult extract() const {
    RemeshResult result;
    result.mesh.vertices.resize(3, static_cast<Eigen::Index>(mesh_.n_vertices()));
    result.mesh.faces.resize(3, static_cast<Eigen::Index>(mesh_.n_faces()));
    for (const Vertex v : mesh_.vertices()) {
      result.mesh.vertices.col(v.idx()) = mesh_.point(v);
      result.inputVertices.push_back(mesh_.data(v).fixed ? mesh_.data(v).input : -1);
    }
    for (const Face f : mesh_.faces()) {
      const std::array<Vertex, 3> v = cornerVertices(f);
      result.mesh.faces.col(f.idx()) << v[0].idx(), v[1].idx(), v[2].idx();
    }
    return result;
  }

  const RemeshOptions& options_;
  std::optional<TriangleBvh> bvh_;
  std::vector<ClosedPolyline> curves_;
  std::vector<Vertex> vertices_;  // of the input
  Mesh mesh_;
};

}  // namespace

void RemeshOptions::validate() const {
  if (!(targetEdgeLength > 0.0 && std::isfinite(targetEdgeLength)))
    throw std::invalid_argument("RemeshOptions: targetEdgeLength must be positive");
  if (!(iterations >= 1 && iterations <= 100))
    throw std::invalid_argument("RemeshOptions: iterations must be in [1, 100]");
  if (!(cornerAngle > 0.0 && cornerAngle <= kPi))
    throw std::invalid_argument("RemeshOptions: cornerAngle must be in (0, π]");
}

RemeshResult isotropicRemesh(const MeshView& mesh, const RemeshOptions& options) {
  options.validate();
  requireValid(mesh, "isotropicRemesh");
  const Topology shape = topology(mesh.faces, mesh.numVertices());
  if (!shape.manifold() || !shape.oriented) {
    throw std::invalid_argument(
        "isotropicRemesh: the mesh must be manifold and consistently oriented");
  }
  return Remesher(mesh, options).run();
}

}  // namespace avatar
