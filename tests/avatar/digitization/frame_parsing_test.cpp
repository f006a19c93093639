#include "avatar/digitization/frame_parsing.h"

#include "avatar/digitization/body_parts.h"
#include "avatar/digitization/color_model.h"
#include "tests/avatar/digitization/rendered_frame.h"
#include "tests/support/capsule_figure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <string>

namespace avatar {
namespace {

/// Colours about a centre, the light changing by a fifth.
std::vector<Rgb> colorsAbout(const Eigen::Vector3d& centre, std::uint64_t seed) {
  test::Noise noise(seed);
  std::vector<Rgb> colors;
  for (int i = 0; i < 500; ++i) {
    const double light = 1.0 + 0.2 * noise.next();
    Rgb color = {};
    for (std::size_t c = 0; c < 3; ++c)
      color[c] = static_cast<std::uint8_t>(std::clamp(
          255.0 * light * centre[static_cast<Eigen::Index>(c)] + 4.0 * noise.next(), 0.0, 255.0));
    colors.push_back(color);
  }
  return colors;
}

TEST(ColorModel, TellsColoursApartAndSameOnesNot) {
  const std::vector<Rgb> red = colorsAbout({0.7, 0.2, 0.2}, 1);
  const std::vector<Rgb> alsoRed = colorsAbout({0.7, 0.2, 0.2}, 2);
  const std::vector<Rgb> blue = colorsAbout({0.2, 0.3, 0.7}, 3);
  const ColorModel ofRed(red), ofAlsoRed(alsoRed), ofBlue(blue);
  EXPECT_GT(separability(red, ofRed, blue, ofBlue), 0.99);
  // Two samples of 500: a share of a half has a standard deviation of 0.02, and each model knows
  // its own sample a little better.
  EXPECT_LT(separability(red, ofRed, alsoRed, ofAlsoRed), 0.65);
  EXPECT_THROW(ColorModel({}), std::invalid_argument);
}

TEST(ColorModel, IsTheSameEveryTimeAndItsTableAgreesWithIt) {
  const std::vector<Rgb> colors = colorsAbout({0.3, 0.6, 0.4}, 4);
  const ColorModel model(colors), again(colors);
  EXPECT_EQ(model.logLikelihoods(colors), again.logLikelihoods(colors));
  const ColorTable table({model});
  const Rgb cellCentre = {76, 156, 100};  // 8 i + 4
  EXPECT_EQ(table(0, cellCentre.data()), model.logLikelihoods({cellCentre}).front());
}

const Eigen::Vector3d kSkinColor(0.85, 0.65, 0.55);
const Eigen::Vector3d kShirtColor(0.70, 0.20, 0.25);
const Eigen::Vector3d kTrousersColor(0.20, 0.25, 0.50);

bool isUpper(int joint) {
  return joint == kSpine1 || joint == kSpine2 || joint == kSpine3 || joint == kLeftCollar ||
         joint == kRightCollar || joint == kLeftShoulder || joint == kRightShoulder;
}

bool isLower(int joint) {
  return joint == kPelvis || joint == kLeftHip || joint == kRightHip || joint == kLeftKnee ||
         joint == kRightKnee;
}

class FrameParsingTest : public testing::Test {
 protected:
  int jointOf(Eigen::Index face) const {
    int joint = 0;
    Eigen::VectorXd(model_.skinningWeights.row(model_.faces(0, face))).maxCoeff(&joint);
    return joint;
  }

  SurfaceLabel labelOf(Eigen::Index face, double hem) const {
    const int joint = jointOf(face);
    const int vertex = model_.faces(0, face);
    const bool underShirt = isLower(joint) && shaped_.vertices(1, vertex) > hem;
    return isUpper(joint) || underShirt ? kUpperLabel : isLower(joint) ? kLowerLabel : kSkinLabel;
  }

  Eigen::Matrix3Xi facesWhere(const auto& holds) const {
    std::vector<Eigen::Index> chosen;
    for (Eigen::Index f = 0; f < model_.numFaces(); ++f) {
      if (holds(f))
        chosen.push_back(f);
    }
    return model_.faces(Eigen::all, chosen);
  }

