#include "src/report/track_codec.h"

#include "src/report/frame_series.h"
#include "src/report/report_page.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace simulcap {
namespace {

std::vector<std::uint32_t> noise(std::size_t count, std::uint32_t most, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<std::uint32_t> value(0, most);
  std::vector<std::uint32_t> values(count);
  for (std::uint32_t& one : values)
    one = value(random);
  return values;
}

class TrackCodec : public ::testing::TestWithParam<TrackShape> {};

TEST_P(TrackCodec, GivesAnyValuesBack) {
  const TrackShape shape = GetParam();
  const std::uint32_t most = shape.bytesPerValue == 4 ? std::numeric_limits<std::uint32_t>::max()
                                                      : (1U << (8 * shape.bytesPerValue)) - 1U;
  std::vector<std::uint32_t> values = noise(shape.size(), most, 7);
  for (std::size_t i = 0; i < values.size(); i += 5)  // the largest differences there are
    values[i] = i % 2 == 0 ? 0U : most;
  const std::string bytes = packedTrack(values, shape);
  EXPECT_EQ(bytes.size(), shape.size() * static_cast<std::size_t>(shape.bytesPerValue));
  EXPECT_EQ(unpackedTrack(bytes, shape), values);
}

INSTANTIATE_TEST_SUITE_P(
    Report,
    TrackCodec,
    ::testing::Values(
        TrackShape{.frames = 4, .points = 13, .components = 3, .bytesPerValue = 2},
        TrackShape{.frames = 3, .points = 8, .bytesPerValue = 1},
        TrackShape{.frames = 2, .points = 5, .components = 2, .bytesPerValue = 4},
        TrackShape{.frames = 3, .points = 9, .bytesPerValue = 2, .overTime = false},
        TrackShape{.frames = 1, .points = 0, .components = 3}));

/// What moves as one has differences of nothing after its first point.
TEST(TrackCodecBytes, OfARigidMoveAreZeroButForOnePoint) {
  const TrackShape shape{.frames = 2, .points = 50, .components = 3};
  std::vector<std::uint32_t> values = noise(shape.size() / 2, 60000, 3);
  const std::vector<std::uint32_t> first = values;
  for (const std::uint32_t value : first)
    values.push_back(value + 77U);
  const std::string bytes = packedTrack(values, shape);
  std::size_t ofSecondFrame = 0;
  for (std::size_t component = 0; component < 3; ++component)
    for (std::size_t point = 0; point < 50; ++point)
      ofSecondFrame += bytes[component * 100 + 50 + point] != 0 ? 1 : 0;
  EXPECT_EQ(ofSecondFrame, 3U);
}

TEST(TrackCodecBytes, OfAnotherNumberAreRefused) {
  const TrackShape shape{.frames = 2, .points = 3};
  EXPECT_THROW(packedTrack(std::vector<std::uint32_t>(5), shape), std::invalid_argument);
  EXPECT_THROW(unpackedTrack(std::string(11, ' '), shape), std::invalid_argument);
  EXPECT_THROW(packedTrack({}, TrackShape{.points = 0, .bytesPerValue = 3}), std::invalid_argument);
}

std::vector<Eigen::Matrix3Xf> randomFrames(float extent) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> coordinate(-0.5F * extent, 0.5F * extent);
  std::vector<Eigen::Matrix3Xf> frames(4, Eigen::Matrix3Xf(3, 40));
  for (Eigen::Matrix3Xf& frame : frames)
    frame = Eigen::Matrix3Xf::NullaryExpr(3, 40, [&] { return coordinate(random); });
  return frames;
}

void expectWithinHalfAStep(
    const std::vector<Eigen::Matrix3Xf>& frames, const PositionChunk& chunk, float extent) {
  PositionChunk read = chunk;
  read.values = unpackedTrack(packedTrack(chunk.values, chunk.shape), chunk.shape);
  const std::vector<Eigen::Matrix3Xf> shown = dequantized(read);
  ASSERT_EQ(shown.size(), frames.size());
  // Half a step, and the float that a coordinate is rounded to.
  const double most = 0.5 * chunk.step + static_cast<double>(extent) * 1e-7;
  for (std::size_t f = 0; f < frames.size(); ++f)
    EXPECT_LE((shown[f] - frames[f]).cwiseAbs().maxCoeff(), most);
}

TEST(Quantized, PositionsAreWithinHalfAStep) {
  const std::vector<Eigen::Matrix3Xf> frames = randomFrames(2.0F);
  const PositionChunk chunk = quantized(frames, 0.0002);
  EXPECT_EQ(chunk.step, 0.0002);
  expectWithinHalfAStep(frames, chunk, 2.0F);
}

TEST(Quantized, StepGrowsWithWhatDoesNotFitIntoSixteenBits) {
  const std::vector<Eigen::Matrix3Xf> frames = randomFrames(300.0F);
  const PositionChunk chunk = quantized(frames, 0.0002);
  EXPECT_GE(chunk.step * 65535.0, 295.0);
  EXPECT_LT(chunk.step * 65535.0, 2.0 * 300.0);
  expectWithinHalfAStep(frames, chunk, 300.0F);
}

TEST(Quantized, RefusesWhatIsNoPosition) {
  std::vector<Eigen::Matrix3Xf> frames = randomFrames(1.0F);
  EXPECT_THROW(quantized({}, 0.001), std::invalid_argument);
  EXPECT_THROW(quantized(frames, 0.0), std::invalid_argument);
  frames[2](1, 5) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(quantized(frames, 0.001), std::invalid_argument);
  frames[2] = Eigen::Matrix3Xf::Zero(3, 39);
  EXPECT_THROW(quantized(frames, 0.001), std::invalid_argument);
}

/// RFC 4648, section 10.
TEST(Base64, IsAsTheStandardSays) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string("\xFF\xFE\xFD", 3)), "//79");
}

TEST(FrameSeries, HasAGapWhereAFrameHasNoValue) {
  FrameSeries series;
  series.begin(4);
  series.begin(6);
  series.add("mm", "median", 2.5);
  series.begin(7);
  EXPECT_EQ(series.json().at("numbers"), nlohmann::json({4, 6, 7}));
  EXPECT_EQ(
      series.json().at("plots").at("mm").at("median"), nlohmann::json({nullptr, 2.5, nullptr}));
}

TEST(FrameSeries, TakesTimesByTheNumbersOfFrames) {
  FrameSeries series;
  series.begin(4);
  series.begin(6);
  series.addTiming("timing.csv", "frame,input,total\n3,1,2\n6,30.5,90\n");
  EXPECT_EQ(series.json().at("plots").at("timing_ms").at("total"), nlohmann::json({nullptr, 90.0}));
  EXPECT_THROW(series.addTiming("timing.csv", "frame,total\n5\n"), std::runtime_error);
  EXPECT_THROW(series.addTiming("timing.csv", "total\n5\n"), std::runtime_error);
  EXPECT_THROW(series.addTiming("timing.csv", ""), std::runtime_error);
}

}  // namespace
}  // namespace simulcap
