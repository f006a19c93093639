#include "src/output/point_cache.h"

#include "avatar/io/file_error.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <limits>
#include <sstream>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

std::string cacheBytes(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

template <class Number>
Number numberAt(const std::string& bytes, std::size_t offset) {
  Number number;
  std::memcpy(&number, bytes.data() + offset, sizeof number);
  return number;
}

Eigen::Matrix3Xf pointsAt(int index) {
  Eigen::Matrix3Xf vertices(3, 2);
  vertices << 1, 4, 2, 5, 3, 6;
  return vertices.array() + 10.0F * static_cast<float>(index);
}

class PointCache : public ::testing::Test {
 protected:
  std::string write(int numFrames) const {
    Pc2Writer writer(path_, 2, {.startFrame = 5.0F, .sampleRate = 2.0F});
    for (int i = 0; i < numFrames; ++i)
      writer.append(pointsAt(i));
    writer.finish();
    return cacheBytes(path_);
  }

  int filesInFolder() const {
    return static_cast<int>(
        std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()));
  }

  avatar::test::TemporaryFolder folder_;
  std::string path_ = folder_.path("cloth.pc2");
};

TEST_F(PointCache, HasTheFormatsBytesWithZUp) {
  const std::string bytes = write(3);
  ASSERT_EQ(bytes.size(), 32U + 3 * 2 * 12);
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  EXPECT_EQ(numberAt<std::int32_t>(bytes, 12), 1);
  EXPECT_EQ(numberAt<std::int32_t>(bytes, 16), 2);
  EXPECT_EQ(numberAt<float>(bytes, 20), 5.0F);
  EXPECT_EQ(numberAt<float>(bytes, 24), 2.0F);
  EXPECT_EQ(numberAt<std::int32_t>(bytes, 28), 3);
  // The first vertex (1, 2, 3), Y up, is (1, −3, 2) with Z up.
  EXPECT_EQ(numberAt<float>(bytes, 32), 1.0F);
  EXPECT_EQ(numberAt<float>(bytes, 36), -3.0F);
  EXPECT_EQ(numberAt<float>(bytes, 40), 2.0F);
}

TEST_F(PointCache, ReadsBackWhatWasWritten) {
  write(4);
  Pc2Reader reader(path_);
  EXPECT_EQ(reader.numPoints(), 2);
  EXPECT_EQ(reader.numFrames(), 4);
  EXPECT_EQ(reader.timing().startFrame, 5.0F);
  EXPECT_EQ(reader.timing().sampleRate, 2.0F);
  for (const int index : {3, 0, 2})
    EXPECT_EQ(reader.frame(index), pointsAt(index));
  EXPECT_THROW(reader.frame(4), std::out_of_range);
  EXPECT_THROW(reader.frame(-1), std::out_of_range);
}

TEST_F(PointCache, AppearsAtFinishAndReplacesAnOlderOne) {
  write(1);
  const std::string old = cacheBytes(path_);
  Pc2Writer writer(path_, 2);
  writer.append(pointsAt(0));
  writer.append(pointsAt(1));
  EXPECT_EQ(cacheBytes(path_), old);
  writer.finish();
  EXPECT_EQ(Pc2Reader(path_).numFrames(), 2);
  EXPECT_EQ(filesInFolder(), 1);
  EXPECT_THROW(writer.append(pointsAt(2)), std::invalid_argument);
  EXPECT_THROW(writer.finish(), std::invalid_argument);
}

TEST_F(PointCache, LeavesNothingBehindWhenNotFinished) {
  {
    Pc2Writer writer(path_, 2);
    writer.append(pointsAt(0));
    EXPECT_EQ(filesInFolder(), 1);
  }
  EXPECT_EQ(filesInFolder(), 0);
}

TEST_F(PointCache, RefusesFramesThatAreNone) {
  Pc2Writer writer(path_, 2);
  EXPECT_THROW(writer.append(Eigen::Matrix3Xf::Zero(3, 3)), std::invalid_argument);
  Eigen::Matrix3Xf broken = pointsAt(0);
  broken(1, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(writer.append(broken), std::invalid_argument);
  EXPECT_EQ(writer.numFrames(), 0);
  EXPECT_THROW(Pc2Writer(path_, 0), std::invalid_argument);
  EXPECT_THROW(Pc2Writer(path_, 1, {.sampleRate = 0.0F}), std::invalid_argument);
}

TEST_F(PointCache, NamesAPlaceThatCannotBeWritten) {
  std::ofstream(folder_.path("file")) << "in the way";
  EXPECT_THROW(Pc2Writer(folder_.path("file/below.pc2"), 1), avatar::FileError);
  EXPECT_THROW(Pc2Writer(folder_.path(), 1), avatar::FileError);
}

TEST_F(PointCache, DamagedFilesAreRefused) {
  const std::string bytes = write(3);
  const auto refused = [&](const std::string& damaged) {
    std::ofstream(path_, std::ios::binary) << damaged;
    EXPECT_THROW(Pc2Reader reader(path_), avatar::FileError);
  };
  for (std::size_t length = 0; length < bytes.size(); ++length)
    refused(bytes.substr(0, length));
  refused(bytes + "x");
  // Version, points and samples that can't be.
  for (const std::size_t offset : {0, 12, 16, 28}) {
    std::string damaged = bytes;
    damaged.replace(offset, 4, "\xff\xff\xff\xff");
    refused(damaged);
  }
  EXPECT_THROW(Pc2Reader(folder_.path("none.pc2")), avatar::FileError);
  EXPECT_THROW(Pc2Reader(folder_.path()), avatar::FileError);
}

}  // namespace
}  // namespace simulcap
