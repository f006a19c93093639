#include "avatar/default_body/surface_diffusion.h"

#include <gtest/gtest.h>

namespace avatar {
namespace {

constexpr int kCells = 40;
constexpr double kCell = 0.01;  // [m]

// A flat square of right triangles, kCells × kCells cells, in the x–y plane.
TriangleMesh flatSquare() {
  TriangleMesh mesh;
  constexpr int kSide = kCells + 1;
  mesh.vertices.resize(3, kSide * kSide);
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j)
      mesh.vertices.col(i * kSide + j) << kCell * i, kCell * j, 0.0;
  }
  mesh.faces.resize(3, 2 * kCells * kCells);
  int f = 0;
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const int a = i * kSide + j;
      mesh.faces.col(f++) << a, a + kSide, a + 1;
      mesh.faces.col(f++) << a + kSide, a + kSide + 1, a + 1;
    }
  }
  return mesh;
}

Eigen::VectorXd evenReach(const TriangleMesh& mesh, double reach) {
  return Eigen::VectorXd::Constant(mesh.numVertices(), reach);
}

TEST(SurfaceDiffusion, KeepsConstants) {
  const TriangleMesh mesh = flatSquare();
  const SurfaceDiffusion diffuse(mesh, evenReach(mesh, 0.05), 3);
  const Eigen::MatrixXd ones = Eigen::MatrixXd::Ones(mesh.numVertices(), 1);
  EXPECT_LT((diffuse(ones) - ones).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(SurfaceDiffusion, OfAnIndicatorStaysBetweenZeroAndOne) {
  const TriangleMesh mesh = flatSquare();
  Eigen::MatrixXd step = Eigen::MatrixXd::Zero(mesh.numVertices(), 1);
  step.topRows(mesh.numVertices() / 2).setOnes();
  const Eigen::MatrixXd result = SurfaceDiffusion(mesh, evenReach(mesh, 0.03), 2)(step);
  EXPECT_GE(result.minCoeff(), -1e-12);
  EXPECT_LE(result.maxCoeff(), 1.0 + 1e-12);
}

TEST(SurfaceDiffusion, SpreadsAPointByItsReach) {
  const TriangleMesh mesh = flatSquare();
  constexpr double kReach = 0.03;
  constexpr int kCenter = (kCells / 2) * (kCells + 1) + kCells / 2;
  const Eigen::MatrixXd point = Eigen::VectorXd::Unit(mesh.numVertices(), kCenter);
  const Eigen::MatrixXd heat = SurfaceDiffusion(mesh, evenReach(mesh, kReach), 3)(point);
  // Inner vertices own equal areas, so plain sums are integrals. The heat equation's variance per
  // axis is 2ct = reach² for any number of backward-Euler steps; 1 % of the heat meets the border.
  double variance = 0.0;
  for (Eigen::Index v = 0; v < mesh.numVertices(); ++v) {
    const double offset = mesh.vertices(0, v) - mesh.vertices(0, kCenter);
    variance += heat(v, 0) * offset * offset;
  }
  EXPECT_NEAR(heat.sum(), 1.0, 0.01);
  EXPECT_NEAR(variance / heat.sum(), kReach * kReach, 0.03 * kReach * kReach);
}

}  // namespace
}  // namespace avatar
