#include "src/input/openni2/openni2_source.h"

#include "avatar/io/file_error.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>

namespace simulcap {
namespace {

std::string messageOf(const std::string& device) {
  try {
    openOpenNi2(device);
  } catch (const avatar::FileError& error) {
    return error.what();
  }
  return "";
}

TEST(OpenNi2Source, NamesTheFileThatIsMissing) {
  const std::string message = messageOf("/nowhere/turn.oni");
  EXPECT_NE(message.find("/nowhere/turn.oni"), std::string::npos) << message;
  EXPECT_NE(message.find("missing"), std::string::npos) << message;
}

TEST(OpenNi2Source, NamesTheFileThatIsNoRecording) {
  const avatar::test::TemporaryFolder folder;
  std::ofstream(folder.path("text.oni")) << "not a recording";
  const std::string message = messageOf(folder.path("text.oni"));
  EXPECT_NE(message.find("text.oni: can't be played"), std::string::npos) << message;
}

/// Nobody has a hundred cameras.
TEST(OpenNi2Source, SaysThatThereIsNoSuchCamera) {
  const std::string message = messageOf("#100");
  EXPECT_NE(message.find("plug a camera in"), std::string::npos) << message;
}

}  // namespace
}  // namespace simulcap
