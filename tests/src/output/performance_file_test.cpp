#include "src/output/performance_file.h"

#include "avatar/io/file_error.h"
#include "avatar/io/motion_file.h"
#include "avatar/io/npz.h"
#include "tests/support/synthetic_body.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

namespace simulcap {
namespace {

namespace fs = std::filesystem;
using Type = avatar::NpyArray::Type;

std::string bytesOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// A strip of triangles through all the vertices.
Eigen::Matrix3Xi strip(int numVertices) {
  Eigen::Matrix3Xi faces(3, numVertices - 2);
  for (int f = 0; f < numVertices - 2; ++f)
    faces.col(f) << f, f + 1 + f % 2, f + 2 - f % 2;
  return faces;
}

PerformanceLayout layout(int numVertices = 5) {
  return {
      .framesPerSecond = 29.97,
      .betas = Eigen::Vector3d(0.5, -1.0, 2.0),
      .garments = {{"upper", numVertices, strip(numVertices)}, {"lower", 3, strip(3)}},
      .jointDeviations = true};
}

/// Any frame, another for every index.
PerformanceFrame frameAt(int index, const PerformanceLayout& of) {
  avatar::test::Noise noise(static_cast<std::uint64_t>(index) + 1);
  PerformanceFrame frame;
  frame.pose.jointRotations = 0.1 * avatar::test::randomMatrix(noise, 72, 1);
  frame.pose.translation = avatar::test::randomMatrix(noise, 3, 1);
  for (float& deviation : frame.jointDeviations)
    deviation = static_cast<float>(std::abs(noise.next()));
  frame.jointDeviations.back() = std::numeric_limits<float>::infinity();
  for (const auto& garment : of.garments) {
    auto& cloth = frame.garments.emplace_back();
    cloth.vertices = avatar::test::randomMatrix(noise, 3, garment.numVertices).cast<float>();
    for (int v = 0; v < garment.numVertices; ++v)
      cloth.provenance.push_back(static_cast<std::uint8_t>(7 * index + v));
  }
  return frame;
}

class PerformanceFile : public ::testing::Test {
 protected:
  void append(PerformanceWriter& writer, int begin, int end) const {
    for (int i = begin; i < end; ++i)
      writer.append(frameAt(i, layout()));
  }

  /// The bytes of a performance written in one go.
  std::string wholeBytes(int numFrames) const {
    const std::string path = folder_.path("whole.npz");
    PerformanceWriter writer(path, layout());
    append(writer, 0, numFrames);
    writer.finish();
    return bytesOf(path);
  }

  std::string part(const std::string& key) const { return path_ + ".parts/" + key + ".npy"; }

