#include "avatar/io/npz_row_reader.h"

#include "avatar/io/file_error.h"
#include "avatar/io/npy_file_writer.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace avatar {
namespace {

using test::TemporaryFolder;

/// (3, 2, 2) with the elements 0 … 11.
NpyArray counting(NpyArray::Type type) {
  const Eigen::MatrixXd numbers = Eigen::VectorXd::LinSpaced(12, 0.0, 11.0).transpose();
  NpyArray array = NpyArray::fromMatrix(numbers, type);
  array.shape = {3, 2, 2};
  return array;
}

TEST(NpzRowReader, GivesTheRowsThatWereWritten) {
  const TemporaryFolder folder;
  for (const auto type : {NpyArray::Type::kFloat32, NpyArray::Type::kUint8}) {
    writeNpz(folder.path("x.npz"), {{"a", counting(type)}, {"b", counting(type)}});
    NpzRowReader reader(folder.path("x.npz"), "b");
    ASSERT_EQ(reader.numRows(), 3);
    EXPECT_EQ(reader.rowShape(), (std::vector<std::int64_t>{2, 2}));
    for (int row = 0; row < 3; ++row) {
      const NpyArray array = reader.next();
      EXPECT_EQ(array.shape, (std::vector<std::int64_t>{2, 2}));
      for (int i = 0; i < 4; ++i)
        EXPECT_EQ(array.at(i), 4 * row + i);
    }
    EXPECT_THROW(reader.next(), std::out_of_range);
  }
}

TEST(NpzRowReader, RowsMayBeNumbersAndAnyNumberOfReadersMayRun) {
  const TemporaryFolder folder;
  NpyArray numbers = counting(NpyArray::Type::kInt32);
  numbers.shape = {12};
  writeNpz(folder.path("x.npz"), {{"n", numbers}});
  NpzRowReader first(folder.path("x.npz"), "n");
  first.next();
  NpzRowReader second(folder.path("x.npz"), "n");
  EXPECT_EQ(first.next().at(0), 1);
  EXPECT_EQ(second.next().at(0), 0);
}

TEST(NpzRowReader, NamesFileAndKeyOfWhatItCannotRead) {
  const TemporaryFolder folder;
  const std::string path = folder.path("x.npz");
  NpyArray scalar = counting(NpyArray::Type::kInt32);
  scalar.bytes.resize(4);
  scalar.shape = {};
  writeNpz(
      path,
      {{"a", counting(NpyArray::Type::kFloat32)},
       {"scalar", scalar},
       {"text", NpyArray::fromText("words")}});
  EXPECT_EQ(npzKeys(path), (std::vector<std::string>{"a", "scalar", "text"}));
  for (const std::string key : {"none", "scalar", "text"}) {
    try {
      NpzRowReader(path, key);
      ADD_FAILURE() << key;
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find("x.npz: " + key), std::string::npos) << error.what();
    }
  }
}

/// A stored array whose bytes were changed: the sum that the zip file keeps of them differs.
TEST(NpzRowReader, NoticesDamage) {
  const TemporaryFolder folder;
  NpyFileWriter rows(folder.path("a.npy"), {NpyArray::Type::kFloat64, {1}});
  for (double value = 1.0; value < 4.0; ++value)
    rows.append(&value);
  rows.close();
  writeNpzFromFiles(folder.path("x.npz"), {{"a", {folder.path("a.npy"), false}}});
  std::ostringstream text;
  text << std::ifstream(folder.path("x.npz"), std::ios::binary).rdbuf();
  std::string bytes = text.str();
  const double two = 2.0;
  const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&two), sizeof two));
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 1;
  std::ofstream(folder.path("x.npz"), std::ios::binary) << bytes;
  NpzRowReader reader(folder.path("x.npz"), "a");
  EXPECT_THROW(
      {
        for (int row = 0; row < 3; ++row)
          reader.next();
      },
      FileError);
}

}  // namespace
}  // namespace avatar