  Eigen::Matrix3Xi facesWith(SurfaceLabel label, double hem) const {
    return facesWhere([&](Eigen::Index face) { return labelOf(face, hem) == label; });
  }

  /// A turn of somebody in T-shirt and trousers of these colours. `hem`: height down to which the
  /// shirt hangs over the trousers, in the rest pose [m].
  std::vector<PosedDepthFrame> turn(
      const Eigen::Vector3d& upperColor,
      const Eigen::Vector3d& lowerColor,
      double hem = std::numeric_limits<double>::infinity()) const {
    return turn(
        {{facesWith(kSkinLabel, hem), kSkinLabel, kSkinColor},
         {facesWith(kUpperLabel, hem), kUpperLabel, upperColor},
         {facesWith(kLowerLabel, hem), kLowerLabel, lowerColor}});
  }

  struct Part {
    Eigen::Matrix3Xi faces;
    SurfaceLabel label;
    Eigen::Vector3d color;
  };

  std::vector<PosedDepthFrame> turn(const std::vector<Part>& parts) const {
    std::vector<PosedDepthFrame> frames;
    for (int view = 0; view < 4; ++view) {
      const BodyPose pose = test::turned(aPose(), 0.5 * std::numbers::pi * view);
      const Eigen::Matrix3Xd vertices = skinning_.pose(shaped_, pose).vertices;
      std::vector<test::PaintedMesh> painted;
      for (const Part& part : parts)
        painted.push_back({{vertices, part.faces}, part.label, part.color});
      frames.push_back(test::renderedFrame(painted, test::frontCamera(2.2), pose));
    }
    return frames;
  }

  static std::vector<PosedDepthFrame> unlabelled(std::vector<PosedDepthFrame> frames) {
    for (PosedDepthFrame& frame : frames)
      frame.labels.clear();
    return frames;
  }

  FrameParsing parsed(
      const std::vector<PosedDepthFrame>& frames, const FrameParsingOptions& options = {}) const {
    return parsedFrames(frames, skinning_, Eigen::VectorXd::Zero(3), options);
  }

  BodyModel model_ = test::capsuleFigure();
  Skinning skinning_{model_};
  ShapedBody shaped_ = skinning_.shape(Eigen::VectorXd::Zero(3));
};

double share(const std::vector<std::uint8_t>& ours, const std::vector<std::uint8_t>& truth) {
  double right = 0.0, all = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    all += truth[i] != kNoLabel ? 1.0 : 0.0;
    right += truth[i] != kNoLabel && ours[i] == truth[i] ? 1.0 : 0.0;
  }
  return right / all;
}

TEST_F(FrameParsingTest, LearnsTheColoursFromTheTrackedBody) {
  const std::vector<PosedDepthFrame> frames = turn(kShirtColor, kTrousersColor);
  const FrameParsing parsing = parsed(unlabelled(frames));
  EXPECT_FALSE(parsing.onePiece);
  EXPECT_TRUE(parsing.warnings.empty());
  ASSERT_EQ(parsing.labels.size(), frames.size());
  // Of a person 200 pixels high, averaging over 5 × 5 pixels costs up to two at each border.
  for (std::size_t f = 0; f < frames.size(); ++f)
    EXPECT_GT(share(parsing.labels[f], frames[f].labels), 0.95);
}

TEST_F(FrameParsingTest, KnowsALongShirtOnTheThighs) {
  const double hip = shaped_.joints(1, kLeftHip);
  const double knee = shaped_.joints(1, kLeftKnee);
  const std::vector<PosedDepthFrame> frames =
      turn(kShirtColor, kTrousersColor, hip + 0.15 * (knee - hip));
  const FrameParsing parsing = parsed(unlabelled(frames));
  EXPECT_FALSE(parsing.onePiece);
  for (std::size_t f = 0; f < frames.size(); ++f)
    EXPECT_GT(share(parsing.labels[f], frames[f].labels), 0.95);
}

TEST_F(FrameParsingTest, MakesNoLowerGarmentOfAShirtThatLeavesThePicture) {
  const double knee = shaped_.joints(1, kLeftKnee);
  std::vector<PosedDepthFrame> frames = turn(kShirtColor, kTrousersColor, knee);
  // Nothing is seen of what is lower than the upper half of the thighs: in the capture's pose, arms
  // and legs apart, a little higher than at rest.
  const double end = shaped_.joints(1, kLeftHip) + 0.4 * (knee - shaped_.joints(1, kLeftHip));
  for (PosedDepthFrame& frame : frames) {
    const Camera& camera = frame.camera;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const std::size_t i = frame.index(x, y);
        const double depth = static_cast<double>(frame.depth[i]);
        if (unproject(camera, {double(x), double(y), depth}).y() < end)
          frame.depth[i] = 0.0F;
      }
    }
  }
  const FrameParsing parsing = parsed(unlabelled(frames));
  ASSERT_EQ(parsing.warnings.size(), 1U);
  EXPECT_NE(parsing.warnings.front().find("nothing is seen"), std::string::npos);
  for (const std::vector<std::uint8_t>& labels : parsing.labels)
    EXPECT_EQ(std::count(labels.begin(), labels.end(), kLowerLabel), 0);
}

