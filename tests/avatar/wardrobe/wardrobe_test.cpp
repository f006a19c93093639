#include "avatar/wardrobe/wardrobe.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"
#include "avatar/skinning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace avatar {
namespace {

constexpr double kFloatRounding = 1e-6;  // vertices are stored as float32 [m]

Eigen::VectorXd betasOf(const std::string& preset) {
  for (const BodyPreset& candidate : bodyPresets()) {
    if (candidate.name == preset)
      return candidate.betas;
  }
  throw std::invalid_argument("no preset " + preset);
}

Eigen::VectorXd edgeLengths(const TriangleMesh& mesh) {
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  Eigen::VectorXd lengths(adjacency.numEdges());
  for (Eigen::Index edge = 0; edge < adjacency.numEdges(); ++edge)
    lengths[edge] =
        (mesh.vertices.col(adjacency.edges(0, edge)) - mesh.vertices.col(adjacency.edges(1, edge)))
            .norm();
  return lengths;
}

double smallestAngle(const TriangleMesh& mesh) {
  double smallest = std::numbers::pi;
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face)
    smallest = std::min(smallest, faceAngles(mesh, face).minCoeff());
  return smallest * 180.0 / std::numbers::pi;
}

int expectedOpenings(const std::string& name) {
  if (name == "skirt")
    return 2;                                             // waist, hem
  return name == "trousers" || name == "shorts" ? 3 : 4;  // neck, two sleeves, hem
}

void expectGoodMesh(const Garment& garment, double edgeLength) {
  SCOPED_TRACE(garment.name);
  const Topology shape = topology(garment.mesh.faces, garment.mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented);
  EXPECT_EQ(shape.components, 1);
  EXPECT_EQ(shape.genus, 0);
  EXPECT_EQ(shape.boundaryLoops, expectedOpenings(garment.name));
  EXPECT_GE(smallestAngle(garment.mesh), 20.0);
  const Eigen::VectorXd lengths = edgeLengths(garment.mesh) / edgeLength;
  EXPECT_GE(lengths.minCoeff(), 0.5);
  EXPECT_LE(lengths.maxCoeff(), 1.6);
}

void expectOutside(const Garment& garment, const SignedDistance& skin) {
  SCOPED_TRACE(garment.name);
  double nearest = 1.0;
  for (const auto& vertex : garment.mesh.vertices.colwise())
    nearest = std::min(nearest, skin(vertex).distance);
  EXPECT_GE(nearest, garment.cloth.thickness - kFloatRounding);
}

/// Every vertex of the outer garment that lies over the inner one is outside of it.
void expectOver(const Garment& outer, const Garment& inner) {
  SCOPED_TRACE(outer.name + " over " + inner.name);
  const SignedDistance surface(inner.mesh);
  for (const auto& vertex : outer.mesh.vertices.colwise()) {
    const SignedDistanceResult result = surface(vertex, 0.04);
    if (result.closest.face < 0)
      continue;
    const Eigen::Vector3d away = vertex - result.closest.point;
    // Beyond the rim, the nearest point is seen sidewise and has no side.
    if (away.normalized().dot(result.normal) > -0.7)
      continue;
    ADD_FAILURE() << "a vertex is " << -1e3 * result.distance << " mm inside";
  }
}

/// Inner ones first, as they are named.
std::vector<Garment> garmentsFor(
    const Eigen::VectorXd& betas, const std::vector<std::string>& names) {
  const DressingBody body = standForDressing(defaultBody(), betas);
  std::vector<Garment> garments;
  for (const std::string& name : names)
    garments.push_back(makeGarment({.name = name}, body, garments));
  return garments;
}

struct Wearer {
  std::string shape;
  std::vector<std::string> names;
};

class Wardrobe : public testing::TestWithParam<Wearer> {};

TEST_P(Wardrobe, FitsTheBody) {
  const Eigen::VectorXd betas = betasOf(GetParam().shape);
  const std::vector<Garment> garments = garmentsFor(betas, GetParam().names);
  const Eigen::Matrix3Xd body = posedVertices(defaultBody(), betas, garments.front().bindPose);
  const SignedDistance skin(MeshView(body, defaultBody().faces));
  for (std::size_t i = 0; i < garments.size(); ++i) {
    expectGoodMesh(garments[i], 0.02);
    expectOutside(garments[i], skin);
    for (std::size_t below = 0; below < i; ++below)
      expectOver(garments[i], garments[below]);
  }
}

std::string outfitName(const testing::TestParamInfo<Wearer>& info) {
  std::string name = info.param.shape;
  for (const std::string& garment : info.param.names)
    name += "_" + garment;
  return name;
}

