#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SparseCore>

#include <span>
#include <vector>

namespace avatar {

struct EmbeddedDeformationOptions {
  double nodeSpacing = 0.06;  ///< no two nodes are nearer to each other [m], > 0
  int nodesPerVertex = 4;     ///< that carry it, 1 … 16
  int neighboursPerNode = 6;  ///< of its springs, 1 … 32
  double rigidity = 1.0;      ///< weight of neighbours that move unlike each other, ≥ 0
  double attachment = 1e-3;   ///< weight of a node's way from where it was [1], > 0
  double rotationDamping =
      1e-6;  ///< of a step's rotations [m²/rad²]: those that nothing decides, > 0

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Pulls a deformed vertex y onto the plane direction · y = offset.
struct PlaneTarget {
  int vertex = 0;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double offset = 0.0;
  double weight = 1.0;  ///< ≥ 0
};

/// A surface carried by a graph of K nodes (Sumner 2007, with rotations as in DynamicFusion): node
/// k at g_k turns by R_k and moves by t_k, and a vertex x near nodes j goes to
///   y = Σ_j w_j (R_j (x − g_j) + g_j + t_j).
/// Fitted to plane targets by Gauss-Newton steps on
///   Σ weight (direction · y − offset)² + rigidity Σ |R_i (g_j − g_i) + g_i + t_i − g_j − t_j|² +
///   attachment Σ |t_k|²,
/// the second sum over the springs from each node i to its nearest neighbours j.
class EmbeddedDeformation {
 public:
  /// Nodes are vertices, taken in their order unless one is within the spacing; vertex and spring
  /// neighbours are the nearest. 3 × V [m], V ≥ 1. Throws std::invalid_argument.
  explicit EmbeddedDeformation(
      const Eigen::Matrix3Xd& vertices, const EmbeddedDeformationOptions& options = {});

  int numNodes() const { return static_cast<int>(nodes_.cols()); }

  const Eigen::Matrix3Xd& nodes() const { return nodes_; }  ///< g, 3 × K [m]

  /// y, 3 × V [m].
  Eigen::Matrix3Xd vertices() const;

  /// K × (R_k, t_k).
  const std::vector<Eigen::Isometry3d>& motions() const { return motions_; }

  /// Throws std::invalid_argument for another K.
  void setMotions(const std::vector<Eigen::Isometry3d>& motions);

  /// Residuals r of the sum above (weights' roots included; targets, then springs, then
  /// attachments), and their derivatives by each node's turn ω (R ← exp([ω]) R) and way: 6 K
  /// columns, [ω_k, t_k] in turns.
  struct Linearization {
    Eigen::VectorXd residuals;
    Eigen::SparseMatrix<double> jacobian;
  };

  Linearization linearized(std::span<const PlaneTarget> targets) const;

  /// One Gauss-Newton step. Returns |r|² before it.
  double step(std::span<const PlaneTarget> targets);

  /// Turns and moves the nodes by 6 K values in the order of the Jacobian's columns.
  void move(const Eigen::VectorXd& increment);

 private:
  void sampleNodes(const Eigen::Matrix3Xd& vertices);
  void bindVertices(const Eigen::Matrix3Xd& vertices);
  void connectNodes();
  Eigen::Vector3d turnedArm(int node, const Eigen::Vector3d& point) const;

  struct Carrier {
    int node = 0;
    double weight = 0.0;
  };

  EmbeddedDeformationOptions options_;
  Eigen::Matrix3Xd rest_;   // 3 × V [m]
  Eigen::Matrix3Xd nodes_;  // 3 × K [m]
  std::vector<Eigen::Isometry3d> motions_;
  std::vector<std::vector<Carrier>> carriers_;  // of each vertex
  std::vector<Eigen::Vector2i> springs_;        // from, to
};

}  // namespace avatar