TEST_F(FrameParsingTest, TakesShoesOfTheTrousersColourForTheFeet) {
  const auto isFoot = [](int joint) {
    return joint == kLeftAnkle || joint == kRightAnkle || joint == kLeftFoot || joint == kRightFoot;
  };
  const auto isShorts = [](int joint) {
    return joint == kPelvis || joint == kLeftHip || joint == kRightHip;
  };
  const auto facesOf = [&](const auto& holds) {
    return facesWhere([&](Eigen::Index face) { return holds(jointOf(face)); });
  };
  const std::vector<PosedDepthFrame> frames = turn(
      {{facesOf([&](int joint) { return !isUpper(joint) && !isShorts(joint) && !isFoot(joint); }),
        kSkinLabel,
        kSkinColor},
       {facesOf(isFoot), kSkinLabel, kTrousersColor},
       {facesOf(isUpper), kUpperLabel, kShirtColor},
       {facesOf(isShorts), kLowerLabel, kTrousersColor}});
  // Before rounds of learning, which make the feet's colour skin's: only the patch tells.
  const FrameParsing parsing = parsed(unlabelled(frames), {.rounds = 0});
  EXPECT_TRUE(parsing.warnings.empty());
  for (std::size_t f = 0; f < frames.size(); ++f) {
    long taken = 0;  // for shorts, though it is skin
    for (std::size_t i = 0; i < frames[f].labels.size(); ++i)
      taken += parsing.labels[f][i] == kLowerLabel && frames[f].labels[i] == kSkinLabel ? 1 : 0;
    const auto shorts =
        std::count(frames[f].labels.begin(), frames[f].labels.end(), std::uint8_t{kLowerLabel});
    EXPECT_LT(taken, shorts / 10);  // two rows at the hems
  }
}

TEST_F(FrameParsingTest, TellsShoesFromTrousersOfTheirColourThatReachThem) {
  const auto isShod = [&](Eigen::Index face) {
    const int joint = jointOf(face);
    return joint == kLeftAnkle || joint == kRightAnkle || joint == kLeftFoot || joint == kRightFoot;
  };
  constexpr double kNoHem = std::numeric_limits<double>::infinity();
  const auto isBare = [&](Eigen::Index face) {
    return labelOf(face, kNoHem) == kSkinLabel && !isShod(face);
  };
  const std::vector<PosedDepthFrame> frames = turn(
      {{facesWhere(isBare), kSkinLabel, kSkinColor},
       {facesWhere(isShod), kSkinLabel, kTrousersColor},
       {facesWith(kUpperLabel, kNoHem), kUpperLabel, kShirtColor},
       {facesWith(kLowerLabel, kNoHem), kLowerLabel, kTrousersColor}});
  const FrameParsing parsing = parsed(unlabelled(frames));
  for (std::size_t f = 0; f < frames.size(); ++f)
    EXPECT_GT(share(parsing.labels[f], frames[f].labels), 0.95);
}

