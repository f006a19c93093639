#include "bullet_ext/core/cloth_mesh.h"

#include "bullet_ext/core/cloth_topology.h"
#include "tests/bullet_ext/core/cloth_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

namespace bullet_ext {
namespace {

using test::clothOf;
using test::equilateralSheet;
using test::hingeSheet;
using test::Sheet;

std::string messageOf(
    const Sheet& sheet, const ClothMaterial& material = {}, const ClothMeshOptions& options = {}) {
  try {
    clothOf(sheet, material, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

void expectMessage(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "\"" << message << "\"";
}

TEST(ClothMesh, countsFollowEuler) {
  const ClothMesh mesh = clothOf(equilateralSheet(7, 5, 0.02));
  EXPECT_EQ(mesh.numVertices(), 35);
  EXPECT_EQ(mesh.faces.cols(), 48);
  EXPECT_EQ(mesh.springs.cols(), 35 + 48 - 1);                  // V − E + F = 1 for a disc
  EXPECT_EQ(mesh.hinges.cols(), 3 * 48 - mesh.springs.cols());  // 3F = E + inner edges
}

TEST(ClothMesh, restShapeOfAFlatEquilateralSheet) {
  const ClothMesh mesh = clothOf(equilateralSheet(6, 6, 0.02));
  // Double rounding of coordinates of 0.1 m.
  EXPECT_LT((mesh.springRestLengths.array() - 0.02).abs().maxCoeff(), 1e-15);
  EXPECT_LT(mesh.hingeRestAngles.cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_TRUE((mesh.springStiffness.array() == 800.0).all());
  EXPECT_TRUE((mesh.hingeStiffness.array() == 0.05).all());
}

TEST(ClothMesh, hingesAreOrientedLikeTheFaces) {
  const ClothMesh mesh = clothOf(equilateralSheet(5, 4, 0.02));
  const auto hasFace = [&](int face, const Eigen::Vector3i& corners) {
    Eigen::Vector3i turned = corners;
    for (int i = 0; i < 3; ++i) {
      if (mesh.faces.col(face) == turned) {
        return true;
      }
      std::rotate(turned.begin(), turned.begin() + 1, turned.end());
    }
    return false;
  };
  for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
    const Eigen::Vector4i x = mesh.hinges.col(h);
    EXPECT_LT(x[0], x[1]);
    EXPECT_TRUE(hasFace(mesh.hingeFaces(0, h), {x[0], x[1], x[2]}));
    EXPECT_TRUE(hasFace(mesh.hingeFaces(1, h), {x[1], x[0], x[3]}));
    EXPECT_EQ(mesh.springs.col(mesh.hingeSprings[static_cast<std::size_t>(h)]), x.head<2>());
  }
}

TEST(ClothMesh, foldedRestShapeHasSignedAngles) {
  for (const double angle : {-2.0, -0.3, 0.0, 0.5, 3.0}) {
    const ClothMesh mesh = clothOf(hingeSheet(0.02, 0.015, angle));
    ASSERT_EQ(mesh.hinges.cols(), 1);
    EXPECT_NEAR(mesh.hingeRestAngles[0], angle, 1e-14);
  }
}

TEST(ClothMesh, oneTriangleIsAGarment) {
  Sheet sheet = hingeSheet(0.02, 0.015, 0.0);
  sheet.vertices.conservativeResize(3, 3);
  sheet.faces.conservativeResize(3, 1);
  const ClothMesh mesh = clothOf(sheet);
  EXPECT_EQ(mesh.springs.cols(), 3);
  EXPECT_EQ(mesh.hinges.cols(), 0);
}

TEST(ClothMesh, piecesStayApart) {
  const Sheet one = equilateralSheet(4, 4, 0.02);
  Sheet two = one;
  two.vertices.conservativeResize(3, 32);
  two.vertices.rightCols(16) = one.vertices.colwise() + Eigen::Vector3d(0.0, 0.0, 0.5);
  two.faces.conservativeResize(3, 36);
  two.faces.rightCols(18) = one.faces.array() + 16;
  EXPECT_EQ(clothOf(two).springs.cols(), 2 * clothOf(one).springs.cols());
  EXPECT_EQ(clothOf(two).hinges.cols(), 2 * clothOf(one).hinges.cols());
}

TEST(ClothMesh, arealMassIsDensityTimesArea) {
  const Sheet sheet = equilateralSheet(8, 8, 0.02);
  const ClothMesh mesh = clothOf(sheet, {.massMode = MassMode::kAreal, .arealDensity = 0.2});
  const double area = 98.0 * std::sqrt(3.0) / 4.0 * 4e-4;
  EXPECT_NEAR(mesh.masses.sum(), 0.2 * area, 1e-15);
  // An inner vertex owns a third of six triangles: 0.07 g, where the paper has 1 g.
  EXPECT_NEAR(mesh.masses.maxCoeff(), 0.2 * 2.0 * std::sqrt(3.0) / 4.0 * 4e-4, 1e-15);
  EXPECT_TRUE((clothOf(sheet).masses.array() == 0.001).all());
}

TEST(ClothMesh, pinsHaveNoInverseMass) {
  const ClothMesh mesh = clothOf(equilateralSheet(4, 4, 0.02), {}, {.pins = {9, 3, 9}});
  EXPECT_EQ(mesh.pins.size(), 2U);
  for (int input = 0; input < 16; ++input) {
    const int solver = mesh.solverFromInput[static_cast<std::size_t>(input)];
    EXPECT_EQ(mesh.isPinned(solver), input == 3 || input == 9);
    EXPECT_EQ(mesh.masses[solver], 0.001);
  }
}

TEST(ClothMesh, ordersAreInverse) {
  const Sheet sheet = equilateralSheet(9, 9, 0.02);
  const ClothMesh mesh = clothOf(sheet);
  EXPECT_EQ(toInputOrder(mesh, mesh.restPositions), sheet.vertices);
  EXPECT_EQ(toSolverOrder(mesh, sheet.vertices), mesh.restPositions);
  EXPECT_NE(mesh.restPositions, sheet.vertices);
  EXPECT_EQ(clothOf(sheet, {}, {.vertexOrder = VertexOrder::kInput}).restPositions, sheet.vertices);
}

TEST(ClothMesh, mortonOrderBringsNeighboursTogether) {
  // A shuffled sheet: column i of the shuffle is vertex 37 i mod N (a permutation, N prime to 37).
  const Sheet sheet = equilateralSheet(32, 32, 0.02);
  std::vector<int> shuffle(1024);
  for (int i = 0; i < 1024; ++i) {
    shuffle[static_cast<std::size_t>(i)] = 37 * i % 1024;
  }
  const Eigen::Matrix3Xd shuffled = sheet.vertices(Eigen::all, shuffle);
  const std::vector<int> order = mortonOrder(shuffled);
  const Eigen::Matrix3Xd sorted = shuffled(Eigen::all, order);
  const auto meanStep = [](const Eigen::Matrix3Xd& x) {
    return (x.rightCols(x.cols() - 1) - x.leftCols(x.cols() - 1)).colwise().norm().mean();
  };
  EXPECT_LT(meanStep(sorted), 2.0 * 0.02);
  EXPECT_GT(meanStep(shuffled), 5.0 * 0.02);
}

TEST(ClothMesh, valuesPerElementAreInTheInputsOrder) {
  const Sheet sheet = equilateralSheet(5, 5, 0.02);
  const ClothMesh plain = clothOf(sheet, {}, {.vertexOrder = VertexOrder::kInput});
  ClothMeshOptions options;
  for (Eigen::Index s = 0; s < plain.springs.cols(); ++s) {
    options.edgeStretchStiffness.push_back(100.0 * plain.springs(0, s) + plain.springs(1, s));
  }
  for (Eigen::Index h = 0; h < plain.hinges.cols(); ++h) {
    options.hingeTorsionStiffness.push_back(100.0 * plain.hinges(0, h) + plain.hinges(1, h));
  }
  for (int v = 0; v < 25; ++v) {
    options.vertexMasses.push_back(1.0 + v);
  }
  const ClothMesh mesh = clothOf(sheet, {}, options);
  const auto nameOf = [&](int a, int b) {
    const auto [low, high] = std::minmax(
        {mesh.inputFromSolver[static_cast<std::size_t>(a)],
         mesh.inputFromSolver[static_cast<std::size_t>(b)]});
    return 100.0 * low + high;
  };
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    EXPECT_EQ(mesh.springStiffness[s], nameOf(mesh.springs(0, s), mesh.springs(1, s)));
  }
  for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
    EXPECT_EQ(mesh.hingeStiffness[h], nameOf(mesh.hinges(0, h), mesh.hinges(1, h)));
  }
  for (int v = 0; v < 25; ++v) {
    EXPECT_EQ(mesh.masses[v], 1.0 + mesh.inputFromSolver[static_cast<std::size_t>(v)]);
  }
}

TEST(ClothMesh, refusesBrokenMeshes) {
  const Sheet good = equilateralSheet(3, 3, 0.02);
  Sheet bad = good;
  bad.vertices(1, 4) = NAN;
  expectMessage(messageOf(bad), "vertex 4");
  bad = good;
  bad.vertices(1, 4) = 1e9;
  expectMessage(messageOf(bad), "vertex 4");
  bad = good;
  bad.faces(2, 1) = 9;
  expectMessage(messageOf(bad), "face 1 names vertex 9");
  bad.faces(2, 1) = -1;
  expectMessage(messageOf(bad), "face 1 names vertex -1");
  bad = good;
  bad.faces(2, 1) = bad.faces(1, 1);
  expectMessage(messageOf(bad), "face 1 has no area");
  bad = good;
  bad.vertices.conservativeResize(3, 10);
  bad.vertices.col(9).setZero();
  expectMessage(messageOf(bad), "vertex 9 belongs to no face");
  bad.faces.resize(3, 0);
  expectMessage(messageOf(bad), "no faces");
}

TEST(ClothMesh, refusesEdgesThatAreNoHinge) {
  Sheet three = hingeSheet(0.02, 0.015, 0.5);
  three.vertices.conservativeResize(3, 5);
  three.vertices.col(4) << 0.01, 0.0, 0.02;
  three.faces.conservativeResize(3, 3);
  three.faces.col(2) << 0, 1, 4;
  expectMessage(messageOf(three), "between vertices 0 and 1 has 3 faces");
  Sheet turned = hingeSheet(0.02, 0.015, 0.5);
  turned.faces.col(1).reverseInPlace();
  expectMessage(messageOf(turned), "between vertices 0 and 1 is run along in the same direction");
}

TEST(ClothMesh, refusesWrongOptions) {
  const Sheet sheet = equilateralSheet(3, 3, 0.02);
  expectMessage(messageOf(sheet, {.damping = -1.0}), "damping");
  expectMessage(messageOf(sheet, {}, {.pins = {9}}), "pin 9");
  expectMessage(
      messageOf(sheet, {}, {.edgeStretchStiffness = {1.0}}), "edgeStretchStiffness has 1 values");
  expectMessage(
      messageOf(sheet, {}, {.hingeTorsionStiffness = std::vector<double>(8, NAN)}),
      "hingeTorsionStiffness[0]");
  expectMessage(
      messageOf(sheet, {}, {.vertexMasses = std::vector<double>(9, 0.0)}), "vertexMasses[0]");
}

}  // namespace
}  // namespace bullet_ext
