#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <unistd.h>

namespace avatar::test {

/// A folder of its own for one test, removed afterwards.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("simulcap_") + test->test_suite_name() + "_" + test->name() + "_" +
               std::to_string(::getpid()) + "_" + std::to_string(count()++));
    std::filesystem::create_directories(folder_);
  }

  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  TemporaryFolder(TemporaryFolder&&) = delete;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;

  std::string path(const std::string& name = "") const { return (folder_ / name).string(); }

 private:
  /// Folders of this process so far: a test may have several.
  static int& count() {
    static int made = 0;
    return made;
  }

  std::filesystem::path folder_;
};

}  // namespace avatar::test
