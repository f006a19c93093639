#include "tests/fuzz/readers.h"

#include "tests/support/primitive_meshes.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

namespace simulcap::fuzz {
namespace {

namespace fs = std::filesystem;
using avatar::test::TemporaryFolder;

/// corpus/READER: what fuzzing has found, and what reaches much of a reader.
TEST(Readers, CopeWithWhatFuzzingFound) {
  int numFiles = 0;
  for (const Reader& reader : readers()) {
    const fs::path corpus = fs::path(SIMULCAP_CORPUS) / reader.name;
    if (!fs::exists(corpus))
      continue;
    for (const auto& entry : fs::directory_iterator(corpus)) {
      const TemporaryFolder folder;
      EXPECT_NO_THROW(readBytes(reader, bytesOf(entry.path()), folder.path()))
          << entry.path() << " must give avatar::FileError or nothing";
      ++numFiles;
    }
  }
  EXPECT_GT(numFiles, 0);
}

TEST(Readers, CopeWithDamagedFiles) {
  avatar::test::Noise noise(1);
  const auto below = [&](std::size_t limit) {
    return static_cast<std::size_t>(0.4999 * (noise.next() + 1.0) * static_cast<double>(limit));
  };
  for (const Reader& reader : readers()) {
    const TemporaryFolder folder;
    reader.writeSeed(folder.path());
    const std::string seed = bytesOf(folder.path(reader.file));
    ASSERT_TRUE(readBytes(reader, seed, folder.path())) << reader.name << ": nothing is wrong yet";
    for (int round = 0; round < 50; ++round) {
      std::string damaged = seed.substr(0, round % 3 == 0 ? below(seed.size()) : seed.size());
      for (int i = 0; i < 3 && !damaged.empty(); ++i)
        damaged[below(damaged.size())] = static_cast<char>(below(256));
      EXPECT_NO_THROW(readBytes(reader, damaged, folder.path()))
          << reader.name << ", round " << round << ": must give avatar::FileError or nothing";
    }
  }
}

}  // namespace
}  // namespace simulcap::fuzz
