#include "avatar/io/prior_file.h"

#include "avatar/io/file_error.h"
#include "avatar/io/motion_file.h"
#include "avatar/io/npz.h"
#include "avatar/joint_limits.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

// The bytes of data/cmu_pose_prior.npz, from builtin_prior.S.
extern "C" const unsigned char simulcapCmuPosePrior[];
extern "C" const unsigned char simulcapCmuPosePriorEnd[];

namespace avatar {
namespace {

namespace fs = std::filesystem;

const NpyArray& priorArray(
    const NpzArrays& arrays, const std::string& key, const std::string& path) {
  const auto found = arrays.find(key);
  if (found == arrays.end() || found->second.type == NpyArray::Type::kText) {
    throw FileError(
        path, key, "missing; expected means (K, 69), covars (K, 69, 69) and weights (K)");
  }
  return found->second;
}

void requireShape(
    const NpyArray& array,
    const std::vector<std::int64_t>& shape,
    const std::string& path,
    const std::string& key) {
  if (array.shape != shape) {
    NpyArray wanted;
    wanted.shape = shape;
    throw FileError(path, key, "expected " + wanted.shapeText() + ", found " + array.shapeText());
  }
}

GaussianMixture mixtureFrom(const NpzArrays& arrays, const std::string& path) {
  constexpr int kSize = kNumPriorParameters;
  const NpyArray& means = priorArray(arrays, "means", path);
  if (means.shape.size() != 2 || means.shape[0] < 1 || means.shape[1] != kSize) {
    throw FileError(path, "means", "expected (K, 69) with K ≥ 1, found " + means.shapeText());
  }
  const std::int64_t count = means.shape[0];
  requireShape(priorArray(arrays, "covars", path), {count, kSize, kSize}, path, "covars");
  requireShape(priorArray(arrays, "weights", path), {count}, path, "weights");
  const Eigen::MatrixXd meanRows = means.asMatrix();
  const Eigen::MatrixXd covarianceRows = arrays.at("covars").asMatrix();
  GaussianMixture mixture;
  mixture.weights = arrays.at("weights").asMatrix().col(0);
  for (Eigen::Index k = 0; k < count; ++k) {
    mixture.means.emplace_back(meanRows.row(k));
    const Eigen::VectorXd row = covarianceRows.row(k);
    mixture.covariances.emplace_back(row.reshaped<Eigen::RowMajor>(kSize, kSize));
  }
  try {
    const PosePrior check(mixture);
  } catch (const std::invalid_argument& error) {
    throw FileError(path, "covars", std::string(error.what()) + "; export the mixture again");
  }
  return mixture;
}

bool isMotionFile(const fs::path& path) {
  return path.extension() == ".bvh" || path.extension() == ".npz";
}

std::vector<std::string> motionFiles(const std::string& folder) {
  std::error_code error;
  std::vector<std::string> files;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    if (it->is_regular_file(error) && isMotionFile(it->path())) {
      files.push_back(it->path().string());
    }
  }
  if (error) {
    throw FileError(folder, "", "cannot be listed: " + error.message());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// A T-pose, as many files start with for calibration.
bool isCalibration(const BodyPose& pose) {
  constexpr double kNearlyRest = 0.4;  // [rad] over all joints; arms alone at the sides give 1.8
  return pose.jointRotations.tail<kNumPriorParameters>().norm() < kNearlyRest;
}

/// Far beyond what joints can do: a flaw of the recording, such as a foot turned back to front.
bool isImpossible(const BodyPose& pose, const JointLimits& limits) {
  constexpr double kFarBeyond = 0.5;  // [rad]
  return (limits.evaluate(pose).residual.array().abs() > kFarBeyond).any();
}

int addPoses(const std::string& file, double framesPerSecond, std::vector<BodyPose>& poses) {
  const Motion motion = readMotion(file).motion;
  const double rate = std::min(framesPerSecond, motion.framesPerSecond);
  const JointLimits limits = humanJointLimits();
  int count = 0;
  for (const BodyPose& pose : resampled(motion, rate).frames) {
    if (!isCalibration(pose) && !isImpossible(pose, limits)) {
      poses.push_back(pose);
      ++count;
    }
  }
  return count;
}

}  // namespace

GaussianMixture readPrior(const std::string& path) {
  return mixtureFrom(readNpz(path, {"means", "covars", "weights"}), path);
}

void writePrior(const std::string& path, const GaussianMixture& mixture) {
  const PosePrior check(mixture);
  constexpr int kSize = kNumPriorParameters;
  const int count = mixture.numComponents();
  Eigen::MatrixXd means(count, kSize);
  Eigen::MatrixXd covariances(count, kSize * kSize);
  for (int k = 0; k < count; ++k) {
    means.row(k) = mixture.means[k];
    covariances.row(k) = mixture.covariances[k].reshaped();
  }
  NpzArrays arrays;
  arrays["means"] = NpyArray::fromMatrix(means, NpyArray::Type::kFloat32);
  arrays["covars"] = NpyArray::fromMatrix(covariances, NpyArray::Type::kFloat32);
  arrays["covars"].shape = {count, kSize, kSize};
  arrays["weights"] = NpyArray::fromMatrix(mixture.weights);
  arrays["weights"].shape = {count};
  writeNpz(path, arrays);
}

GaussianMixture builtInPrior() {
  const auto size = static_cast<std::size_t>(simulcapCmuPosePriorEnd - simulcapCmuPosePrior);
  const std::string name = "built-in pose prior";
  return mixtureFrom(readNpzFromMemory(simulcapCmuPosePrior, size, name), name);
}

PriorFolderFit fitPriorFromFolder(const std::string& folder, const PriorFolderOptions& options) {
  options.fit.validate();
  if (!(options.framesPerSecond >= 1.0 && options.framesPerSecond <= 240.0)) {
    throw std::invalid_argument("PriorFolderOptions: framesPerSecond must be within 1 … 240");
  }
  PriorFolderFit result;
  std::vector<BodyPose> poses;
  for (const std::string& file : motionFiles(folder)) {
    try {
      result.posesPerFile.push_back(addPoses(file, options.framesPerSecond, poses));
      result.usedFiles.push_back(file);
    } catch (const FileError& error) {
      result.skippedFiles.emplace_back(error.what());
    }
  }
  if (poses.size() < 2U * static_cast<unsigned>(options.fit.numComponents)) {
    throw FileError(
        folder,
        "",
        "holds " + std::to_string(poses.size()) + " poses in " +
            std::to_string(result.usedFiles.size()) +
            " readable motions (.bvh, .npz); a prior of " +
            std::to_string(options.fit.numComponents) + " components needs more");
  }
  result.fit = fitPoseMixture(poses, options.fit);
  return result;
}

}  // namespace avatar
