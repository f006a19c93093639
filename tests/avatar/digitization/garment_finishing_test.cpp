#include "avatar/digitization/garment_finishing.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/digitization/seen_extent.h"
#include "avatar/digitization/surface_parsing.h"
#include "avatar/garment_openings.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/mesh_cleanup.h"
#include "avatar/geometry/mesh_clip.h"
#include "avatar/geometry/mesh_intersection.h"
#include "tests/support/dressed_person.h"

#include <gtest/gtest.h>

#include <cmath>

namespace avatar {
namespace {

/// Of one surface to another, by area.
struct Agreement {
  double meanDistance = 0.0;  // [m]
  double nearArea = 0.0;      // within 2 cm, the edges of the meshes [m²]
};

Agreement agreement(const TriangleMesh& from, const TriangleMesh& to) {
  const TriangleBvh bvh(to);
  const Eigen::VectorXd areas = faceAreas(from);
  Agreement result;
  for (Eigen::Index f = 0; f < from.numFaces(); ++f) {
    const Eigen::Vector3d centre = from.vertices(Eigen::all, from.faces.col(f)).rowwise().mean();
    const double distance = std::sqrt(bvh.closestPoint(centre).squaredDistance);
    result.meanDistance += distance * areas[f] / areas.sum();
    result.nearArea += distance < 0.02 ? areas[f] : 0.0;
  }
  return result;
}

void expectAlike(const TriangleMesh& made, const TriangleMesh& truth) {
  const Agreement there = agreement(made, truth);
  const Agreement back = agreement(truth, made);
  EXPECT_LT(0.5 * (there.meanDistance + back.meanDistance), 0.010);
  const double common = 0.5 * (there.nearArea + back.nearArea);
  EXPECT_GT(common / (totalArea(made) + totalArea(truth) - common), 0.9);
}

void expectUsable(const Garment& garment, const DressingBody& body) {
  const Topology shape = topology(garment.mesh.faces, garment.mesh.numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented);
  EXPECT_EQ(shape.components, 1);
  double smallestAngle = 180.0;
  for (Eigen::Index f = 0; f < garment.mesh.numFaces(); ++f)
    smallestAngle =
        std::min(smallestAngle, faceAngles(garment.mesh, f).minCoeff() * 180.0 / std::numbers::pi);
  EXPECT_GT(smallestAngle, 10.0) << "no needles";
  const SignedDistance skin(body.mesh());
  constexpr double kFloat = 1e-6;  // what is left of the clearance after rounding [m]
  for (const auto vertex : garment.mesh.vertices.colwise())
    ASSERT_GT(skin(vertex).distance, garment.cloth.thickness - kFloat);
  EXPECT_TRUE(piercedFaces(garment.mesh, body.mesh()).empty());
  EXPECT_EQ(garment.vertexColors.cols(), garment.mesh.numVertices());
}

struct DressCase {
  std::vector<std::string> names;  // as of dressedPerson()
  std::vector<int> openings;       // of each
  double build;                    // second beta: heavier or slighter
};

class FinishedOutfit : public testing::TestWithParam<DressCase> {};

TEST_P(FinishedOutfit, IsWhatWasWorn) {
  const DressCase& worn = GetParam();
  const BodyModel& model = defaultBody();
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(model.numBetas());
  betas[1] = worn.build;
  const test::DressedPerson person = test::dressedPerson(model, betas, worn.names);
  const OuterSurface surface =
      withSeenExtent(completeOuterSurface(person.seen, person.body.mesh()), person.body);
  const Topology whole = topology(surface.mesh.faces, surface.mesh.numVertices());
  EXPECT_TRUE(whole.manifold() && whole.oriented && whole.closed);
  const FinishedGarments made = finishGarments(surface, parsedSurface(surface), person.body);
  ASSERT_EQ(made.garments.size(), worn.names.size());
  for (std::size_t i = 0; i < worn.names.size(); ++i) {
    SCOPED_TRACE(worn.names[i]);
    const Garment& garment = made.garments[i];
    EXPECT_EQ(garment.name, person.labels[i] == kUpperLabel ? "upper" : "lower");
    EXPECT_EQ(garment.layer, static_cast<int>(i));
    EXPECT_EQ(garment.collideWith.size(), i + 1);
    expectUsable(garment, person.body);
    expectAlike(garment.mesh, person.garments[i].mesh);
    const Topology shape = topology(garment.mesh.faces, garment.mesh.numVertices());
    EXPECT_EQ(shape.boundaryLoops, worn.openings[i]);
    // Nothing of the skin beside it, hems and collars included; but means may take in what lies
    // near across a gap.
    const Eigen::Matrix3Xd stains = garment.vertexColors.colwise() - person.garments[i].color;
    EXPECT_LT(stains.colwise().norm().maxCoeff(), 0.02);
    for (std::size_t inner = 0; inner < i; ++inner)
      EXPECT_TRUE(piercedFaces(garment.mesh, made.garments[inner].mesh).empty());
  }
}

INSTANTIATE_TEST_SUITE_P(
    Wardrobe,
    FinishedOutfit,
    testing::Values(
        DressCase{{"trousers", "tshirt"}, {3, 4}, 0.0},
        DressCase{{"trousers", "shirt"}, {3, 4}, 1.0},
        DressCase{{"skirt", "shirt"}, {2, 4}, -1.0},
        DressCase{{"dress"}, {4}, 0.0}));

/// The points above a height that differs from side to side, as where a turning person leaves the
/// picture.
FusedPoints seenAbove(const FusedPoints& all, double height) {
  constexpr double kWave = 0.02;  // [m]
  std::vector<Eigen::Index> kept;
  FusedPoints result;
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    const double side = std::atan2(all.points(0, i), all.points(2, i));
    if (all.points(1, i) < height + kWave * std::sin(5.0 * side))
      continue;
    kept.push_back(i);
    result.labels.push_back(all.labels[static_cast<std::size_t>(i)]);
  }
  result.points = all.points(Eigen::all, kept);
  result.normals = all.normals(Eigen::all, kept);
  result.colors = all.colors(Eigen::all, kept);
  return result;
}

TEST(FinishGarments, EndsAGarmentInARingWhereThePictureEnds) {
  const BodyModel& model = defaultBody();
  test::DressedPerson person =
      test::dressedPerson(model, Eigen::VectorXd::Zero(model.numBetas()), {"dress"});
  const double height = person.body.joints(1, kLeftHip) - 0.1;
  const OuterSurface surface = withSeenExtent(
      completeOuterSurface(seenAbove(person.seen, height), person.body.mesh()), person.body);
  const FinishedGarments made = finishGarments(surface, parsedSurface(surface), person.body);
  ASSERT_EQ(made.garments.size(), 1U);
  ASSERT_EQ(made.notes.size(), 1U);
  EXPECT_NE(made.notes.front().find("beyond what was seen"), std::string::npos);
  const TriangleMesh& mesh = made.garments.front().mesh;
  const std::vector<GarmentOpening> openings =
      garmentOpenings(mesh, person.body.joints, model.parents);
  ASSERT_EQ(openings.size(), 4U) << "neck, sleeves and hem";
  const auto hem =
      std::min_element(openings.begin(), openings.end(), [](const auto& a, const auto& b) {
        return a.meanHeight < b.meanHeight;
      });
  const Eigen::VectorXd heights = mesh.vertices(1, hem->loop);
  // Flat up to what remeshing and clearing move; not above what is seen on all sides by more than
  // what counts as frayed.
  EXPECT_LT(heights.maxCoeff() - heights.minCoeff(), 0.01);
  EXPECT_GT(heights.mean(), height - 0.02);
  EXPECT_LT(heights.mean(), height + 0.02 + SeenExtentOptions{}.frayed);
  // It goes on below, which holds it.
  std::vector<int> ring = hem->loop;
  std::sort(ring.begin(), ring.end());
  EXPECT_EQ(made.garments.front().pins, ring);
}

bool returnsTrue(const Eigen::Vector3d&) {
  return true;
}

/// The highest level, to a centimetre, below which the legs of trousers are two parts [m].
double legsApartBelow(const TriangleMesh& trousers, const DressingBody& body) {
  double level = body.crotchHeight;
  while (level > body.joints(1, kLeftKnee)) {
    const Eigen::VectorXd above = trousers.vertices.row(1).array() - level;
    if (connectedParts(clippedMesh(trousers, above)).size() >= 2)
      break;
    level -= 0.01;
  }
  return level;
}

TEST(CompleteWaist, JoinsLegsThatWereSeenUpToWhereThighsMeet) {
  const BodyModel& model = defaultBody();
  const DressingBody body = standForDressing(model, Eigen::VectorXd::Zero(model.numBetas()));
  const TriangleMesh trousers = makeGarment({.name = "trousers"}, body, {}).mesh;
  // Under a shirt that hides no more than what joins them.
  const double hem = legsApartBelow(trousers, body);
  const std::vector<TriangleMesh> legs =
      connectedParts(clippedMesh(trousers, trousers.vertices.row(1).array() - hem));
  ASSERT_GE(legs.size(), 2U);
  const CompletedWaist made = completeWaist(legs, body, returnsTrue);
  ASSERT_EQ(made.status, WaistStatus::kCompleted);
  const Topology shape = topology(made.parts.front().faces, made.parts.front().numVertices());
  EXPECT_TRUE(shape.manifold() && shape.oriented);
  EXPECT_EQ(shape.components, 1);
  EXPECT_EQ(shape.boundaryLoops, 3) << "waist and two hems";
}

/// Trousers under a shirt that is shorter behind: there alone the legs hang together, and their
/// edge passes the trunk's axis on that side, both ways.
std::vector<TriangleMesh> seenBelowSlantedHem(
    const TriangleMesh& trousers, const DressingBody& body) {
  constexpr double kShorter = 0.1;  // [m]
  constexpr double kSlope = 0.05;   // [m]
  const double hem = legsApartBelow(trousers, body);
  const Eigen::ArrayXd behind =
      (body.joints(2, kSpine1) - trousers.vertices.row(2).transpose().array()) / kSlope;
  return connectedParts(clippedMesh(
      trousers,
      trousers.vertices.row(1).transpose().array() - hem - kShorter * behind.max(0.0).min(1.0)));
}

TEST(CompleteWaist, GoesRoundTheHipsThoughTheLegsHangTogetherByTheSeatAlone) {
  const BodyModel& model = defaultBody();
  const DressingBody body = standForDressing(model, Eigen::VectorXd::Zero(model.numBetas()));
  TriangleMesh trousers = makeGarment({.name = "trousers"}, body, {}).mesh;
  // Round the axis the edge goes by 0, up to rounding that differs from place to place.
  for (int aside = 0; aside < 6; ++aside) {
    SCOPED_TRACE(aside);
    trousers.vertices.row(0).array() += 1e-3;
    const std::vector<TriangleMesh> seen = seenBelowSlantedHem(trousers, body);
    ASSERT_EQ(seen.size(), 1U);
    const CompletedWaist made = completeWaist(seen, body, returnsTrue);
    ASSERT_EQ(made.status, WaistStatus::kCompleted);
    const TriangleMesh& mesh = made.parts.front();
    const Topology shape = topology(mesh.faces, mesh.numVertices());
    EXPECT_TRUE(shape.manifold() && shape.oriented);
    EXPECT_EQ(shape.boundaryLoops, 3) << "waist and two hems";
    for (const auto& face : mesh.faces.colwise()) {
      const Eigen::Matrix3d corners = mesh.vertices(Eigen::all, face);
      const Eigen::Vector3d centre = corners.rowwise().mean();
      if (centre.y() < body.joints(1, kPelvis))
        continue;
      const Eigen::Vector3d normal =
          (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0));
      const Eigen::Vector3d outwards = centre - body.joints.col(kSpine1);
      ASSERT_GT(normal.x() * outwards.x() + normal.z() * outwards.z(), 0.0) << centre.transpose();
    }
  }
}

TEST(FinishGarments, RefusesLabelsOfAnotherSurface) {
  const DressingBody body =
      standForDressing(defaultBody(), Eigen::VectorXd::Zero(defaultBody().numBetas()));
  OuterSurface surface;
  surface.mesh = {body.vertices, body.model->faces};
  surface.colors = Eigen::Matrix3Xd::Zero(3, body.vertices.cols());
  EXPECT_THROW(finishGarments(surface, {1, 2, 3}, body), std::invalid_argument);
}

TEST(FinishGarments, ANakedBodyWearsNothing) {
  const DressingBody body =
      standForDressing(defaultBody(), Eigen::VectorXd::Zero(defaultBody().numBetas()));
  OuterSurface surface;
  surface.mesh = {body.vertices, body.model->faces};
  surface.colors = Eigen::Matrix3Xd::Zero(3, body.vertices.cols());
  const std::vector<std::uint8_t> labels(
      static_cast<std::size_t>(body.vertices.cols()), kSkinLabel);
  EXPECT_TRUE(finishGarments(surface, labels, body).garments.empty());
}

}  // namespace
}  // namespace avatar
