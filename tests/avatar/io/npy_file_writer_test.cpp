#include "avatar/io/npy_file_writer.h"

#include "avatar/io/file_error.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

namespace avatar {
namespace {

using Type = NpyArray::Type;

const NpyRows kPairs = {Type::kFloat32, {2}};

class NpyFileWriterTest : public ::testing::Test {
 protected:
  void writePairs(NpyFileWriter& writer, int begin, int end) const {
    for (int i = begin; i < end; ++i) {
      const std::array<float, 2> row = {static_cast<float>(i), 0.5F};
      writer.append(row.data());
    }
  }

  /// The array of a closed file, through an .npz.
  NpyArray readBack(bool deflate) const {
    writeNpzFromFiles(folder_.path("a.npz"), {{"a", {path_, deflate}}});
    return readNpz(folder_.path("a.npz")).at("a");
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.path("rows.npy");
};

TEST_F(NpyFileWriterTest, RowsBecomeAnArrayStoredOrDeflated) {
  NpyFileWriter writer(path_, kPairs);
  writePairs(writer, 0, 1000);
  EXPECT_EQ(writer.numRows(), 1000);
  writer.close();
  for (const bool deflate : {false, true}) {
    const NpyArray array = readBack(deflate);
    EXPECT_EQ(array.type, Type::kFloat32);
    EXPECT_EQ(array.shapeText(), "(1000, 2)");
    EXPECT_EQ(array.at(2 * 999), 999.0);
    EXPECT_EQ(array.at(2 * 999 + 1), 0.5);
  }
}

TEST_F(NpyFileWriterTest, RowsMayBeNumbersAndFilesEmpty) {
  NpyFileWriter numbers(path_, {Type::kUint8, {}});
  const std::uint8_t seven = 7;
  numbers.append(&seven);
  numbers.close();
  EXPECT_EQ(readBack(true).shapeText(), "(1,)");
  NpyFileWriter(path_, kPairs).close();
  EXPECT_EQ(readBack(true).shapeText(), "(0, 2)");
}

TEST_F(NpyFileWriterTest, WholeRowsOfAnUnfinishedFileAreCountedAndContinued) {
  EXPECT_EQ(countNpyRows(path_, kPairs), -1);
  {
    NpyFileWriter writer(path_, kPairs);
    writePairs(writer, 0, 5);
  }
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) - 3);
  EXPECT_EQ(countNpyRows(path_, kPairs), 4);
  EXPECT_EQ(countNpyRows(path_, {Type::kFloat32, {3}}), -1);
  EXPECT_EQ(countNpyRows(path_, {Type::kFloat64, {2}}), -1);
  EXPECT_THROW(NpyFileWriter(path_, kPairs, 5), std::invalid_argument);
  NpyFileWriter writer(path_, kPairs, 3);
  EXPECT_EQ(writer.numRows(), 3);
  writePairs(writer, 30, 31);
  writer.close();
  EXPECT_EQ(countNpyRows(path_, kPairs), 4);
  const NpyArray array = readBack(true);
  EXPECT_EQ(array.shapeText(), "(4, 2)");
  EXPECT_EQ(array.at(2 * 2), 2.0);
  EXPECT_EQ(array.at(2 * 3), 30.0);
}

TEST_F(NpyFileWriterTest, DamagedFilesHaveNoRows) {
  { NpyFileWriter writer(path_, kPairs); }
  for (const std::uintmax_t length : {150, 10, 0}) {
    std::filesystem::resize_file(path_, length);
    EXPECT_EQ(countNpyRows(path_, kPairs), -1);
  }
  std::ofstream(path_) << std::string(500, 'x');
  EXPECT_EQ(countNpyRows(path_, kPairs), -1);
}

TEST_F(NpyFileWriterTest, ClosedIsClosedAndPlacesAreNamed) {
  NpyFileWriter writer(path_, kPairs);
  writer.close();
  EXPECT_THROW(writePairs(writer, 0, 1), std::invalid_argument);
  EXPECT_THROW(writer.close(), std::invalid_argument);
  EXPECT_THROW(NpyFileWriter(folder_.path("no/folder.npy"), kPairs), FileError);
  EXPECT_THROW(writeNpzFromFiles(folder_.path("a.npz"), {}), std::invalid_argument);
  EXPECT_THROW(
      writeNpzFromFiles(folder_.path("a.npz"), {{"a", {folder_.path("none.npy")}}}), FileError);
  EXPECT_FALSE(std::filesystem::exists(folder_.path("a.npz")));
}

TEST_F(NpyFileWriterTest, AFullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full"))
    GTEST_SKIP() << "no /dev/full here";
  EXPECT_THROW(NpyFileWriter("/dev/full", kPairs), FileError);
}

}  // namespace
}  // namespace avatar
