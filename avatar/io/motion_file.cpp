#include "avatar/io/motion_file.h"

#include "avatar/io/bvh.h"
#include "avatar/io/file_error.h"
#include "avatar/io/npz.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

namespace avatar {
namespace {

constexpr int kNumBodyJoints = 22;  // of SMPL+H and SMPL-X that SMPL shares

const NpyArray& motionArray(
    const NpzArrays& arrays, const std::string& key, const std::string& path) {
  const auto found = arrays.find(key);
  if (found == arrays.end()) {
    throw FileError(path, key, "missing; expected the AMASS keys poses, trans, mocap_framerate");
  }
  if (found->second.type == NpyArray::Type::kText) {
    throw FileError(path, key, "expected numbers, found text");
  }
  return found->second;
}

double readRate(const NpzArrays& arrays, const std::string& path) {
  const std::string key =
      arrays.count("mocap_frame_rate") != 0 ? "mocap_frame_rate" : "mocap_framerate";
  const NpyArray& array = motionArray(arrays, key, path);
  const double rate = array.size() == 1 ? array.at(0) : 0.0;
  if (!(rate >= 1.0 && rate <= 10000.0)) {
    throw FileError(
        path, key, "expected one number within 1 … 10000 frames/s; correct the recording's rate");
  }
  return rate;
}

Eigen::MatrixXd readPoses(const NpzArrays& arrays, const std::string& path) {
  const NpyArray& array = motionArray(arrays, "poses", path);
  const bool isTable = array.shape.size() == 2 && array.shape[0] > 0;
  const std::int64_t width = isTable ? array.shape[1] : 0;
  if (width != 72 && width != 156 && width != 165) {
    throw FileError(
        path,
        "poses",
        "expected (T, 72) SMPL, (T, 156) SMPL+H or (T, 165) SMPL-X with T ≥ 1, found " +
            array.shapeText());
  }
  return array.asMatrix();
}

Eigen::MatrixXd readTranslations(
    const NpzArrays& arrays, const std::string& path, Eigen::Index numFrames) {
  const NpyArray& array = motionArray(arrays, "trans", path);
  if (array.shape != std::vector<std::int64_t>{numFrames, 3}) {
    throw FileError(
        path,
        "trans",
        "expected (" + std::to_string(numFrames) + ", 3) as many as poses, found " +
            array.shapeText());
  }
  return array.asMatrix();
}

Eigen::VectorXd readBetas(const NpzArrays& arrays, const std::string& path) {
  if (arrays.count("betas") == 0) {
    return {};
  }
  const Eigen::MatrixXd betas = motionArray(arrays, "betas", path).asMatrix();
  if (!betas.allFinite()) {
    throw FileError(path, "betas", "expected finite numbers");
  }
  return betas.reshaped<Eigen::RowMajor>();
}

UpAxis fileUp(const NpzArrays& arrays, const std::string& path) {
  const auto found = arrays.find("up_axis");
  if (found == arrays.end()) {
    return UpAxis::kY;
  }
  const bool isText = found->second.type == NpyArray::Type::kText && found->second.size() == 1;
  const std::string text = isText ? found->second.asText() : "";
  if (text == "z" || text == "Z") {
    return UpAxis::kZ;
  }
  if (text == "y" || text == "Y") {
    return UpAxis::kY;
  }
  throw FileError(path, "up_axis", "expected \"y\" or \"z\"");
}

/// Repairs single bad frames; a file with more than a tenth of them is refused.
Motion repairedFile(
    const Motion& motion, const std::string& path, std::vector<std::string>& warnings) {
  const MotionCheck check = checked(motion);
  const auto allowed = static_cast<int>(motion.frames.size() / 10);
  if (check.numInvalid > allowed) {
    throw FileError(
        path,
        "poses",
        std::to_string(check.numInvalid) + " of " + std::to_string(motion.frames.size()) +
            " frames hold values that are not finite; repair or cut the recording");
  }
  if (check.numInvalid == 0) {
    return motion;
  }
  for (const std::string& warning : check.warnings) {
    std::string line = path;
    line.append(": ").append(warning).append("; interpolated");
    warnings.push_back(line);
  }
  return repaired(motion);
}

MotionFile readNpzMotion(const std::string& path, const MotionFileOptions& options) {
  const NpzArrays arrays =
      readNpz(path, {"poses", "trans", "betas", "mocap_framerate", "mocap_frame_rate", "up_axis"});
  const Eigen::MatrixXd poses = readPoses(arrays, path);
  const Eigen::MatrixXd translations = readTranslations(arrays, path, poses.rows());
  MotionFile file;
  file.motion.framesPerSecond = readRate(arrays, path);
  file.motion.betas = readBetas(arrays, path);
  const Eigen::Index used = poses.cols() == 72 ? 72 : 3 * kNumBodyJoints;
  for (Eigen::Index i = 0; i < poses.rows(); ++i) {
    BodyPose pose;
    pose.jointRotations.head(used) = poses.row(i).head(used);
    pose.translation = translations.row(i);
    file.motion.frames.push_back(pose);
  }
  file.motion = repairedFile(file.motion, path, file.warnings);
  const UpAxis up = options.up == UpAxis::kAuto ? fileUp(arrays, path) : options.up;
  if (up == UpAxis::kZ) {
    file.motion = fromZUp(file.motion, options.body.joints.col(kPelvis));
  }
  if (options.placeOnFloor) {
    file.motion = placedOnFloor(file.motion, options.body);
  }
  return file;
}

MotionFile readBvhMotion(const std::string& path, const MotionFileOptions& options) {
  RetargetOptions retarget;
  retarget.up = options.up;
  retarget.body = options.body;
  const RecordedMotion recording = readBvh(path);
  try {
    return {retargeted(recording, retarget).motion, {}};
  } catch (const std::invalid_argument& error) {
    throw FileError(path, "HIERARCHY", error.what());
  }
}

std::string extensionOf(const std::string& path) {
  const std::size_t dot = path.find_last_of('.');
  std::string extension = dot == std::string::npos ? "" : path.substr(dot);
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return extension;
}

}  // namespace

MotionFile readMotion(const std::string& path, const MotionFileOptions& options) {
  validate(options.body);
  const std::string extension = extensionOf(path);
  if (extension == ".npz") {
    return readNpzMotion(path, options);
  }
  if (extension == ".bvh") {
    return readBvhMotion(path, options);
  }
  throw FileError(path, "", "expected a motion as .npz (AMASS keys) or .bvh");
}

void writeMotion(const std::string& path, const Motion& motion) {
  if (motion.frames.empty() || checked(motion).numInvalid > 0) {
    throw std::invalid_argument("writeMotion: every frame must be valid, and there must be one");
  }
  const auto numFrames = static_cast<Eigen::Index>(motion.frames.size());
  Eigen::MatrixXd poses(numFrames, 3 * kNumSmplJoints);
  Eigen::MatrixXd translations(numFrames, 3);
  for (Eigen::Index i = 0; i < numFrames; ++i) {
    poses.row(i) = motion.frames[i].jointRotations;
    translations.row(i) = motion.frames[i].translation;
  }
  NpzArrays arrays;
  arrays["poses"] = NpyArray::fromMatrix(poses);
  arrays["trans"] = NpyArray::fromMatrix(translations);
  arrays["betas"] = NpyArray::fromMatrix(motion.betas);
  arrays["betas"].shape = {motion.betas.size()};
  arrays["mocap_framerate"] =
      NpyArray::fromMatrix(Eigen::MatrixXd::Constant(1, 1, motion.framesPerSecond));
  arrays["mocap_framerate"].shape = {};
  arrays["up_axis"] = NpyArray::fromText("y");
  writeNpz(path, arrays);
}

}  // namespace avatar
