#pragma once

#include "avatar/geometry/mesh.h"

#include <Eigen/SparseCholesky>

namespace avatar {

/// Heat diffusion of per-vertex values over a triangle mesh: backward-Euler steps of
/// ∂u/∂t = ∇·(c ∇u) over unit time with the cotangent Laplacian and lumped masses.
class SurfaceDiffusion {
 public:
  /// `reach` (V) is the standard deviation of the kernel around each vertex [m]: c = reach²/2.
  SurfaceDiffusion(const TriangleMesh& mesh, const Eigen::VectorXd& reach, int numSteps = 1);

  /// V × n values, each column diffused.
  Eigen::MatrixXd operator()(Eigen::MatrixXd values) const;

 private:
  int numSteps_;
  Eigen::VectorXd areas_;  // of the vertices [m²]
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver_;
};

}  // namespace avatar
