#include "avatar/io/atomic_file.h"

#include "avatar/io/file_error.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace avatar {
namespace {

namespace fs = std::filesystem;

class AtomicFile : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }

  void TearDown() override { fs::remove_all(folder_); }

  static std::string contents(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

  fs::path folder_ =
      fs::temp_directory_path() / (std::string("simulcap_atomic_") +
                                   ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(AtomicFile, WritesEveryByteAndMakesTheFolder) {
  const std::string bytes("a\0b\r\n\xff", 6);
  writeFileAtomically(folder_ / "new" / "file.bin", bytes);
  EXPECT_EQ(contents(folder_ / "new" / "file.bin"), bytes);
}

TEST_F(AtomicFile, ReplacesAndLeavesNothingElseBehind) {
  writeFileAtomically(folder_ / "file.txt", "old and long");
  writeFileAtomically(folder_ / "file.txt", "new");
  EXPECT_EQ(contents(folder_ / "file.txt"), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(AtomicFile, AFolderThatCannotBeMadeIsNamed) {
  writeFileAtomically(folder_ / "file", "in the way");
  try {
    writeFileAtomically(folder_ / "file" / "below.txt", "text");
    FAIL() << "a file was written below a file";
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("below.txt"), std::string::npos);
  }
}

TEST_F(AtomicFile, AFolderIsNotOverwritten) {
  EXPECT_THROW(writeFileAtomically(folder_, "text"), FileError);
}

TEST_F(AtomicFile, GrowsPieceByPieceUnderATemporaryName) {
  AtomicFileWriter file(folder_ / "file.bin");
  file.append("0123");
  file.append("4567");
  file.overwrite(2, "ab");
  file.append("89");
  EXPECT_FALSE(fs::exists(folder_ / "file.bin"));
  file.commit();
  EXPECT_EQ(contents(folder_ / "file.bin"), "01ab456789");
  EXPECT_THROW(file.append("x"), std::invalid_argument);
  EXPECT_THROW(file.commit(), std::invalid_argument);
}

TEST_F(AtomicFile, LeavesNothingWhenItIsNotCommitted) {
  {
    AtomicFileWriter file(folder_ / "file.bin");
    file.append("0123");
  }
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace avatar
