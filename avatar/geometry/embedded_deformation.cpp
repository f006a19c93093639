#include "avatar/geometry/embedded_deformation.h"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace avatar {
namespace {

constexpr int kUnknowns = 6;  // of a node

void requireOption(bool valid, const char* problem) {
  if (!valid)
    throw std::invalid_argument(std::string("EmbeddedDeformation: ") + problem);
}

struct NearNode {
  double squaredDistance = 0.0;
  int node = 0;

  bool operator<(const NearNode& other) const {
    return std::pair(squaredDistance, node) < std::pair(other.squaredDistance, other.node);
  }
};

/// The nearest columns of `nodes`, nearest first; all of them when there are no more.
std::vector<NearNode> nearestNodes(
    const Eigen::Matrix3Xd& nodes, const Eigen::Vector3d& point, int count) {
  std::vector<NearNode> found;
  found.reserve(static_cast<std::size_t>(nodes.cols()));
  for (int node = 0; node < static_cast<int>(nodes.cols()); ++node)
    found.push_back({(nodes.col(node) - point).squaredNorm(), node});
  const auto end = found.begin() + std::min<std::ptrdiff_t>(count, std::ssize(found));
  std::partial_sort(found.begin(), end, found.end());
  found.erase(end, found.end());
  return found;
}

/// Rows of a Jacobian in the making.
class RowWriter {
 public:
  explicit RowWriter(Eigen::Index numRows) : residuals_(numRows) {}

  void begin(double residual) { residuals_[++row_] = residual; }

  /// Derivatives of the row by a node's turn and way.
  void add(int node, const Eigen::Vector3d& byTurn, const Eigen::Vector3d& byWay) {
    for (int axis = 0; axis < 3; ++axis) {
      entries_.emplace_back(row_, kUnknowns * node + axis, byTurn[axis]);
      entries_.emplace_back(row_, kUnknowns * node + 3 + axis, byWay[axis]);
    }
  }

  EmbeddedDeformation::Linearization finish(int numNodes) {
    EmbeddedDeformation::Linearization result{std::move(residuals_), {}};
    result.jacobian.resize(result.residuals.size(), Eigen::Index{kUnknowns} * numNodes);
    result.jacobian.setFromTriplets(entries_.begin(), entries_.end());
    return result;
  }

 private:
  Eigen::VectorXd residuals_;
  std::vector<Eigen::Triplet<double>> entries_;
  int row_ = -1;
};

Eigen::Matrix3d turn(const Eigen::Vector3d& axisAngle) {
  const double angle = axisAngle.norm();
  if (angle < 1e-12)
    return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, axisAngle / angle).toRotationMatrix();
}

}  // namespace

void EmbeddedDeformationOptions::validate() const {
  requireOption(nodeSpacing > 0.0 && std::isfinite(nodeSpacing), "nodeSpacing must be above 0");
  requireOption(
      nodesPerVertex >= 1 && nodesPerVertex <= 16, "nodesPerVertex must be within [1, 16]");
  requireOption(
      neighboursPerNode >= 1 && neighboursPerNode <= 32,
      "neighboursPerNode must be within [1, 32]");
  requireOption(rigidity >= 0.0 && std::isfinite(rigidity), "rigidity must be 0 or above");
  requireOption(attachment > 0.0 && std::isfinite(attachment), "attachment must be above 0");
  requireOption(
      rotationDamping > 0.0 && std::isfinite(rotationDamping), "rotationDamping must be above 0");
}

EmbeddedDeformation::EmbeddedDeformation(
    const Eigen::Matrix3Xd& vertices, const EmbeddedDeformationOptions& options)
    : options_(options), rest_(vertices) {
  options.validate();
  requireOption(vertices.cols() > 0 && vertices.allFinite(), "finite vertices are expected");
  sampleNodes(vertices);
  bindVertices(vertices);
  connectNodes();
  motions_.assign(static_cast<std::size_t>(numNodes()), Eigen::Isometry3d::Identity());
}

void EmbeddedDeformation::sampleNodes(const Eigen::Matrix3Xd& vertices) {
  const double squaredSpacing = options_.nodeSpacing * options_.nodeSpacing;
  nodes_.resize(3, vertices.cols());
  Eigen::Index count = 0;
  for (const auto& vertex : vertices.colwise()) {
    const bool alone =
        count == 0 ||
        (nodes_.leftCols(count).colwise() - vertex).colwise().squaredNorm().minCoeff() >=
            squaredSpacing;
    if (alone)
      nodes_.col(count++) = vertex;
  }
  nodes_.conservativeResize(3, count);
}

/// Weights fade to 0 at the first node that doesn't carry the vertex (Sumner 2007, eq. 4).
void EmbeddedDeformation::bindVertices(const Eigen::Matrix3Xd& vertices) {
  carriers_.reserve(static_cast<std::size_t>(vertices.cols()));
  for (const auto& vertex : vertices.colwise()) {
    std::vector<NearNode> near = nearestNodes(nodes_, vertex, options_.nodesPerVertex + 1);
    const bool hasReach = std::ssize(near) > options_.nodesPerVertex;
    const double reach = (hasReach ? 1.0 : 1.5) * std::sqrt(near.back().squaredDistance);
    if (hasReach)
      near.pop_back();
    std::vector<Carrier> carriers;
    carriers.reserve(near.size());
    double sum = 0.0;
    for (const NearNode& node : near) {
      const double share = 1.0 - std::sqrt(node.squaredDistance) / std::max(reach, 1e-12);
      carriers.push_back({node.node, std::max(share * share, 1e-9)});
      sum += carriers.back().weight;
    }
    for (Carrier& carrier : carriers)
      carrier.weight /= sum;
    carriers_.push_back(std::move(carriers));
  }
}

