#include "bullet_ext/core/energy_balance.h"
#include "src/output/heat_map.h"
#include "src/stability/extreme_cases.h"
#include "src/stability/stability_grid.h"
#include "src/stability/stability_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace simulcap {
namespace {

constexpr GridCloth kMiddle = {
    .stretch = 800, .torsion = 0.01, .vertexMass = 0.001, .edgeLength = 0.02};

TEST(StabilityGrid, CrossesEveryValueWithEveryOther) {
  StabilityGrid grid = StabilityGrid::quick();
  grid.vertexMass = {0.001, 0.002, 0.003};
  EXPECT_EQ(grid.cloths().size(), 3 * grid.torsion.size() * grid.stretch.size());
  grid.torsion.clear();
  EXPECT_THROW(grid.validate(), std::invalid_argument);
}

TEST(ShakenState, MovesEveryFreeVertexAndNoPin) {
  const bullet_ext::ClothMesh mesh = gridSheet(kMiddle, 8);
  const bullet_ext::ClothState rest = bullet_ext::restState(mesh);
  const bullet_ext::ClothState shaken = shakenState(mesh, 1e-3);
  EXPECT_GT(bullet_ext::elasticEnergy(mesh, shaken), 0.0);
  for (Eigen::Index i = 0; i < mesh.numVertices(); ++i)
    EXPECT_EQ((shaken.positions.col(i) - rest.positions.col(i)).norm() == 0.0F, mesh.isPinned(i));
}

/// 2/√λ is exact for small motion; the bisection ends within 0.5 % of it.
TEST(ObservedLimit, IsThePredictedOneAndScalesWithTheRootOfTheMass) {
  const GridFinding finding = observe(kMiddle, 0.05, 0.05);
  EXPECT_NEAR(finding.shaken.substep / finding.predicted, 1.0, 0.01);
  EXPECT_TRUE(finding.acceptedHeld());
  GridCloth heavy = kMiddle;
  heavy.vertexMass *= 4.0;
  EXPECT_NEAR(observe(heavy, 0.05, 0.05).shaken.substep / finding.shaken.substep, 2.0, 0.02);
}

TEST(GridFinding, KnowsWhatBlewUpThatPreflightAccepts) {
  GridFinding finding{.cloth = kMiddle, .predicted = 1e-3};
  finding.shaken = {.substep = 9.9e-4, .trials = {{9.9e-4, true, 1.0}, {1.01e-3, false, 1.0}}};
  finding.hanging = finding.shaken;
  EXPECT_TRUE(finding.acceptedHeld());
  EXPECT_NEAR(finding.error(), 0.01, 1e-12);
  finding.hanging = {.substep = 5e-4, .trials = {{8e-4, false, 1.0}, {5e-4, true, 0.9}}};
  EXPECT_FALSE(finding.acceptedHeld());
  EXPECT_NEAR(finding.error(), 0.5, 1e-12);
  finding.hanging.trials.push_back({5e-4, true, 0.3});
  EXPECT_TRUE(finding.collapsed());
  EXPECT_NEAR(finding.error(), 0.01, 1e-12) << "the prediction is about the rest shape";
}

TEST(GridFinding, CountsAFrameGivenUpAsBlownUp) {
  GridFinding finding{.cloth = kMiddle, .predicted = 1e-3};
  finding.drop = GuardedDrop{.substeps = 40, .redone = 2, .givenUp = 0};
  EXPECT_TRUE(finding.acceptedHeld());
  finding.drop->givenUp = 1;
  EXPECT_FALSE(finding.acceptedHeld());
}

TEST(ExtremeCases, HaveNamesOfTheirOwn) {
  std::vector<std::string> names;
  for (const ExtremeCase& extreme : extremeCases())
    names.push_back(extreme.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  EXPECT_GT(names.size(), 15U);
}

TEST(ExtremeResult, FailsWhatEndsOtherwiseThanItMust) {
  StabilityReport report;
  ExtremeResult result{.name = "x", .what = "y", .expected = Verdict::kRefused, .outcome = {}};
  result.outcome.verdict = Verdict::kStable;
  report.extremes = {result};
  ASSERT_EQ(failures(report).size(), 1U);
  EXPECT_NE(failures(report)[0].find("x: stable instead of refused"), std::string::npos);
  report.extremes[0].outcome.verdict = Verdict::kRefused;
  EXPECT_TRUE(failures(report).empty());
}

HeatMap sampleMap() {
  HeatMap map;
  map.rowLabels = {"r1", "r2"};
  map.columnLabels = {"c1", "c2"};
  map.panels = {
      {.title = "one", .cells = {{1.0, {"a"}}, {10.0, {"b"}}, {100.0, {"c", "d"}}, {0.0, {}}}}};
  return map;
}

TEST(HeatMap, WritesItsLabelsAndCells) {
  const std::string text = svg(drawn(sampleMap()));
  for (const char* words : {">r2<", ">c1<", ">a<", ">d<", ">one<"})
    EXPECT_NE(text.find(words), std::string::npos) << words;
}

/// Between 1 and 10, and 1 and 100: cells on either side of 5, and none of them beyond 500.
TEST(HeatMap, PartsCellsOnEitherSideOfItsContour) {
  HeatMap map = sampleMap();
  map.panels[0].cells[3].value = 20.0;
  const std::size_t without = drawn(map).items.size();
  map.contour = 5.0;
  EXPECT_EQ(drawn(map).items.size(), without + 2);
  map.contour = 500.0;
  EXPECT_EQ(drawn(map).items.size(), without);
}

TEST(HeatMap, RefusesPanelsOfAnotherSize) {
  HeatMap map = sampleMap();
  map.panels[0].cells.pop_back();
  EXPECT_THROW(drawn(map), std::invalid_argument);
}

}  // namespace
}  // namespace simulcap
