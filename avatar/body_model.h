#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <string>
#include <vector>

namespace avatar {

/// A body of the SMPL family (Loper 2015): rest data only, any vertex count V, joint count J and
/// shape count B. Frame of the template: Y up, facing +Z, T-pose, metres. Joint 0 is the root.
struct BodyModel {
  std::string name;                   ///< "default" or the file it came from
  Eigen::Matrix3Xd templateVertices;  ///< T̄, 3 × V [m]
  Eigen::Matrix3Xi faces;             ///< 3 × F
  Eigen::MatrixXd shapeDirections;  ///< S, 3V × B [m per unit beta]; row 3v+c is axis c of vertex v
  /// P, 3V × 9(J−1) [m per unit of R−I]; column 9(j−1)+3r+c multiplies (R_j − I)(r,c). Joints whose
  /// block is all zero store an empty block.
  std::vector<Eigen::MatrixXf> poseDirections;  ///< J−1 blocks, each 3V × 9, or 0 × 0 when zero
  Eigen::SparseMatrix<double, Eigen::RowMajor> jointRegressor;   ///< J × V
  Eigen::SparseMatrix<double, Eigen::RowMajor> skinningWeights;  ///< V × J, rows sum to 1
  std::vector<int> parents;  ///< J entries; parents[0] = −1, parents[j] < j

  Eigen::Index numVertices() const { return templateVertices.cols(); }

  Eigen::Index numFaces() const { return faces.cols(); }

  int numJoints() const { return static_cast<int>(parents.size()); }

  int numBetas() const { return static_cast<int>(shapeDirections.cols()); }
};

}  // namespace avatar
