#include "src/digitization/human_parser.h"

#include "avatar/digitization/frame_parsing.h"
#include "avatar/io/file_error.h"
#include "src/digitization/turn_labels.h"
#include "tests/avatar/digitization/rendered_frame.h"
#include "tests/support/capsule_figure.h"
#include "tests/support/color_network.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include <algorithm>
#include <array>
#include <filesystem>

namespace simulcap {
namespace {

constexpr int kLipClasses = 20;
constexpr int kLipSize = 384;
const Eigen::Vector3d kLipMean(104.00698793, 116.66876762, 122.67891434);  // B, G, R

/// Colour of a class in the pictures, R, G, B in 0 … 255: 60 apart from each other.
Eigen::Vector3d colorOf(int c) {
  return {30.0 + 60.0 * (c % 4), 30.0 + 60.0 * (c / 4 % 4), 30.0 + 60.0 * (c / 16)};
}

/// As a network without a description gets them.
std::vector<Eigen::Vector3d> lipInputColors(int count = kLipClasses) {
  std::vector<Eigen::Vector3d> colors;
  for (int c = 0; c < count; ++c)
    colors.push_back(colorOf(c).reverse() - kLipMean);
  return colors;
}

/// Square tiles of 16 pixels, one per class, in rows of five.
avatar::ColorImage tiles() {
  avatar::ColorImage picture{.width = 80, .height = 64};
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      for (const double channel : colorOf(y / 16 * 5 + x / 16))
        picture.rgb.push_back(static_cast<std::uint8_t>(channel));
    }
  }
  return picture;
}

constexpr ParsingClass O = kNoClass, S = kSkinClass, U = kUpperClass, L = kLowerClass,
                       D = kOnePieceClass;

/// Inside the tiles; at their edges colours are mixed.
void expectTiles(
    const std::vector<ParsingClass>& seen, const std::array<ParsingClass, kLipClasses>& expected) {
  ASSERT_EQ(seen.size(), 80U * 64U);
  for (std::size_t c = 0; c < expected.size(); ++c) {
    for (const std::size_t y : {c / 5 * 16 + 3, c / 5 * 16 + 12}) {
      for (const std::size_t x : {c % 5 * 16 + 3, c % 5 * 16 + 12})
        EXPECT_EQ(seen[y * 80 + x], expected[c]) << "class " << c;
    }
  }
}

class HumanParserTest : public testing::Test {
 protected:
  std::string model(const std::string& bytes, const std::string& description = "") const {
    if (!description.empty())
      test::writeBytes(folder_.path("net.json"), description);
    test::writeBytes(folder_.path("net.onnx"), bytes);
    return folder_.path("net.onnx");
  }

  avatar::test::TemporaryFolder folder_;
};

TEST_F(HumanParserTest, TakesEachOfLipsClassesForWhatItIs) {
  HumanParser parser(model(test::nearestColorNetwork(lipInputColors(), kLipSize)));
  expectTiles(parser(tiles()), {O, S, S, S, S, U, D, U, S, L, D, U, L, S, S, S, S, S, S, S});
}

TEST_F(HumanParserTest, FollowsTheDescriptionBesideTheNetwork) {
  // Colours in −1 … 1, R before B, a wide input that the picture is centred in, fewer classes.
  std::vector<Eigen::Vector3d> colors;
  for (const int c : {0, 5, 9, 14})
    colors.push_back((colorOf(c).array() - 127.5) / 127.5);
  HumanParser parser(model(
      test::nearestColorNetwork(colors, 128),
      R"({"width": 128, "height": 128, "mean": [127.5, 127.5, 127.5], "order": "rgb",
          "scale": [0.00784314, 0.00784314, 0.00784314], "fit": "pad",
          "classes": ["background", "one-piece", "lower", "skin"]})"));
  const std::vector<ParsingClass> seen = parser(tiles());
  const auto tile = [&](int c) {
    return seen[static_cast<std::size_t>((c / 5 * 16 + 8) * 80 + c % 5 * 16 + 8)];
  };
  EXPECT_EQ(tile(0), kNoClass);
  EXPECT_EQ(tile(5), kOnePieceClass);
  EXPECT_EQ(tile(9), kLowerClass);
  EXPECT_EQ(tile(14), kSkinClass);
}

struct Misfit {
  const char* file;
  std::string bytes, description;
  const char* culprit;  ///< in the message
};

class UnfitNetwork : public testing::TestWithParam<Misfit> {};