TEST_F(FrameParsingTest, TakesShadesOfALongShirtForNoTrousers) {
  const double hip = shaped_.joints(1, kLeftHip);
  const double hem = hip + 0.45 * (shaped_.joints(1, kLeftKnee) - hip);
  const auto isShaded = [&](Eigen::Index face) {  // where it hangs over the thighs
    return shaped_.vertices(1, model_.faces(0, face)) < hip;
  };
  const auto isShirt = [&](Eigen::Index face) { return labelOf(face, hem) == kUpperLabel; };
  const auto shirt = [&](bool shaded) {
    return facesWhere([&](Eigen::Index f) { return isShirt(f) && isShaded(f) == shaded; });
  };
  const std::vector<PosedDepthFrame> frames = turn(
      {{facesWith(kSkinLabel, hem), kSkinLabel, kSkinColor},
       {shirt(false), kUpperLabel, kShirtColor},
       {shirt(true), kUpperLabel, 0.6 * kShirtColor},
       {facesWith(kLowerLabel, hem), kLowerLabel, kTrousersColor}});
  const FrameParsing parsing = parsed(unlabelled(frames));
  for (std::size_t f = 0; f < frames.size(); ++f)
    EXPECT_GT(share(parsing.labels[f], frames[f].labels), 0.95);
}

TEST_F(FrameParsingTest, LearnsTheColoursFromOneLabelledFrame) {
  const std::vector<PosedDepthFrame> frames = turn(kShirtColor, kTrousersColor);
  std::vector<PosedDepthFrame> partly = unlabelled(frames);
  partly[0].labels = frames[0].labels;
  const FrameParsing parsing = parsed(partly);
  EXPECT_EQ(parsing.labels[0], frames[0].labels);
  for (std::size_t f = 1; f < frames.size(); ++f)
    EXPECT_GT(share(parsing.labels[f], frames[f].labels), 0.95);
}

TEST_F(FrameParsingTest, KeepsGivenLabels) {
  const std::vector<PosedDepthFrame> frames = turn(kShirtColor, kShirtColor);
  EXPECT_EQ(parsed(frames).labels[2], frames[2].labels);
  const FrameParsing one = parsed(frames, {.onePiece = true});
  EXPECT_EQ(std::count(one.labels[2].begin(), one.labels[2].end(), kLowerLabel), 0);
}

TEST_F(FrameParsingTest, AsksForLabelsWhereColoursDontTellGarmentsApart) {
  const std::vector<PosedDepthFrame> frames = unlabelled(turn(kShirtColor, kShirtColor));
  try {
    parsed(frames);
    FAIL() << "a split that nothing supports";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("labels/000000.png"), std::string::npos);
  }
  const FrameParsing overall = parsed(frames, {.onePiece = true});
  EXPECT_TRUE(overall.onePiece);
  for (const auto& labels : overall.labels)
    EXPECT_EQ(std::count(labels.begin(), labels.end(), kLowerLabel), 0);
}

TEST_F(FrameParsingTest, SaysWhenACoveredPartLooksBare) {
  const FrameParsing parsing = parsed(unlabelled(turn(kSkinColor, kTrousersColor)));
  ASSERT_EQ(parsing.warnings.size(), 1U);
  EXPECT_NE(parsing.warnings[0].find("upper garment"), std::string::npos);
  for (const auto& labels : parsing.labels)
    EXPECT_EQ(std::count(labels.begin(), labels.end(), kUpperLabel), 0);
}

TEST_F(FrameParsingTest, NeedsColoursOrLabels) {
  std::vector<PosedDepthFrame> frames = unlabelled(turn(kShirtColor, kTrousersColor));
  frames[1].color = {};
  EXPECT_THROW(parsed(frames), std::runtime_error);
}

}  // namespace
}  // namespace avatar
