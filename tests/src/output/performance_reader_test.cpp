#include "src/output/performance_reader.h"

#include "avatar/io/file_error.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

namespace simulcap {
namespace {

const PerformanceLayout kLayout = {
    .framesPerSecond = 15.0,
    .betas = Eigen::Vector2d(0.5, -1.0),
    .garments = {{"upper", 3, Eigen::Vector3i(0, 1, 2)}}};

PerformanceFrame recordedFrame(int recordingIndex) {
  PerformanceFrame frame;
  frame.recordingIndex = recordingIndex;
  frame.pose.translation.x() = recordingIndex;
  frame.pose.jointRotations[71] = 0.5;
  frame.garments = {{Eigen::Matrix3Xf::Constant(3, 3, 0.25F), {0, 100, 255}}};
  return frame;
}

TEST(PerformanceReader, GivesWhatWasWrittenFrameByFrame) {
  const avatar::test::TemporaryFolder folder;
  PerformanceWriter writer(folder.path("p.npz"), kLayout);
  for (const int index : {0, 1, 5})
    writer.append(recordedFrame(index));
  writer.finish();

  PerformanceReader reader(folder.path("p.npz"));
  EXPECT_EQ(reader.numFrames(), 3);
  EXPECT_EQ(reader.layout().framesPerSecond, 15.0);
  EXPECT_EQ(reader.layout().betas, kLayout.betas);
  ASSERT_EQ(reader.layout().garments.size(), 1U);
  EXPECT_EQ(reader.layout().garments[0].name, "upper");
  EXPECT_EQ(reader.layout().garments[0].faces, kLayout.garments[0].faces);
  for (const int index : {0, 1, 5}) {
    const auto frame = reader.next();
    ASSERT_TRUE(frame);
    const PerformanceFrame expected = recordedFrame(index);
    EXPECT_EQ(frame->recordingIndex, index);
    EXPECT_EQ(frame->pose.translation, expected.pose.translation);
    EXPECT_EQ(frame->pose.jointRotations, expected.pose.jointRotations);
    EXPECT_EQ(frame->garments[0].vertices, expected.garments[0].vertices);
    EXPECT_EQ(frame->garments[0].provenance, expected.garments[0].provenance);
  }
  EXPECT_FALSE(reader.next());
}

/// Writes the performance with one array replaced and reads all of it.
std::string problemWith(const std::string& key, const avatar::NpyArray& array) {
  const avatar::test::TemporaryFolder folder;
  const std::string path = folder.path("p.npz");
  PerformanceWriter writer(path, kLayout);
  writer.append(recordedFrame(0));
  writer.append(recordedFrame(1));
  writer.finish();
  avatar::NpzArrays arrays = avatar::readNpz(path);
  arrays[key] = array;
  avatar::writeNpz(path, arrays);
  try {
    PerformanceReader reader(path);
    while (reader.next()) {
    }
  } catch (const avatar::FileError& error) {
    return error.what();
  }
  return "";
}

TEST(PerformanceReader, NamesTheArrayThatIsWrong) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  avatar::NpyArray cloth = avatar::NpyArray::fromMatrix(Eigen::MatrixXd::Constant(2, 9, nan));
  cloth.shape = {2, 3, 3};
  avatar::NpyArray sameNumbers = avatar::NpyArray::fromMatrix(Eigen::Vector2d(4, 4));
  sameNumbers.shape = {2};
  const std::vector<std::pair<std::string, avatar::NpyArray>> cases = {
      {"poses", avatar::NpyArray::fromMatrix(Eigen::MatrixXd::Zero(2, 71))},
      {"trans", avatar::NpyArray::fromMatrix(Eigen::MatrixXd::Zero(3, 3))},
      {"garment_upper", cloth},
      {"garment_upper", avatar::NpyArray::fromMatrix(Eigen::MatrixXd::Zero(2, 3))},
      {"faces_upper", avatar::NpyArray::fromMatrix(Eigen::MatrixXd::Constant(1, 3, 3))},
      {"frame_index", sameNumbers},
      {"up_axis", avatar::NpyArray::fromText("z")},
      {"mocap_framerate", avatar::NpyArray::fromMatrix(Eigen::MatrixXd::Zero(1, 1))}};
  for (const auto& [key, array] : cases)
    EXPECT_NE(problemWith(key, array).find("p.npz: " + key), std::string::npos)
        << key << ": " << problemWith(key, array);
}

}  // namespace
}  // namespace simulcap