TEST_P(UnfitNetwork, IsOneClearError) {
  const avatar::test::TemporaryFolder folder;
  if (!GetParam().bytes.empty())
    test::writeBytes(folder.path(GetParam().file), GetParam().bytes);
  if (!GetParam().description.empty())
    test::writeBytes(folder.path("net.json"), GetParam().description);
  try {
    HumanParser parser(folder.path(GetParam().file));
    FAIL() << "was taken";
  } catch (const avatar::FileError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find(GetParam().culprit), std::string::npos) << text;
    EXPECT_NE(text.find("net."), std::string::npos) << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 0) << text;
  }
}

const std::string kGood = test::nearestColorNetwork(lipInputColors(), kLipSize);

INSTANTIATE_TEST_SUITE_P(
    HumanParser,
    UnfitNetwork,
    testing::Values(
        Misfit{"net.onnx", "", "", "no such file"},
        Misfit{"net.onnx", "not a network", "", "OpenCV"},
        Misfit{"net.onnx", kGood.substr(0, kGood.size() / 2), "", "OpenCV"},
        Misfit{"net.png", kGood, "", ".caffemodel"},
        Misfit{"net.caffemodel", kGood, "", "net.prototxt"},
        Misfit{
            "net.onnx",
            test::nearestColorNetwork(lipInputColors(19), kLipSize),
            "",
            "1 x 19 x 384 x 384"},
        Misfit{"net.onnx", kGood, R"({"classes": ["background", "sofa"]})", "sofa"},
        Misfit{"net.onnx", kGood, R"({"width": 4})", "width"},
        Misfit{"net.onnx", kGood, R"({"mean": [1, 2]})", "mean"},
        Misfit{"net.onnx", kGood, R"({"order": "gbr"})", "order"},
        Misfit{"net.onnx", kGood, R"({"swap": true})", "swap"},
        Misfit{"net.onnx", kGood, "[]", "JSON"}));

/// Somebody who turns before the camera in a T-shirt and trousers; the arms are bare.
class ParsedTurn : public HumanParserTest {
 protected:
  ParsedTurn() {
    const avatar::Skinning skinning(figure_);
    const avatar::ShapedBody shaped = skinning.shape(Eigen::VectorXd::Zero(3));
    for (int view = 0; view < 4; ++view) {
      const avatar::BodyPose pose = avatar::test::turned(avatar::aPose(), 1.5708 * view);
      const Eigen::Matrix3Xd vertices = skinning.pose(shaped, pose).vertices;
      const Eigen::Matrix3Xi skin = facesOf(kSkinClass);
      const Eigen::Matrix3Xi upper = facesOf(kUpperClass);
      const Eigen::Matrix3Xi lower = facesOf(kLowerClass);
      const std::array<avatar::test::PaintedMesh, 3> painted = {{
          {{vertices, skin}, avatar::kSkinLabel, colorOf(13) / 255.0},
          {{vertices, upper}, avatar::kUpperLabel, colorOf(upperClass_) / 255.0},
          {{vertices, lower}, avatar::kLowerLabel, colorOf(9) / 255.0},
      }};
      turn_.frames.push_back(
          avatar::test::renderedFrame(painted, avatar::test::frontCamera(2.2), pose));
      turn_.numbers.push_back(3 * view);
    }
    turn_.camera = turn_.frames.front().camera;
    labelled_ = turn_;
    for (avatar::PosedDepthFrame& frame : turn_.frames)
      frame.labels.clear();
  }

  Eigen::Matrix3Xi facesOf(ParsingClass what) const {
    std::vector<Eigen::Index> chosen;
    for (Eigen::Index f = 0; f < figure_.numFaces(); ++f) {
      int joint = 0;
      Eigen::VectorXd(figure_.skinningWeights.row(figure_.faces(0, f))).maxCoeff(&joint);
      const bool leg = joint == avatar::kPelvis || joint == avatar::kLeftHip ||
                       joint == avatar::kRightHip || joint == avatar::kLeftKnee ||
                       joint == avatar::kRightKnee;
      const bool chest = joint == avatar::kSpine1 || joint == avatar::kSpine2 ||
                         joint == avatar::kSpine3 || joint == avatar::kLeftShoulder ||
                         joint == avatar::kRightShoulder;
      if (what == (leg ? kLowerClass : chest ? kUpperClass : kSkinClass))
        chosen.push_back(f);
    }
    return figure_.faces(Eigen::all, chosen);
  }

  HumanParser lipParser() const {
    return HumanParser(model(test::nearestColorNetwork(lipInputColors(), kLipSize)));
  }

