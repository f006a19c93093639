#include "avatar/io/motion_file.h"

#include "avatar/io/file_error.h"
#include "avatar/io/npz.h"
#include "avatar/io/prior_file.h"
#include "avatar/motion_clips.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <fstream>

namespace avatar {
namespace {

using test::TemporaryFolder;

NpzArrays arraysOf(int numFrames, int width) {
  NpzArrays arrays;
  Eigen::MatrixXd poses(numFrames, width);
  for (int i = 0; i < numFrames; ++i) {
    poses.row(i) = Eigen::RowVectorXd::LinSpaced(width, 0.0, 0.01 * (width - 1));
  }
  arrays["poses"] = NpyArray::fromMatrix(poses);
  arrays["trans"] = NpyArray::fromMatrix(Eigen::MatrixXd::Constant(numFrames, 3, 0.5));
  arrays["mocap_framerate"] = NpyArray::fromMatrix(Eigen::MatrixXd::Constant(1, 1, 120.0));
  return arrays;
}

std::string errorOf(const TemporaryFolder& folder, const NpzArrays& arrays) {
  writeNpz(folder.path("bad.npz"), arrays);
  try {
    readMotion(folder.path("bad.npz"));
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(MotionFile, WritesAndReadsBackWithoutLoss) {
  const TemporaryFolder folder;
  Motion motion = makeClip("walk");
  motion.betas = Eigen::VectorXd::LinSpaced(10, -1.0, 1.0);
  writeMotion(folder.path("walk.npz"), motion);
  const Motion back = readMotion(folder.path("walk.npz")).motion;
  EXPECT_EQ(back.framesPerSecond, motion.framesPerSecond);
  EXPECT_EQ(back.betas, motion.betas);
  ASSERT_EQ(back.frames.size(), motion.frames.size());
  EXPECT_EQ(back.frames[50].jointRotations, motion.frames[50].jointRotations);
  EXPECT_EQ(back.frames[50].translation, motion.frames[50].translation);
}

TEST(MotionFile, TakesTheBodyJointsOfLargerModels) {
  const TemporaryFolder folder;
  for (const int width : {156, 165}) {
    writeNpz(folder.path("a.npz"), arraysOf(2, width));
    const Motion motion = readMotion(folder.path("a.npz")).motion;
    const Eigen::VectorXd& pose = motion.frames[1].jointRotations;
    ASSERT_EQ(pose.size(), 72);
    EXPECT_NEAR(pose[65], 0.65, 1e-12);
    // Columns 66 … 71 are fingers (SMPL+H) or jaw and eye (SMPL-X), not SMPL's hands.
    EXPECT_EQ(pose.tail<6>().norm(), 0.0);
  }
  writeNpz(folder.path("a.npz"), arraysOf(2, 72));
  EXPECT_NEAR(readMotion(folder.path("a.npz")).motion.frames[0].jointRotations[71], 0.71, 1e-12);
}

TEST(MotionFile, UpAxisKeyAndOptionTurnTheClip) {
  const TemporaryFolder folder;
  NpzArrays arrays = arraysOf(2, 72);
  writeNpz(folder.path("y.npz"), arrays);
  arrays["up_axis"] = NpyArray::fromText("z");
  writeNpz(folder.path("z.npz"), arrays);
  MotionFileOptions zUp;
  zUp.up = UpAxis::kZ;
  const BodyPose byKey = readMotion(folder.path("z.npz")).motion.frames[0];
  const BodyPose byOption = readMotion(folder.path("y.npz"), zUp).motion.frames[0];
  EXPECT_EQ(byKey.jointRotations, byOption.jointRotations);
  // (x, y, z) with Z up is (x, z, −y) with Y up; the default pelvis is at the origin.
  EXPECT_LT((byKey.translation - Eigen::Vector3d(0.5, 0.5, -0.5)).norm(), 1e-12);
}

TEST(MotionFile, ErrorsNameFileAndKey) {
  const TemporaryFolder folder;
  const auto expectKey = [&](const NpzArrays& arrays, const std::string& key) {
    const std::string error = errorOf(folder, arrays);
    EXPECT_NE(error.find("bad.npz: " + key), std::string::npos) << key << ": " << error;
  };
  expectKey(arraysOf(2, 75), "poses");
  NpzArrays arrays = arraysOf(2, 72);
  arrays.erase("trans");
  expectKey(arrays, "trans");
  arrays = arraysOf(2, 72);
  arrays["trans"] = NpyArray::fromMatrix(Eigen::MatrixXd::Zero(3, 3));
  expectKey(arrays, "trans");
  for (const double rate : {0.0, -30.0, 1e9, std::nan("")}) {
    arrays = arraysOf(2, 72);
    arrays["mocap_framerate"] = NpyArray::fromMatrix(Eigen::MatrixXd::Constant(1, 1, rate));
    expectKey(arrays, "mocap_framerate");
  }
  arrays = arraysOf(2, 72);
  arrays["up_axis"] = NpyArray::fromText("x");
  expectKey(arrays, "up_axis");
  EXPECT_THROW(readMotion(folder.path("clip.fbx")), FileError);
}

TEST(MotionFile, FewBadFramesAreRepairedManyAreRefused) {
  const TemporaryFolder folder;
  NpzArrays arrays = arraysOf(40, 72);
  Eigen::MatrixXd poses = arrays["poses"].asMatrix();
  poses(7, 3) = std::nan("");
  arrays["poses"] = NpyArray::fromMatrix(poses);
  writeNpz(folder.path("a.npz"), arrays);
  const MotionFile file = readMotion(folder.path("a.npz"));
  EXPECT_EQ(file.warnings.size(), 1u);
  EXPECT_NEAR(file.motion.frames[7].jointRotations[3], 0.03, 1e-9);
  poses.topRows(10).setConstant(std::nan(""));
  arrays["poses"] = NpyArray::fromMatrix(poses);
  EXPECT_NE(errorOf(folder, arrays).find("10 of 40"), std::string::npos);
}

TEST(PriorFile, WritesReadsAndRefusesWhatIsNoCovariance) {
  const TemporaryFolder folder;
  const GaussianMixture mixture = builtInPrior();
  writePrior(folder.path("p.npz"), mixture);
  const GaussianMixture back = readPrior(folder.path("p.npz"));
  EXPECT_EQ(back.numComponents(), mixture.numComponents());
  EXPECT_EQ(back.means[0], mixture.means[0]);  // both are float32 values
  NpzArrays arrays = readNpz(folder.path("p.npz"));
  Eigen::MatrixXd covariances = arrays["covars"].asMatrix();
  covariances(0, 0) = -1.0;
  const auto shape = arrays["covars"].shape;
  arrays["covars"] = NpyArray::fromMatrix(covariances);
  arrays["covars"].shape = shape;
  writeNpz(folder.path("p.npz"), arrays);
  EXPECT_THROW(readPrior(folder.path("p.npz")), FileError);
  arrays.erase("weights");
  writeNpz(folder.path("p.npz"), arrays);
  EXPECT_THROW(readPrior(folder.path("p.npz")), FileError);
}

TEST(PriorFile, BuiltInPriorPrefersNaturalPoses) {
  const PosePrior prior(builtInPrior());
  for (const BodyPose& pose : makeClip("walk").frames) {
    BodyPose unnatural = pose;
    unnatural.jointRotations[3 * kLeftElbow + 1] = 1.5;  // bent backwards
    EXPECT_LT(prior.energy(pose), prior.energy(unnatural));
    unnatural = pose;
    unnatural.jointRotations[3 * kRightKnee] = -1.2;
    EXPECT_LT(prior.energy(pose), prior.energy(unnatural));
  }
}

TEST(PriorFile, FolderFitReportsWhatItUsedAndSkipped) {
  const TemporaryFolder folder;
  writeMotion(folder.path("walk.npz"), makeClip("walk"));
  writeMotion(folder.path("squat.npz"), makeClip("squat"));
  std::ofstream(folder.path("broken.bvh")) << "HIERARCHY\n";
  PriorFolderOptions options;
  options.fit.numComponents = 2;
  const PriorFolderFit result = fitPriorFromFolder(folder.path(), options);
  ASSERT_EQ(result.usedFiles.size(), 2u);
  EXPECT_NE(result.usedFiles[0].find("squat.npz"), std::string::npos);
  ASSERT_EQ(result.skippedFiles.size(), 1u);
  EXPECT_EQ(result.fit.numSamples, 2 * (result.posesPerFile[0] + result.posesPerFile[1]));
  EXPECT_THROW(fitPriorFromFolder(folder.path("nothing")), FileError);
}

}  // namespace
}  // namespace avatar