INSTANTIATE_TEST_SUITE_P(
    Outfits,
    Wardrobe,
    testing::Values(
        Wearer{"mean", {"trousers", "tshirt"}},
        Wearer{"mean", {"skirt", "shirt"}},
        Wearer{"mean", {"shorts", "dress"}},
        Wearer{"heavy", {"trousers", "tshirt"}},
        Wearer{"heavy", {"skirt", "shirt"}},
        Wearer{"heavy", {"shorts", "dress"}},
        Wearer{"slender", {"trousers", "tshirt"}},
        Wearer{"slender", {"skirt", "shirt"}},
        Wearer{"slender", {"shorts", "dress"}},
        Wearer{"female", {"trousers", "tshirt", "shirt"}}),
    outfitName);

Garment made(const GarmentOrder& order) {
  return makeGarment(order, standForDressing(defaultBody(), betasOf("mean")));
}

TEST(WardrobePieces, EaseIsTheRoomAtTheChest) {
  // Mean distance of the fabric at chest height grows as the ease does.
  const auto chestRadius = [](double ease) {
    const Garment shirt = made({.name = "tshirt", .ease = ease});
    double sum = 0.0;
    int count = 0;
    for (const auto& vertex : shirt.mesh.vertices.colwise()) {
      if (std::abs(vertex.y() - 0.1) < 0.05 && std::abs(vertex.x()) < 0.25) {
        sum += std::hypot(vertex.x(), vertex.z());
        ++count;
      }
    }
    return sum / count;
  };
  // Offsetting convex sections by e moves them by e; a centimetre's tolerance is for the smoothing
  // and for the band's other sampling.
  EXPECT_NEAR(chestRadius(0.06) - chestRadius(0.02), 0.04, 0.01);
}

TEST(WardrobePieces, EdgeLengthIsFree) {
  for (const double edgeLength : {0.012, 0.03})
    expectGoodMesh(made({.name = "shorts", .edgeLength = edgeLength}), edgeLength);
}

TEST(WardrobePieces, WaistbandsArePinnedNecklinesAreNot) {
  const Garment skirt = made({.name = "skirt"});
  ASSERT_FALSE(skirt.pins.empty());
  EXPECT_TRUE(std::is_sorted(skirt.pins.begin(), skirt.pins.end()));
  const double waist = skirt.mesh.vertices(1, skirt.pins.front());
  for (const int pin : skirt.pins) {
    EXPECT_NEAR(skirt.mesh.vertices(1, pin), waist, 0.005);  // an even band
    EXPECT_EQ(skirt.maxDistance[pin], 0.0);
  }
  EXPECT_GT(skirt.maxDistance.maxCoeff(), 0.3);  // the hem may swing
  const Garment shirt = made({.name = "tshirt"});
  EXPECT_TRUE(shirt.pins.empty());
  EXPECT_GT(shirt.maxDistance.minCoeff(), 0.0);
}

TEST(WardrobePieces, FollowsTheBodyIntoItsBindPose) {
  // Skinned like the body, the garment moves with it: in the bind pose it is where it was made.
  const Garment shirt = made({.name = "tshirt"});
  const SkinnedBody body = posedBody(defaultBody(), betasOf("mean"), shirt.bindPose);
  for (Eigen::Index v = 0; v < shirt.mesh.numVertices(); v += 37) {
    double sum = 0.0;
    for (int joint = 0; joint < static_cast<int>(body.worldFromJoint.size()); ++joint)
      sum += shirt.skinningWeights.coeff(v, joint);
    EXPECT_EQ(sum, 1.0);
  }
  // The sleeves follow the arms, the hem doesn't.
  Eigen::Index sleeve = 0;
  shirt.mesh.vertices.row(0).maxCoeff(&sleeve);
  EXPECT_GT(shirt.skinningWeights.coeff(sleeve, kLeftShoulder), 0.5);
  Eigen::Index hem = 0;
  shirt.mesh.vertices.row(1).minCoeff(&hem);
  EXPECT_LT(shirt.skinningWeights.coeff(hem, kLeftShoulder), 0.05);
}

TEST(WardrobePieces, RefusesWhatCannotBeMade) {
  EXPECT_THROW(made({.name = "toga"}), std::invalid_argument);
  EXPECT_THROW(made({.name = "skirt", .ease = 0.5}), std::invalid_argument);
  EXPECT_THROW(made({.name = "skirt", .edgeLength = 0.0}), std::invalid_argument);
  BodyModel lying = defaultBody();
  lying.templateVertices.row(1).swap(lying.templateVertices.row(2));
  EXPECT_THROW(standForDressing(lying, betasOf("mean")), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
