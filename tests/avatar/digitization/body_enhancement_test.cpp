#include "avatar/digitization/body_enhancement.h"

#include "avatar/avatar_body.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"

#include <gtest/gtest.h>

#include <cmath>

namespace avatar {
namespace {

const Eigen::Vector3d kSkinColor(0.8, 0.6, 0.5);
const Eigen::Vector3d kHairColor(0.2, 0.1, 0.1);

/// The default body with long hair at the back of its head, as a fused surface.
struct LongHaired {
  const BodyModel& model = defaultBody();
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(model.numBetas());
  Skinning skinning{model};
  SkinnedBody posed = skinning.pose(skinning.shape(betas), aPose());
  OuterSurface surface;
  std::vector<std::uint8_t> labels;

  explicit LongHaired(double thickness) {
    surface.mesh = {posed.vertices, model.faces};
    const Eigen::Matrix3Xd normals = vertexNormals(surface.mesh);
    const Eigen::Vector3d head = posed.joints.col(kHead);
    surface.colors = kSkinColor.replicate(1, posed.vertices.cols());
    for (Eigen::Index v = 0; v < posed.vertices.cols(); ++v) {
      const Eigen::Vector3d from = posed.vertices.col(v) - head;
      const double above = std::clamp(from.y() / 0.05, 0.0, 1.0);
      const double behind = std::clamp(-from.z() / 0.04, 0.0, 1.0);
      surface.mesh.vertices.col(v) += thickness * above * behind * normals.col(v);
      if (above * behind > 0.0)
        surface.colors.col(v) = kHairColor;
    }
    labels.assign(static_cast<std::size_t>(posed.vertices.cols()), kSkinLabel);
    surface.seen.assign(labels.size(), true);
    surface.labels.assign(labels.size(), LabelCounts{20, 0, 0});
  }

  BodyEnhancement enhanced(const EnhancementOptions& options = {}) const {
    return enhanceBody(surface, labels, {skinning, betas, aPose()}, options);
  }
};

TEST(BodyEnhancement, TheHeadTakesTheFusedShape) {
  const LongHaired person(0.02);
  const BodyEnhancement result = person.enhanced();
  EXPECT_GT(result.headSeen, 0.95);
  EXPECT_GT(result.distanceBefore, 0.002) << "hair of 20 mm on a part of the head";
  EXPECT_LT(result.distanceAfter, 0.001);
}

TEST(BodyEnhancement, IsSmoothAtTheNeckAndStopsThere) {
  const LongHaired person(0.02);
  const BodyEnhancement result = person.enhanced();
  const Eigen::VectorXd head = person.model.skinningWeights.col(kHead);
  for (Eigen::Index f = 0; f < person.model.numFaces(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = person.model.faces(k, f);
      const int b = person.model.faces((k + 1) % 3, f);
      if (head[a] == 0.0) {
        EXPECT_TRUE(result.offsets.col(a).isZero(0.0));
      }
      // The neck's part of it is no steeper than the edge of the hair, 20 mm within 50.
      const double length = (person.posed.vertices.col(a) - person.posed.vertices.col(b)).norm();
      if (head[a] < 0.3) {
        EXPECT_LT((result.offsets.col(a) - result.offsets.col(b)).norm(), 0.4 * length);
      }
    }
  }
}

TEST(BodyEnhancement, OffsetsBelongToTheRestShape) {
  const LongHaired person(0.02);
  AvatarBody body = makeAvatarBody(person.model, person.betas);
  const Eigen::Matrix3Xd before = body.mesh.vertices;
  const BodyEnhancement result = person.enhanced();
  applyEnhancement(result, body);
  // The head isn't turned between rest and A-pose: offsets are those of the hair, backwards.
  const Eigen::Matrix3Xd moved = body.mesh.vertices - before;
  Eigen::Index farthest = 0;
  EXPECT_NEAR(moved.colwise().norm().maxCoeff(&farthest), 0.02, 0.004);
  EXPECT_LT(moved(2, farthest), 0.0);
  EXPECT_LT((body.color - kSkinColor).norm(), 0.02);
}

TEST(BodyEnhancement, NoVertexGoesFurtherThanAllowed) {
  const LongHaired person(0.03);
  EnhancementOptions options;
  options.maxOffset = 0.01;
  EXPECT_LE(person.enhanced(options).offsets.colwise().norm().maxCoeff(), 0.01 * 1.001);
}

TEST(BodyEnhancement, SkinUnderClothesHasTheColourOfTheSkinAround) {
  LongHaired person(0.02);
  const double waist = person.posed.joints(1, kSpine1);
  const double chest = person.posed.joints(1, kSpine3);
  for (Eigen::Index v = 0; v < person.posed.vertices.cols(); ++v) {
    const double y = person.posed.vertices(1, v);
    if (y < waist || y > chest)
      continue;
    person.labels[static_cast<std::size_t>(v)] = kUpperLabel;
    person.surface.colors.col(v) = Eigen::Vector3d(0.0, 1.0, 0.0);
  }
  // Beside cloth, colours are mixed.
  const Adjacency adjacency = buildAdjacency(person.model.faces, person.model.numVertices());
  for (Eigen::Index e = 0; e < adjacency.numEdges(); ++e) {
    const Eigen::Vector2i edge = adjacency.edges.col(e);
    const Eigen::Vector3d along =
        person.surface.mesh.vertices.col(edge[0]) - person.surface.mesh.vertices.col(edge[1]);
    for (int end = 0; end < 2; ++end) {
      const int other = edge[1 - end];
      if (person.labels[static_cast<std::size_t>(edge[end])] == kUpperLabel &&
          along.norm() < 0.03 && person.labels[static_cast<std::size_t>(other)] == kSkinLabel)
        person.surface.colors.col(other) << 0.4, 0.8, 0.25;
    }
  }
  const BodyEnhancement result = person.enhanced();
  for (Eigen::Index v = 0; v < result.vertexColors.cols(); ++v) {
    if (person.model.skinningWeights.coeff(static_cast<int>(v), kHead) == 0.0) {
      EXPECT_LT((result.vertexColors.col(v) - kSkinColor).norm(), 0.05);
    }
  }
  EXPECT_LT((result.skinColor - kSkinColor).norm(), 0.02);
}

TEST(BodyEnhancement, WithoutAHeadInSightNothingMoves) {
  LongHaired person(0.02);
  person.surface.seen.assign(person.labels.size(), false);
  const BodyEnhancement result = person.enhanced();
  EXPECT_TRUE(result.offsets.isZero(1e-12));
  EXPECT_EQ(result.headSeen, 0.0);
}

}  // namespace
}  // namespace avatar
