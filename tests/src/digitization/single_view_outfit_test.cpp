#include "src/digitization/single_view_outfit.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/geometry/rasterizer.h"
#include "avatar/wardrobe/dressing_body.h"
#include "avatar/wardrobe/wardrobe.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace simulcap {
namespace {

using avatar::GarmentOrder;

const Eigen::Vector3d kUpperColor(0.8, 0.2, 0.2);

bool isUpper(const std::string& name) {
  return name == "tshirt" || name == "shirt" || name == "dress";
}

const Eigen::VectorXd kMean = Eigen::VectorXd::Zero(10);

const avatar::DressingBody& body() {
  static const avatar::DressingBody kBody = avatar::standForDressing(avatar::defaultBody(), kMean);
  return kBody;
}

/// What a camera sees of somebody who stands before it in what the orders say, inner ones first.
avatar::PosedDepthFrame seen(const std::vector<GarmentOrder>& orders) {
  avatar::PosedDepthFrame frame;
  frame.pose = avatar::aPose();
  frame.camera = {.width = 240, .height = 300, .fx = 300, .fy = 300, .cx = 120, .cy = 150};
  frame.camera.cameraFromWorld = avatar::lookAt({0.0, 0.0, 2.2}, {0.0, -0.3, 0.0});
  avatar::Rasterizer rasterizer;
  rasterizer.begin(frame.camera);
  rasterizer.draw(body().mesh(), avatar::kSkinLabel);
  std::vector<avatar::Garment> worn;
  for (const GarmentOrder& order : orders) {
    worn.push_back(avatar::makeGarment(order, body(), worn));
    rasterizer.draw(
        worn.back().mesh, isUpper(order.name) ? avatar::kUpperLabel : avatar::kLowerLabel);
  }
  const avatar::RasterImage& image = rasterizer.image();
  frame.depth = image.depth;
  frame.normals = Eigen::Matrix3Xf::Zero(3, std::ssize(image.depth));
  frame.color = {frame.camera.width, frame.camera.height, {}};
  for (const int object : image.object) {
    frame.labels.push_back(static_cast<std::uint8_t>(std::max(object, 0)));
    for (int c = 0; c < 3; ++c)
      frame.color.rgb.push_back(
          object == avatar::kUpperLabel ? static_cast<std::uint8_t>(255.0 * kUpperColor[c]) : 90);
  }
  return frame;
}

SingleViewOutfit chosenFor(const avatar::PosedDepthFrame& frame, bool onePiece = false) {
  static const avatar::Skinning kSkinning(avatar::defaultBody());
  return singleViewOutfit(frame, kSkinning, kMean, {.onePiece = onePiece});
}

std::vector<std::string> namesOf(const SingleViewOutfit& outfit) {
  std::vector<std::string> names;
  for (const ChosenGarment& garment : outfit.garments)
    names.push_back(garment.order.name);
  return names;
}

GarmentOrder coarse(const char* name, std::optional<double> ease = std::nullopt) {
  return {.name = name, .ease = ease, .edgeLength = 0.05};
}

using Names = std::vector<std::string>;

TEST(SingleViewOutfit, KnowsGarmentsByWhatTheyCover) {
  const SingleViewOutfit summer = chosenFor(seen({coarse("shorts"), coarse("tshirt")}));
  EXPECT_EQ(namesOf(summer), (Names{"tshirt", "shorts"}));
  // 8 bits per channel.
  EXPECT_LT((summer.garments[0].color.value() - kUpperColor).norm(), 0.01);
  EXPECT_EQ(
      namesOf(chosenFor(seen({coarse("trousers"), coarse("shirt")}))),
      (Names{"shirt", "trousers"}));
  EXPECT_EQ(
      namesOf(chosenFor(seen({coarse("skirt"), coarse("tshirt")}))), (Names{"tshirt", "skirt"}));
  EXPECT_EQ(namesOf(chosenFor(seen({coarse("dress")}), true)), Names{"dress"});
}

TEST(SingleViewOutfit, IsAsWideAsWhatWasSeen) {
  avatar::PosedDepthFrame tight = seen({coarse("tshirt", 0.01)});
  const SingleViewOutfit inTight = chosenFor(tight);
  const SingleViewOutfit inWide = chosenFor(seen({coarse("tshirt", 0.06)}));
  ASSERT_EQ(namesOf(inTight), Names{"tshirt"});
  ASSERT_EQ(namesOf(inWide), Names{"tshirt"});
  // Cloth lies on the breast and stands off below, so the middle of what is seen is nearer than the
  // ease, which is the room all around.
  EXPECT_GT(inWide.garments[0].order.ease.value(), inTight.garments[0].order.ease.value() + 0.02);
  // Without labels the size is known, the kind a guess, which is said.
  tight.labels.clear();
  const SingleViewOutfit guess = chosenFor(tight);
  EXPECT_EQ(namesOf(guess), (Names{"tshirt", "trousers"}));
  EXPECT_TRUE(guess.guessed);
}

TEST(SingleViewOutfit, RefusesLabelsWithoutGarments) {
  avatar::PosedDepthFrame bare = seen({});
  EXPECT_THROW(chosenFor(bare), std::runtime_error);
}

}  // namespace
}  // namespace simulcap