  avatar::test::TemporaryFolder folder_;
  std::string path_ = folder_.path("performance.npz");
};

template <class Number>
void expectRow(const avatar::NpyArray& array, int row, const Number* expected, std::size_t count) {
  const std::size_t numBytes = count * sizeof(Number);
  ASSERT_GE(array.bytes.size(), (static_cast<std::size_t>(row) + 1) * numBytes);
  EXPECT_EQ(
      std::memcmp(
          array.bytes.data() + static_cast<std::size_t>(row) * numBytes, expected, numBytes),
      0);
}

TEST_F(PerformanceFile, ReadsBackBitForBit) {
  constexpr int kFrames = 7;
  PerformanceWriter writer(path_, layout());
  append(writer, 0, kFrames);
  EXPECT_EQ(writer.numFrames(), kFrames);
  writer.finish();
  const avatar::NpzArrays arrays = avatar::readNpz(path_);
  EXPECT_EQ(arrays.size(), 13U);
  EXPECT_EQ(arrays.at("poses").shapeText(), "(7, 72)");
  EXPECT_EQ(arrays.at("trans").shapeText(), "(7, 3)");
  EXPECT_EQ(arrays.at("garment_upper").shapeText(), "(7, 5, 3)");
  EXPECT_EQ(arrays.at("garment_upper").type, Type::kFloat32);
  EXPECT_EQ(arrays.at("provenance_lower").shapeText(), "(7, 3)");
  EXPECT_EQ(arrays.at("provenance_lower").type, Type::kUint8);
  EXPECT_EQ(arrays.at("faces_upper").type, Type::kInt32);
  EXPECT_EQ(arrays.at("faces_upper").asMatrix(), strip(5).transpose().cast<double>());
  EXPECT_EQ(arrays.at("faces_lower").shapeText(), "(1, 3)");
  EXPECT_EQ(arrays.at("mocap_framerate").at(0), 29.97);
  EXPECT_EQ(arrays.at("betas").asMatrix(), layout().betas);
  EXPECT_EQ(arrays.at("up_axis").asText(), "y");
  for (int i = 0; i < kFrames; ++i) {
    const PerformanceFrame frame = frameAt(i, layout());
    expectRow(arrays.at("poses"), i, frame.pose.jointRotations.data(), 72);
    expectRow(arrays.at("trans"), i, frame.pose.translation.data(), 3);
    expectRow(arrays.at("joint_deviation"), i, frame.jointDeviations.data(), 24);
    expectRow(arrays.at("garment_upper"), i, frame.garments[0].vertices.data(), 15);
    expectRow(arrays.at("garment_lower"), i, frame.garments[1].vertices.data(), 9);
    expectRow(arrays.at("provenance_upper"), i, frame.garments[0].provenance.data(), 5);
  }
}

TEST_F(PerformanceFile, IsAMotionFile) {
  PerformanceWriter writer(path_, layout());
  append(writer, 0, 3);
  writer.finish();
  const avatar::MotionFile file = avatar::readMotion(path_);
  EXPECT_EQ(file.motion.framesPerSecond, 29.97);
  ASSERT_EQ(file.motion.frames.size(), 3U);
  EXPECT_EQ(file.motion.frames[2].jointRotations, frameAt(2, layout()).pose.jointRotations);
}

TEST_F(PerformanceFile, TheSameFramesGiveTheSameBytes) {
  const std::string first = wholeBytes(4);
  EXPECT_EQ(wholeBytes(4), first);
}

TEST_F(PerformanceFile, AppearsAtFinishAndLeavesNothingElse) {
  PerformanceWriter writer(path_, layout());
  append(writer, 0, 2);
  EXPECT_FALSE(fs::exists(path_));
  writer.finish();
  EXPECT_TRUE(fs::exists(path_));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()), 1);
  EXPECT_THROW(append(writer, 2, 3), std::invalid_argument);
  EXPECT_THROW(writer.finish(), std::invalid_argument);
}

TEST_F(PerformanceFile, ContinuedPerformancesAreThoseNeverInterrupted) {
  const std::string whole = wholeBytes(6);
  for (const int interruption : {0, 1, 5}) {
    {
      PerformanceWriter writer(path_, layout());
      append(writer, 0, interruption);
    }
    PerformanceWriter writer(path_, layout(), PerformanceStart::kContinue);
    EXPECT_EQ(writer.numFrames(), interruption);
    append(writer, interruption, 6);
    writer.finish();
    EXPECT_EQ(bytesOf(path_), whole);
  }
}

TEST_F(PerformanceFile, ARunThatEndedWithinAFrameGoesOnBeforeIt) {
  const std::string whole = wholeBytes(4);
  {
    PerformanceWriter writer(path_, layout());
    append(writer, 0, 3);
  }
  // The last frame's body is there, its garment only in part.
  const std::uintmax_t bytes = fs::file_size(part("garment_upper"));
  fs::resize_file(part("garment_upper"), bytes - 7);
  PerformanceWriter writer(path_, layout(), PerformanceStart::kContinue);
  EXPECT_EQ(writer.numFrames(), 2);
  append(writer, 2, 4);
  writer.finish();
  EXPECT_EQ(bytesOf(path_), whole);
}

TEST_F(PerformanceFile, WithNothingToContinueItStartsAnew) {
  PerformanceWriter fresh(path_, layout(), PerformanceStart::kContinue);
  EXPECT_EQ(fresh.numFrames(), 0);
  append(fresh, 0, 2);
  // A new start drops them.
  EXPECT_EQ(PerformanceWriter(path_, layout()).numFrames(), 0);
}

