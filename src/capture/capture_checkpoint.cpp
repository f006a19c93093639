#include "src/capture/capture_checkpoint.h"

#include "avatar/io/file_error.h"
#include "avatar/io/npz.h"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

namespace simulcap {
namespace {

using avatar::NpyArray;
using avatar::NpzArrays;

NpyArray poseArray(const avatar::BodyPose& pose) {
  Eigen::VectorXd values(pose.jointRotations.size() + 3);
  values << pose.jointRotations, pose.translation;
  return NpyArray::fromMatrix(values);
}

avatar::BodyPose poseOf(const NpyArray& array) {
  const Eigen::VectorXd values = array.asMatrix();
  if (values.size() < 3)
    throw std::invalid_argument("a pose has a translation");
  return {values.head(values.size() - 3), values.tail<3>()};
}

void addTracking(const TrackingState& tracking, NpzArrays& arrays) {
  const TrackerState& tracker = tracking.tracker;
  Eigen::VectorXd values(6);
  values << tracking.lastFrame, tracker.framesTracked, tracker.framesLost, tracker.timestamp,
      tracker.timestampBefore, tracker.betasHeld ? 1.0 : 0.0;
  arrays["tracking"] = NpyArray::fromMatrix(values);
  arrays["tracking_pose"] = poseArray(tracker.pose);
  arrays["tracking_pose_before"] = poseArray(tracker.before);
  arrays["tracking_betas"] = NpyArray::fromMatrix(tracker.betas);
  arrays["tracking_unseen_seconds"] = NpyArray::fromMatrix(Eigen::Map<const Eigen::VectorXd>(
      tracker.unseenSeconds.data(), static_cast<Eigen::Index>(tracker.unseenSeconds.size())));
  arrays["tracking_bareness"] = NpyArray::fromMatrix(tracker.bareness);
  arrays["tracking_cloth_offsets"] = NpyArray::fromMatrix(tracker.clothOffsets);
  arrays["tracking_beta_information"] = NpyArray::fromMatrix(tracker.betaInformation);
  arrays["tracking_pose_information"] = NpyArray::fromMatrix(tracker.poseInformation);
}

TrackingState trackingOf(const NpzArrays& arrays) {
  const Eigen::VectorXd values = arrays.at("tracking").asMatrix();
  if (values.size() != 6)
    throw std::invalid_argument("six numbers are expected in `tracking`");
  TrackingState tracking{.lastFrame = static_cast<int>(values[0])};
  TrackerState& tracker = tracking.tracker;
  tracker.framesTracked = static_cast<int>(values[1]);
  tracker.framesLost = static_cast<int>(values[2]);
  tracker.timestamp = values[3];
  tracker.timestampBefore = values[4];
  tracker.betasHeld = values[5] != 0.0;
  tracker.pose = poseOf(arrays.at("tracking_pose"));
  tracker.before = poseOf(arrays.at("tracking_pose_before"));
  tracker.betas = arrays.at("tracking_betas").asMatrix();
  tracker.bareness = arrays.at("tracking_bareness").asMatrix();
  tracker.clothOffsets = arrays.at("tracking_cloth_offsets").asMatrix();
  tracker.betaInformation = arrays.at("tracking_beta_information").asMatrix();
  tracker.poseInformation = arrays.at("tracking_pose_information").asMatrix();
  const Eigen::VectorXd unseen = arrays.at("tracking_unseen_seconds").asMatrix();
  if (unseen.size() != static_cast<Eigen::Index>(tracker.unseenSeconds.size()))
    throw std::invalid_argument("a time is expected per tracked joint");
  std::copy(unseen.begin(), unseen.end(), tracker.unseenSeconds.begin());
  return tracking;
}

/// 3 × N.
Eigen::Matrix3Xd pointsOf(const NpyArray& array) {
  Eigen::MatrixXd points = array.asMatrix();
  if (points.rows() != 3)
    throw std::invalid_argument("points have three rows");
  return points;
}

std::string garmentKey(std::size_t garment, const char* what) {
  return "garment_" + std::to_string(garment) + "_" + what;
}

void addCloth(const CaptureState& cloth, NpzArrays& arrays) {
  arrays["body_vertices"] = NpyArray::fromMatrix(cloth.bodyVertices);
  arrays["body_pose"] = poseArray(cloth.pose);
  for (std::size_t i = 0; i < cloth.garments.size(); ++i) {
    const CaptureState::Garment& garment = cloth.garments[i];
    arrays[garmentKey(i, "positions")] = NpyArray::fromMatrix(garment.positions);
    arrays[garmentKey(i, "velocities")] = NpyArray::fromMatrix(garment.velocities);
    arrays[garmentKey(i, "followed")] = NpyArray::fromMatrix(garment.followed);
    arrays[garmentKey(i, "offsets")] = NpyArray::fromMatrix(garment.offsets.cast<double>());
  }
  for (std::size_t i = 0; i < cloth.warps.size(); ++i)
    arrays["warp_" + std::to_string(i)] = NpyArray::fromMatrix(cloth.warps[i]);
}

CaptureState clothOf(const NpzArrays& arrays) {
  CaptureState cloth{
      .bodyVertices = pointsOf(arrays.at("body_vertices")), .pose = poseOf(arrays.at("body_pose"))};
  for (std::size_t i = 0; arrays.count(garmentKey(i, "positions")) > 0; ++i)
    cloth.garments.push_back(
        {pointsOf(arrays.at(garmentKey(i, "positions"))),
         pointsOf(arrays.at(garmentKey(i, "velocities"))),
         pointsOf(arrays.at(garmentKey(i, "followed"))),
         arrays.at(garmentKey(i, "offsets")).asMatrix().cast<float>()});
  for (std::size_t i = 0; arrays.count("warp_" + std::to_string(i)) > 0; ++i)
    cloth.warps.push_back(arrays.at("warp_" + std::to_string(i)).asMatrix());
  return cloth;
}

}  // namespace

void writeCheckpoint(const std::string& path, const CaptureCheckpoint& checkpoint) {
  NpzArrays arrays = checkpoint.figures.state();
  arrays["settings"] = NpyArray::fromText(checkpoint.settings);
  arrays["num_frames"] =
      NpyArray::fromMatrix(Eigen::VectorXd::Constant(1, static_cast<double>(checkpoint.numFrames)));
  addTracking(checkpoint.tracking, arrays);
  addCloth(checkpoint.cloth, arrays);
  avatar::writeNpz(path, arrays);
}

CaptureCheckpoint readCheckpoint(const std::string& path) {
  const NpzArrays arrays = avatar::readNpz(path);
  try {
    CaptureCheckpoint checkpoint;
    checkpoint.settings = arrays.at("settings").asText();
    checkpoint.numFrames = static_cast<std::int64_t>(arrays.at("num_frames").at(0));
    checkpoint.tracking = trackingOf(arrays);
    checkpoint.cloth = clothOf(arrays);
    checkpoint.figures.restore(arrays);
    return checkpoint;
  } catch (const std::logic_error& error) {
    throw avatar::FileError(
        path,
        "",
        std::string("is not what a capture leaves (") + error.what() +
            "); start anew without --resume");
  }
}

}  // namespace simulcap