void EmbeddedDeformation::connectNodes() {
  for (int node = 0; node < numNodes(); ++node) {
    for (const NearNode& near :
         nearestNodes(nodes_, nodes_.col(node), options_.neighboursPerNode + 1)) {
      if (near.node != node)
        springs_.emplace_back(node, near.node);
    }
  }
}

Eigen::Vector3d EmbeddedDeformation::turnedArm(int node, const Eigen::Vector3d& point) const {
  return motions_[static_cast<std::size_t>(node)].linear() * (point - nodes_.col(node));
}

Eigen::Matrix3Xd EmbeddedDeformation::vertices() const {
  Eigen::Matrix3Xd moved = Eigen::Matrix3Xd::Zero(3, rest_.cols());
  for (Eigen::Index v = 0; v < rest_.cols(); ++v) {
    for (const Carrier& carrier : carriers_[static_cast<std::size_t>(v)]) {
      const auto node = static_cast<std::size_t>(carrier.node);
      moved.col(v) += carrier.weight * (turnedArm(carrier.node, rest_.col(v)) +
                                        nodes_.col(carrier.node) + motions_[node].translation());
    }
  }
  return moved;
}

void EmbeddedDeformation::setMotions(const std::vector<Eigen::Isometry3d>& motions) {
  requireOption(motions.size() == motions_.size(), "one motion per node is expected");
  motions_ = motions;
}

/// d(d · (exp([ω]) a))/dω = a × d.
EmbeddedDeformation::Linearization EmbeddedDeformation::linearized(
    std::span<const PlaneTarget> targets) const {
  RowWriter rows(std::ssize(targets) + 3 * (std::ssize(springs_) + Eigen::Index{numNodes()}));
  const Eigen::Matrix3Xd moved = vertices();
  for (const PlaneTarget& target : targets) {
    requireOption(target.vertex >= 0 && target.vertex < rest_.cols(), "a target has no vertex");
    const double root = std::sqrt(target.weight);
    rows.begin(root * (target.direction.dot(moved.col(target.vertex)) - target.offset));
    for (const Carrier& carrier : carriers_[static_cast<std::size_t>(target.vertex)]) {
      const Eigen::Vector3d byWay = root * carrier.weight * target.direction;
      rows.add(carrier.node, turnedArm(carrier.node, rest_.col(target.vertex)).cross(byWay), byWay);
    }
  }
  const double rigid = std::sqrt(options_.rigidity);
  for (const Eigen::Vector2i& spring : springs_) {
    const Eigen::Vector3d arm = turnedArm(spring[0], nodes_.col(spring[1]));
    const Eigen::Vector3d gap = arm + nodes_.col(spring[0]) - nodes_.col(spring[1]) +
                                motions_[static_cast<std::size_t>(spring[0])].translation() -
                                motions_[static_cast<std::size_t>(spring[1])].translation();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d byWay = rigid * Eigen::Vector3d::Unit(axis);
      rows.begin(rigid * gap[axis]);
      rows.add(spring[0], arm.cross(byWay), byWay);
      rows.add(spring[1], Eigen::Vector3d::Zero(), -byWay);
    }
  }
  const double attached = std::sqrt(options_.attachment);
  for (int node = 0; node < numNodes(); ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      rows.begin(attached * motions_[static_cast<std::size_t>(node)].translation()[axis]);
      rows.add(node, Eigen::Vector3d::Zero(), attached * Eigen::Vector3d::Unit(axis));
    }
  }
  return rows.finish(numNodes());
}

double EmbeddedDeformation::step(std::span<const PlaneTarget> targets) {
  const Linearization linear = linearized(targets);
  Eigen::SparseMatrix<double> normal = linear.jacobian.transpose() * linear.jacobian;
  for (int node = 0; node < numNodes(); ++node) {
    for (int axis = 0; axis < 3; ++axis)
      normal.coeffRef(kUnknowns * node + axis, kUnknowns * node + axis) += options_.rotationDamping;
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
  if (solver.info() != Eigen::Success)
    throw std::runtime_error("EmbeddedDeformation: the equations can't be solved");
  move(solver.solve(-(linear.jacobian.transpose() * linear.residuals)));
  return linear.residuals.squaredNorm();
}

void EmbeddedDeformation::move(const Eigen::VectorXd& increment) {
  requireOption(
      increment.size() == Eigen::Index{kUnknowns} * numNodes(), "six values per node are expected");
  for (int node = 0; node < numNodes(); ++node) {
    Eigen::Isometry3d& motion = motions_[static_cast<std::size_t>(node)];
    const Eigen::Vector3d axisAngle = increment.segment<3>(kUnknowns * node);
    const Eigen::Matrix3d turned = turn(axisAngle) * motion.linear();
    // Rounding of many products adds up.
    motion.linear() = Eigen::Quaterniond(turned).normalized().toRotationMatrix();
    motion.translation() += increment.segment<3>(kUnknowns * node + 3);
  }
}

}  // namespace avatar
