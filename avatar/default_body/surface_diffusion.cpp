#include "avatar/default_body/surface_diffusion.h"

#include "avatar/geometry/measures.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <utility>
#include <vector>

namespace avatar {
namespace {

// V × V stiffness (positive semi-definite): cotangent weights times the mean of the two ends'
// conductivity. Negative weights, of obtuse angles, are raised to 0: no value may overshoot.
Eigen::SparseMatrix<double> conductionMatrix(
    const TriangleMesh& mesh, const Eigen::VectorXd& conductivity) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const int apex = mesh.faces(corner, f);
      const int i = mesh.faces((corner + 1) % 3, f);
      const int j = mesh.faces((corner + 2) % 3, f);
      const Eigen::Vector3d a = mesh.vertices.col(i) - mesh.vertices.col(apex);
      const Eigen::Vector3d b = mesh.vertices.col(j) - mesh.vertices.col(apex);
      const double cotangent = std::max(0.0, a.dot(b) / a.cross(b).norm());
      const double weight = 0.5 * cotangent * 0.5 * (conductivity[i] + conductivity[j]);
      entries.emplace_back(i, i, weight);
      entries.emplace_back(j, j, weight);
      entries.emplace_back(i, j, -weight);
      entries.emplace_back(j, i, -weight);
    }
  }
  Eigen::SparseMatrix<double> result(mesh.numVertices(), mesh.numVertices());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

// A third of every adjacent face.
Eigen::VectorXd vertexAreas(const TriangleMesh& mesh) {
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(mesh.numVertices());
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f) {
    const double third = doubleAreaVector(mesh, f).norm() / 6.0;
    for (int corner = 0; corner < 3; ++corner)
      areas[mesh.faces(corner, f)] += third;
  }
  return areas;
}

}  // namespace

SurfaceDiffusion::SurfaceDiffusion(
    const TriangleMesh& mesh, const Eigen::VectorXd& reach, int numSteps)
    : numSteps_(numSteps), areas_(vertexAreas(mesh)) {
  Eigen::SparseMatrix<double> system =
      conductionMatrix(mesh, reach.array().square() / (2.0 * numSteps));
  system.diagonal() += areas_;
  solver_.compute(system);
}

Eigen::MatrixXd SurfaceDiffusion::operator()(Eigen::MatrixXd values) const {
  for (int step = 0; step < numSteps_; ++step) {
    values = solver_.solve(areas_.asDiagonal() * values).eval();
  }
  return values;
}

}  // namespace avatar
