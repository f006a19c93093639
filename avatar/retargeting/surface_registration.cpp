#include "avatar/retargeting/surface_registration.h"

#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"

#include <Eigen/SparseCholesky>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace avatar {
namespace {

void require(bool condition, const char* message) {
  if (!condition)
    throw std::invalid_argument(std::string("RegistrationOptions: ") + message);
}

/// How much longer the target's bones at a joint are: those to its children, or the one to its
/// parent where it has none.
Eigen::VectorXd boneScales(
    const std::vector<int>& parents, const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  constexpr double kShortest = 0.01;  // [m]: joints that lie together say nothing of size
  const Eigen::Index count = from.cols();
  Eigen::VectorXd lengthsFrom = Eigen::VectorXd::Zero(count);
  Eigen::VectorXd lengthsTo = Eigen::VectorXd::Zero(count);
  for (Eigen::Index joint = 1; joint < count; ++joint) {
    const int parent = parents[static_cast<std::size_t>(joint)];
    lengthsFrom[parent] += (from.col(joint) - from.col(parent)).norm();
    lengthsTo[parent] += (to.col(joint) - to.col(parent)).norm();
  }
  Eigen::VectorXd scales = Eigen::VectorXd::Ones(count);
  for (Eigen::Index joint = 0; joint < count; ++joint) {
    const int parent = parents[static_cast<std::size_t>(joint)];
    if (lengthsFrom[joint] > kShortest && lengthsTo[joint] > kShortest)
      scales[joint] = lengthsTo[joint] / lengthsFrom[joint];
    else if (parent >= 0)
      scales[joint] = scales[parent];
  }
  return scales;
}

/// The nearest points of the target that a vertex may correspond to.
struct Matches {
  Eigen::Matrix3Xd points;  // 3 × V [m]
  Eigen::VectorXd weights;  // V: 1, or 0 where there is none
};

Matches findMatches(
    const MeshView& moved, const SignedDistance& target, const RegistrationOptions& options) {
  const double minCosine = std::cos(options.maxAngle * std::numbers::pi / 180.0);
  const Eigen::Matrix3Xd normals = vertexNormals(moved);
  Matches matches{moved.vertices, Eigen::VectorXd::Zero(moved.numVertices())};
  for (Eigen::Index v = 0; v < moved.numVertices(); ++v) {
    const SignedDistanceResult nearest = target(moved.vertices.col(v), options.maxDistance);
    if (nearest.closest.face < 0 || nearest.normal.dot(normals.col(v)) < minCosine)
      continue;
    matches.points.col(v) = nearest.closest.point;
    matches.weights[v] = 1.0;
  }
  return matches;
}

/// Minimises Σ_i w_i |u_i − (m_i − x_i)|² + stiffness Σ_edges |u_i − u_j|².
Eigen::Matrix3Xd smoothDisplacement(
    const Matches& matches,
    const Eigen::Matrix3Xd& vertices,
    const Adjacency& adjacency,
    double stiffness) {
  constexpr double kTether = 1e-6;  // keeps pieces without any match where they are
  const Eigen::Index count = vertices.cols();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(count + 4 * adjacency.edges.cols()));
  for (Eigen::Index v = 0; v < count; ++v)
    entries.emplace_back(v, v, matches.weights[v] + kTether);
  for (const auto& edge : adjacency.edges.colwise()) {
    entries.emplace_back(edge[0], edge[0], stiffness);
    entries.emplace_back(edge[1], edge[1], stiffness);
    entries.emplace_back(edge[0], edge[1], -stiffness);
    entries.emplace_back(edge[1], edge[0], -stiffness);
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
  const Eigen::MatrixXd pulls =
      ((matches.points - vertices) * matches.weights.asDiagonal()).transpose();
  return factors.solve(pulls).transpose();
}

}  // namespace

void RegistrationOptions::validate() const {
  require(rounds >= 1 && rounds <= 100, "rounds must be 1 … 100");
  require(firstStiffness > 0.0 && std::isfinite(firstStiffness), "firstStiffness must be > 0");
  require(lastStiffness > 0.0 && std::isfinite(lastStiffness), "lastStiffness must be > 0");
  require(maxDistance > 0.0, "maxDistance must be > 0");
  require(maxAngle >= 1.0 && maxAngle <= 90.0, "maxAngle must be 1 … 90 degrees");
}

Eigen::Matrix3Xd movedWithJoints(
    const AvatarBody& body, const PosedBody& posed, const Eigen::Matrix3Xd& targetJoints) {
  if (targetJoints.cols() != posed.joints.cols())
    throw std::invalid_argument("movedWithJoints: the bodies have different numbers of joints");
  const Eigen::VectorXd scales = boneScales(body.parents, posed.joints, targetJoints);
  Eigen::Matrix3Xd moved = Eigen::Matrix3Xd::Zero(3, posed.vertices.cols());
  for (Eigen::Index v = 0; v < moved.cols(); ++v) {
    using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
    for (Weights::InnerIterator weight(body.skinningWeights, v); weight; ++weight) {
      const Eigen::Index joint = weight.col();
      moved.col(v) +=
          weight.value() * (targetJoints.col(joint) +
                            scales[joint] * (posed.vertices.col(v) - posed.joints.col(joint)));
    }
  }
  return moved;
}

Eigen::Matrix3Xd registerSurfaces(
    const MeshView& start, const MeshView& target, const RegistrationOptions& options) {
  options.validate();
  requireValid(start, "registerSurfaces: start");
  const SignedDistance surface(target);
  const Adjacency adjacency = buildAdjacency(start.faces, start.numVertices());
  Eigen::Matrix3Xd moved = start.vertices;
  for (int round = 0; round < options.rounds; ++round) {
    const double progress = options.rounds == 1 ? 1.0 : round / (options.rounds - 1.0);
    const double stiffness =
        options.firstStiffness * std::pow(options.lastStiffness / options.firstStiffness, progress);
    const Matches matches = findMatches({moved, start.faces}, surface, options);
    moved += smoothDisplacement(matches, moved, adjacency, stiffness);
  }
  const Matches last = findMatches({moved, start.faces}, surface, options);
  return last.points;  // unmatched vertices stay where their neighbours have drawn them
}

}  // namespace avatar
