#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"
#include "avatar/digitization/posed_frame.h"
#include "avatar/geometry/camera.h"
#include "src/input/depth_cloud.h"
#include "src/input/frame_source.h"
#include "src/input/rgbd_frame.h"
#include "src/tracking/outer_layer.h"

#include <Eigen/Core>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

struct TurnOptions {
  std::optional<int> frames;  ///< the turn is the first frames, ≥ 1; absent: found
  int mostFrames = 100;       ///< that are kept of it, evenly spread, ≥ 2
  double wholeTurn = 330.0;   ///< a found turn ends when it has covered this [deg], 1 … 360
  std::optional<Eigen::VectorXd> betas;  ///< the person's shape; absent: estimated over the turn
  /// Called after every frame with the number of those done and of all, which may still shrink.
  std::function<void(int done, int total)> progress = {};

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// A person turning round before a camera, with its body tracked.
struct Turn {
  avatar::Camera camera;                        ///< of whole pictures, in the capture's world
  Eigen::VectorXd betas;                        ///< as given, or as estimated over the turn
  std::vector<avatar::PosedDepthFrame> frames;  ///< cut to the person's box; lost ones left out
  std::vector<int> numbers;                     ///< of the frames within the recording
  int framesTaken = 0;                          ///< of the recording that the turn takes up
  int framesRead = 0;                           ///< with the person
  int framesLost = 0;                           ///< in which the body's pose isn't known
  double degreesSeen = 0.0;                     ///< sides of the person that were seen, 0 … 360
  double inputSeconds = 0.0, trackingSeconds = 0.0;
  std::vector<std::string> warnings;
};

/// Tracks the turn twice: to learn the shape, then with that shape. Keeps a reference to the model
/// during the call. Throws avatar::FileError when the recording can't be read or shows nobody.
Turn trackTurn(
    const FrameSupply& recording, const avatar::BodyModel& model, const TurnOptions& options = {});

/// How far a person has turned since the first of its poses, either way.
class TurnedAngle {
 public:
  void add(const avatar::BodyPose& pose);

  double degrees() const;  ///< ≥ 0

 private:
  double turned_ = 0.0;         // [rad]
  std::optional<double> last_;  // heading [rad]
};

/// A person's shape and clothes, as far as they are known.
struct KnownPerson {
  Eigen::VectorXd betas;
  std::optional<OuterLayer> clothes;         ///< absent: none were found
  std::optional<Eigen::Vector3d> usualLean;  ///< see TrackerOptions
};

/// Tracks a turn once more, now that the person is known: skin under cloth is no longer taken for
/// what depth shows. Clothes of unknown width cost another pass, in which the whole turn tells it.
/// Throws avatar::FileError.
Turn trackAgain(
    const Turn& turn,
    const FrameSupply& recording,
    const avatar::BodyModel& model,
    const KnownPerson& person,
    const TurnOptions& options = {});

/// The sides of a person that a camera saw, from the headings relative to it [rad]: in steps of 10
/// degrees, each frame showing the 90 degrees about its own [deg].
double seenSides(const std::vector<double>& headings);

/// The person's part of a frame. `pose`: of the body, in the camera's world.
avatar::PosedDepthFrame posedFrame(
    const avatar::Camera& camera,
    const RgbdFrame& picture,
    const DepthCloud& cloud,
    const avatar::BodyPose& pose);

}  // namespace simulcap
