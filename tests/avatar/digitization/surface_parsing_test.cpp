#include "avatar/digitization/surface_parsing.h"

#include "avatar/digitization/label_mrf.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "tests/support/primitive_meshes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace avatar {
namespace {

LabelProblem randomProblem(std::uint64_t seed, int count) {
  test::Noise noise(seed);
  LabelProblem problem;
  for (int i = 0; i < count; ++i)
    problem.costs.push_back({1.0 + noise.next(), 1.0 + noise.next(), 1.0 + noise.next()});
  problem.edges.resize(2, 2 * count - 3);
  for (int e = 0; e < count - 1; ++e)
    problem.edges.col(e) << e, e + 1;
  for (int e = 0; e < count - 2; ++e)
    problem.edges.col(count - 1 + e) << e, e + 2;
  problem.edgeWeights = Eigen::VectorXd::NullaryExpr(
      problem.edges.cols(), [&] { return 0.4 * (1.0 + noise.next()); });
  return problem;
}

/// The least energy of all 3^N labellings.
double leastEnergy(const LabelProblem& problem) {
  const std::size_t count = problem.costs.size();
  double least = std::numeric_limits<double>::infinity();
  for (int code = 0; code < static_cast<int>(std::pow(3.0, static_cast<double>(count))); ++code) {
    std::vector<std::uint8_t> labels;
    for (int rest = code; labels.size() < count; rest /= 3)
      labels.push_back(static_cast<std::uint8_t>(1 + rest % 3));
    least = std::min(least, labelEnergy(problem, labels));
  }
  return least;
}

TEST(LabelMrf, WithTwoLabelsFindsTheLeastEnergy) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    LabelProblem problem = randomProblem(seed, 8);
    for (auto& costs : problem.costs)
      costs[kLowerLabel - 1] = 1000.0;  // never worth it, so one expansion is the whole problem
    EXPECT_NEAR(labelEnergy(problem, leastEnergyLabels(problem)), leastEnergy(problem), 1e-9);
  }
}

TEST(LabelMrf, WithThreeLabelsIsCloseToTheLeastEnergy) {
  int exact = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const LabelProblem problem = randomProblem(seed, 8);
    const double energy = labelEnergy(problem, leastEnergyLabels(problem));
    const double least = leastEnergy(problem);
    EXPECT_LE(energy, 2.0 * least);  // the bound of Boykov, Veksler & Zabih
    exact += energy < least + 1e-9 ? 1 : 0;
  }
  EXPECT_GE(exact, 15);  // in practice nearly always the minimum itself
}

TEST(LabelMrf, RefusesEdgesOutOfRange) {
  LabelProblem problem = randomProblem(1, 4);
  problem.edges(1, 0) = 4;
  EXPECT_THROW(leastEnergyLabels(problem), std::invalid_argument);
}

/// A ball in three bands: skin, upper, lower from above; every 13th vertex was mistaken.
OuterSurface bands() {
  OuterSurface surface;
  surface.mesh = test::icosphere(0.2, 4);
  const auto count = static_cast<std::size_t>(surface.mesh.numVertices());
  surface.seen.assign(count, true);
  surface.colors.resize(3, surface.mesh.numVertices());
  const Eigen::AlignedBox3d box = boundingBox(surface.mesh);
  const double third = box.sizes().y() / 3.0;
  for (std::size_t v = 0; v < count; ++v) {
    const auto column = static_cast<Eigen::Index>(v);
    const auto band = static_cast<std::size_t>(std::clamp(
        2.0 - std::floor((surface.mesh.vertices(1, column) - box.min().y()) / third), 0.0, 2.0));
    surface.colors.col(column) = 0.8 * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(band));
    LabelCounts counts = {};
    counts[v % 13 == 0 ? (band + 1) % 3 : band] = 10;
    surface.labels.push_back(counts);
  }
  return surface;
}

TEST(SurfaceParsing, MendsSingleMistakes) {
  const OuterSurface surface = bands();
  const std::vector<std::uint8_t> labels = parsedSurface(surface);
  for (std::size_t v = 0; v < labels.size(); ++v) {
    const Eigen::Vector3d color = surface.colors.col(static_cast<Eigen::Index>(v));
    ASSERT_GT(color[labels[v] - 1], 0.5) << "vertex " << v;
  }
}

TEST(SurfaceParsing, CutsABandAsATube) {
  const OuterSurface surface = bands();
  const std::vector<std::uint8_t> labels = parsedSurface(surface);
  const int openings[] = {1, 2, 1};  // cap, tube, cap
  for (const SurfaceLabel label : {kSkinLabel, kUpperLabel, kLowerLabel}) {
    const TriangleMesh part = labelledPart(surface.mesh, labels, label);
    const Topology shape = topology(part.faces, part.numVertices());
    EXPECT_TRUE(shape.manifold());
    EXPECT_EQ(shape.components, 1);
    EXPECT_EQ(shape.genus, 0);
    EXPECT_EQ(shape.boundaryLoops, openings[label - 1]);
  }
}

/// Two halves that were seen often and, in a ring between them, tongues of both that were seen so
/// many times.
OuterSurface frayedHalves(std::uint16_t count) {
  OuterSurface surface;
  surface.mesh = test::icosphere(0.2, 4);
  surface.colors = Eigen::Matrix3Xd::Constant(3, surface.mesh.numVertices(), 0.5);
  constexpr double kRing = 0.03;  // [m] on either side of the middle
  constexpr std::uint16_t kOften = 200;
  for (const auto vertex : surface.mesh.vertices.colwise()) {
    const bool isRing = std::abs(vertex.y()) < kRing;
    const double side = isRing ? std::sin(15.0 * std::atan2(vertex.x(), vertex.z())) : vertex.y();
    LabelCounts counts = {};
    counts[side > 0.0 ? kUpperLabel - 1 : kSkinLabel - 1] = isRing ? count : kOften;
    surface.labels.push_back(counts);
  }
  return surface;
}

/// Edges between different labels.
int boundaryLength(const OuterSurface& surface) {
  const std::vector<std::uint8_t> labels = parsedSurface(surface);
  const Adjacency adjacency = buildAdjacency(surface.mesh.faces, surface.mesh.numVertices());
  int length = 0;
  for (const auto edge : adjacency.edges.colwise()) {
    const auto a = static_cast<std::size_t>(edge[0]);
    const auto b = static_cast<std::size_t>(edge[1]);
    length += labels[a] != labels[b] ? 1 : 0;
  }
  return length;
}

TEST(SurfaceParsing, SeldomSeenPlacesDontFrayABoundary) {
  const int shortest = boundaryLength(frayedHalves(0));
  EXPECT_EQ(boundaryLength(frayedHalves(4)), shortest);
  EXPECT_GT(boundaryLength(frayedHalves(200)), 1.5 * shortest) << "seen often, they are there";
}

TEST(SurfaceParsing, RefusesAnotherNumberOfLabels) {
  EXPECT_THROW(labelledPart(test::cube(), {kSkinLabel}, kSkinLabel), std::invalid_argument);
}

}  // namespace
}  // namespace avatar
