#include "avatar/default_body/joint_regressor.h"

#include <Eigen/Dense>

#include <algorithm>

namespace avatar {
namespace {

// The skin nearest to a joint, left and right alike for a joint on the midline.
std::vector<int> nearestVertices(const TriangleMesh& mesh, const Eigen::Vector3d& joint) {
  constexpr double kFactor = 2.1;  // of the distance to the nearest vertex
  const Eigen::VectorXd distances = (mesh.vertices.colwise() - joint).colwise().norm();
  const double reach = kFactor * distances.minCoeff() + 0.03;
  std::vector<int> result;
  for (Eigen::Index v = 0; v < distances.size(); ++v) {
    if (distances[v] < reach)
      result.push_back(static_cast<int>(v));
  }
  return result;
}

}  // namespace

SparseRowMatrix makeJointRegressor(
    const SymmetricMesh& body, const ShapeSpace& shapes, const JointPositions& joints) {
  const Eigen::MatrixXd directions = shapes.directions();
  const Eigen::MatrixXd jointDirections = shapes.jointDirections();
  std::vector<Eigen::Triplet<double>> entries;
  for (int joint = 0; joint < kNumSmplJoints; ++joint) {
    const std::vector<int> near = nearestVertices(body.mesh, joints[joint]);
    const auto count = static_cast<Eigen::Index>(near.size());
    // Rows: Σw = 1, Σ w v = J, and per shape Σ w ∂v/∂β = ∂J/∂β.
    constexpr int kNumExact = 4;
    Eigen::MatrixXd A(kNumExact + 3 * kNumShapes, count);
    Eigen::VectorXd b(A.rows());
    b << 1.0, joints[joint], jointDirections.middleRows<3>(3 * joint).reshaped();
    for (Eigen::Index i = 0; i < count; ++i) {
      const int v = near[static_cast<std::size_t>(i)];
      A.col(i) << 1.0, body.mesh.vertices.col(v), directions.middleRows<3>(3 * v).reshaped();
    }
    // Least change from equal weights: w = w₀ + Aᵀ (A Aᵀ + D)⁻¹ (b − A w₀), where D lets the shape
    // rows give way (they are in metres per unit: about a tenth of the position rows).
    const Eigen::VectorXd equal =
        Eigen::VectorXd::Constant(count, 1.0 / static_cast<double>(count));
    constexpr double kSoftness = 1e-4;
    Eigen::MatrixXd normal = A * A.transpose();
    normal.diagonal().tail(3 * kNumShapes).array() += kSoftness;
    const Eigen::VectorXd weights = equal + A.transpose() * normal.ldlt().solve(b - A * equal);
    for (Eigen::Index i = 0; i < count; ++i) {
      entries.emplace_back(joint, near[static_cast<std::size_t>(i)], weights[i]);
    }
  }
  SparseRowMatrix result(kNumSmplJoints, body.mesh.numVertices());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace avatar
