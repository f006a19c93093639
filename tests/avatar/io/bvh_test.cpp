#include "avatar/io/bvh.h"

#include "avatar/io/file_error.h"

#include <gtest/gtest.h>

#include <numbers>

namespace avatar {
namespace {

const std::string kHierarchy =
    "HIERARCHY\n"
    "ROOT Hips\n{\n"
    "  OFFSET 0 1.5 0\n"
    "  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    "  JOINT Bip01 L Arm {\n"
    "    OFFSET 2 +0.5 -1e-1\n"
    "    CHANNELS 3 Yrotation Zrotation Xrotation\n"
    "    End Site\n    {\n      OFFSET 0 3 0\n    }\n"
    "  }\n}\n";

const std::string kMotion =
    "MOTION\nFrames: 2\nFrame Time: 0.025\n"
    "1 2 3 0 90 0 0 0 0\n"
    "1 2 3 10 20 30 40 50 60\n";

Eigen::Quaterniond turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis));
}

std::string errorOf(const std::string& text) {
  try {
    parseBvh(text, "clip.bvh");
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(Bvh, ReadsTreeOffsetsAndRate) {
  const RecordedMotion motion = parseBvh(kHierarchy + kMotion, "clip.bvh");
  ASSERT_EQ(motion.joints.size(), 3u);
  EXPECT_EQ(motion.joints[1].name, "Bip01 L Arm");
  EXPECT_EQ(motion.joints[2].name, "");
  EXPECT_EQ(motion.joints[2].parent, 1);
  EXPECT_EQ(motion.joints[1].offset, Eigen::Vector3d(2.0, 0.5, -0.1));
  EXPECT_DOUBLE_EQ(motion.framesPerSecond, 40.0);
  EXPECT_EQ(motion.frames.size(), 2u);
}

TEST(Bvh, RotationsComposeInChannelOrder) {
  const RecordedMotion motion = parseBvh(kHierarchy + kMotion, "clip.bvh");
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const RecordedFrame& frame = motion.frames[1];
  // 1e-7: angularDistance is an acos near 1.
  EXPECT_LT(frame.rotations[0].angularDistance(turn(10, z) * turn(20, x) * turn(30, y)), 1e-7);
  EXPECT_LT(frame.rotations[1].angularDistance(turn(40, y) * turn(50, z) * turn(60, x)), 1e-7);
  EXPECT_EQ(frame.positions.col(0), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(frame.positions.col(1), motion.joints[1].offset);
}

TEST(Bvh, TabsAndCarriageReturnsDontMatter) {
  std::string text = kHierarchy + kMotion;
  std::string dos;
  for (const char c : text) {
    dos += c == '\n' ? std::string("\r\n") : std::string(1, c == ' ' ? '\t' : c);
  }
  // Joint names keep their single spaces, whatever the separator was.
  const RecordedMotion a = parseBvh(text, "a");
  const RecordedMotion b = parseBvh(dos, "b");
  EXPECT_EQ(b.joints[1].name, a.joints[1].name);
  EXPECT_EQ(b.frames[1].rotations[1].coeffs(), a.frames[1].rotations[1].coeffs());
}

TEST(Bvh, ErrorsNameTheLine) {
  EXPECT_NE(
      errorOf(kHierarchy + "MOTION\nFrames: 1\nFrame Time: 0.1\n1 2 3\n").find("line 18"),
      std::string::npos);
  EXPECT_NE(
      errorOf(kHierarchy + "MOTION\nFrames: 3\nFrame Time: 0.1\n1 2 3 0 0 0 0 0 0\n")
          .find("after 1 of 3 frames"),
      std::string::npos);
  EXPECT_NE(
      errorOf(kHierarchy + kMotion + "0 0 0 0 0 0 0 0 0\n").find("line 20"), std::string::npos);
}

TEST(Bvh, DamagedFilesAreRefusedNotCrashedOn) {
  const std::string text = kHierarchy + kMotion;
  // Every prefix that lacks a needed part: cut anywhere before the last frame line ends.
  for (std::size_t length = 0; length + 20 < text.size(); length += 7) {
    EXPECT_THROW(parseBvh(text.substr(0, length), "cut"), FileError) << length;
  }
  const std::string noNumber =
      kHierarchy + "MOTION\nFrames: 1\nFrame Time: 0.1\n1 2 3 0 nan 0 0 0 0\n";
  EXPECT_THROW(parseBvh(noNumber, "nan"), FileError);
  EXPECT_THROW(parseBvh("HIERARCHY\nROOT a\n{\n CHANNELS 1 Wrotation\n", "w"), FileError);
  EXPECT_THROW(parseBvh("HIERARCHY\nROOT a\n{\n CHANNELS 99999999 Xrotation\n", "n"), FileError);
  EXPECT_THROW(
      parseBvh(kHierarchy + "MOTION\nFrames: 1\nFrame Time: 0\n0 0 0 0 0 0 0 0 0\n", "rate"),
      FileError);
  EXPECT_THROW(readBvh("/nonexistent/clip.bvh"), FileError);
}

}  // namespace
}  // namespace avatar