  static constexpr int upperClass_ = 5;
  avatar::BodyModel figure_ = avatar::test::capsuleFigure();
  Turn turn_, labelled_;
};

double sharedLabels(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  double same = 0.0, all = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    all += b[i] != avatar::kNoLabel ? 1.0 : 0.0;
    same += b[i] != avatar::kNoLabel && a[i] == b[i] ? 1.0 : 0.0;
  }
  return same / all;
}

TEST_F(ParsedTurn, HasTheLabelsThatPicturesWouldGiveIt) {
  HumanParser parser = lipParser();
  const NetworkLabels labels = parseTurn(turn_, parser, 2);
  EXPECT_EQ(labels.frames, 2);
  EXPECT_FALSE(labels.onePiece);
  EXPECT_TRUE(turn_.frames[1].labels.empty());
  // A pixel on each side of an edge has mixed colours: of a person 60 pixels wide, some per cent.
  for (const std::size_t f : {0U, 2U})
    EXPECT_GT(sharedLabels(turn_.frames[f].labels, labelled_.frames[f].labels), 0.95);
  // The others follow by colour, as they do after the same frames' label pictures.
  Turn pictures = turn_;
  for (const std::size_t f : {0U, 2U})
    pictures.frames[f].labels = labelled_.frames[f].labels;
  const auto parsed = [&](const Turn& turn) {
    const Eigen::VectorXd betas = Eigen::VectorXd::Zero(3);
    return avatar::parsedFrames(turn.frames, avatar::Skinning(figure_), betas).labels;
  };
  const auto byNetwork = parsed(turn_);
  const auto byPictures = parsed(pictures);
  for (std::size_t f = 0; f < turn_.frames.size(); ++f)
    EXPECT_GT(sharedLabels(byNetwork[f], byPictures[f]), 0.95) << f;
}

TEST_F(ParsedTurn, IsOnePieceWhereTheNetworkSeesADress) {
  std::vector<Eigen::Vector3d> colors = lipInputColors();
  std::swap(colors[5], colors[6]);   // what looks like a shirt is a dress,
  std::swap(colors[9], colors[10]);  // what looks like trousers an overall
  HumanParser parser(model(test::nearestColorNetwork(colors, kLipSize)));
  EXPECT_TRUE(parseTurn(turn_, parser, 1).onePiece);
}

TEST_F(ParsedTurn, SaysWhenTheNetworkSeesNobody) {
  std::vector<Eigen::Vector3d> colors = lipInputColors();
  for (const std::size_t c : {5U, 9U, 13U})
    colors[c] = Eigen::Vector3d::Constant(1e3);
  colors[0] = Eigen::Vector3d::Zero();
  for (std::size_t c = 1; c < colors.size(); ++c)
    colors[c].array() += 1e3;
  HumanParser parser(model(test::nearestColorNetwork(colors, kLipSize)));
  EXPECT_THROW(parseTurn(turn_, parser, 2), std::runtime_error);
  for (avatar::PosedDepthFrame& frame : turn_.frames) {
    frame.color = {};
    frame.labels.clear();
  }
  EXPECT_THROW(parseTurn(turn_, parser, 2), std::runtime_error);
}

TEST_F(ParsedTurn, TakesLabelPicturesOfTheFramesThatHaveSome) {
  EXPECT_THROW(readTurnLabels(turn_, folder_.path()), avatar::FileError);
  const avatar::Camera& camera = turn_.camera;
  // The whole picture has a column and two rows more than the person's box.
  turn_.camera.width += 1;
  turn_.camera.height += 2;
  turn_.camera.cx += 1.0;
  turn_.camera.cy += 2.0;
  cv::Mat picture = cv::Mat::zeros(camera.height, camera.width, CV_8U);
  const avatar::PosedDepthFrame& truth = labelled_.frames[1];
  for (int y = 0; y < truth.camera.height; ++y) {
    for (int x = 0; x < truth.camera.width; ++x)
      picture.at<std::uint8_t>(y + 2, x + 1) = truth.labels[truth.index(x, y)];
  }
  cv::imwrite(folder_.path("000003.png"), picture);
  readTurnLabels(turn_, folder_.path());
  EXPECT_TRUE(turn_.frames[0].labels.empty());
  EXPECT_EQ(turn_.frames[1].labels, truth.labels);
  picture.setTo(7);
  cv::imwrite(folder_.path("000003.png"), picture);
  EXPECT_THROW(readTurnLabels(turn_, folder_.path()), avatar::FileError);
}

}  // namespace
}  // namespace simulcap