TEST_F(PerformanceFile, AnotherPerformanceIsNotContinued) {
  {
    PerformanceWriter writer(path_, layout());
    append(writer, 0, 2);
  }
  const auto refused = [&](const PerformanceLayout& other) {
    EXPECT_THROW(PerformanceWriter(path_, other, PerformanceStart::kContinue), avatar::FileError);
  };
  PerformanceLayout other = layout();
  other.betas[0] += 1e-9;
  refused(other);
  other = layout(6);
  refused(other);
  other = layout();
  other.garments.pop_back();
  refused(other);
  other = layout();
  other.garments.push_back({"hat", 4, strip(4)});
  refused(other);
  other = layout();
  other.garments[1].faces.col(0) << 1, 2, 0;
  refused(other);
  std::ofstream(part("poses"), std::ios::binary) << "damaged";
  refused(layout());
}

TEST_F(PerformanceFile, RefusesWhatDoesNotFit) {
  const auto refused = [&](PerformanceLayout broken) {
    EXPECT_THROW(PerformanceWriter(path_, std::move(broken)), std::invalid_argument);
  };
  refused({.garments = {{"a/b", 3, strip(3)}}});
  refused({.garments = {{"", 3, strip(3)}}});
  refused({.garments = {{"a", 3, strip(3)}, {"a", 3, strip(3)}}});
  refused({.garments = {{"a", 0, {}}}});
  refused({.garments = {{"a", 3, {}}}});
  refused({.garments = {{"a", 3, strip(4)}}});
  refused({.garments = {{"a", 3, strip(3).array() - 1}}});
  refused({.framesPerSecond = 0.0});

  PerformanceWriter writer(path_, layout());
  const auto refusedFrame = [&](const PerformanceFrame& frame) {
    EXPECT_THROW(writer.append(frame), std::invalid_argument);
  };
  PerformanceFrame frame = frameAt(0, layout());
  frame.garments.pop_back();
  refusedFrame(frame);
  frame = frameAt(0, layout());
  frame.garments[0].provenance.pop_back();
  refusedFrame(frame);
  frame = frameAt(0, layout());
  frame.garments[1].vertices(0, 0) = std::numeric_limits<float>::infinity();
  refusedFrame(frame);
  frame = frameAt(0, layout());
  frame.pose.jointRotations[3] = std::numeric_limits<double>::quiet_NaN();
  refusedFrame(frame);
  EXPECT_EQ(writer.numFrames(), 0);
  EXPECT_THROW(writer.finish(), std::invalid_argument);
}

TEST_F(PerformanceFile, NamesAPlaceThatCannotBeWritten) {
  std::ofstream(folder_.path("file")) << "in the way";
  EXPECT_THROW(PerformanceWriter(folder_.path("file/p.npz"), layout()), avatar::FileError);
}

TEST_F(PerformanceFile, EveryFrameIsInItsFileWhenAppendReturns) {
  PerformanceWriter writer(path_, layout());
  const std::uintmax_t empty = fs::file_size(part("garment_upper"));
  for (int i = 1; i <= 20; ++i) {
    append(writer, i - 1, i);
    EXPECT_EQ(fs::file_size(part("garment_upper")), empty + i * 5 * 12);
    EXPECT_EQ(fs::file_size(part("provenance_lower")), empty + i * 3);
  }
}

/// Largest resident set of this process so far [bytes]; nothing when the system doesn't say.
std::optional<double> peakMemory() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kilobytes = 0.0;
    if (word == "VmHWM:" && status >> kilobytes)
      return 1024.0 * kilobytes;
  }
  return std::nullopt;
}

TEST_F(PerformanceFile, MemoryDoesNotGrowWithTheFrames) {
  constexpr int kVertices = 20000;
  constexpr int kFrames = 300;
  const PerformanceLayout large = layout(kVertices);
  const PerformanceFrame frame = frameAt(0, large);
  PerformanceWriter writer(path_, large);
  writer.append(frame);
  const std::optional<double> before = peakMemory();
  for (int i = 1; i < kFrames; ++i)
    writer.append(frame);
  writer.finish();
  const std::optional<double> after = peakMemory();
  if (!before || !after)
    GTEST_SKIP() << "this system doesn't tell a process's largest memory";
  // 78 MB are written. What grows is the zip library at the end (buffers, its code), by about
  // 3 MB; a quarter of the data leaves room for any allocator.
  const double written = 13.0 * kVertices * kFrames;
  EXPECT_LT(*after - *before, 0.25 * written);
}

}  // namespace
}  // namespace simulcap
