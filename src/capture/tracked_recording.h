#pragma once

#include "avatar/body_model.h"
#include "avatar/motion.h"
#include "src/capture/observed_frame.h"
#include "src/input/capture_frame.h"
#include "src/input/depth_preparation.h"
#include "src/input/frame_source.h"
#include "src/input/ranged_source.h"
#include "src/tracking/body_tracker.h"

#include <Eigen/Geometry>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Poses that are known beforehand.
struct KnownPoses {
  avatar::Motion motion;  ///< a frame per number within the recording
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();  ///< of the poses' world
};

/// The body of the person in a recording.
struct TrackedPerson {
  const avatar::BodyModel& model;
  std::optional<Eigen::VectorXd> betas;           ///< absent: estimated along
  std::optional<OuterLayer> outer;                ///< its clothes, when they are known
  std::optional<KnownPoses> poses = {};           ///< instead of tracking
  bool armsApart = false;                         ///< see TrackerOptions
  std::optional<Eigen::Vector3d> usualLean = {};  ///< the same
};

/// A recording's frame with the person found in it.
struct TrackedFrame {
  int ordinal = 0;  ///< among the range's usable frames, from 0
  RgbdFrame picture;
  ObservedFrame observed;
  double inputMs = 0.0;  ///< wall time of reading and preparation
  double trackingMs = 0.0;
};

/// Where an interrupted capture stood.
struct TrackingState {
  int lastFrame = -1;  ///< number within the recording; −1: none yet
  TrackerState tracker;
};

/// Reads a recording frame by frame and follows a person through it: input, preparation, tracking.
/// Frames before the person is found are left out. Memory doesn't grow with the recording.
class TrackedRecording {
 public:
  /// Keeps a reference to the model. Throws avatar::FileError for a recording that can't be read,
  /// std::invalid_argument for a person that can't be tracked.
  TrackedRecording(const std::string& folder, TrackedPerson person, const FrameRange& range);

  /// The same of any source; `name` is what errors call it.
  TrackedRecording(
      std::unique_ptr<FrameSource> source,
      const std::string& name,
      TrackedPerson person,
      const FrameRange& range);

  /// The next frame with the person; nothing at the end. `recycled`: an earlier one whose memory
  /// may be used. Throws avatar::FileError.
  std::optional<TrackedFrame> next(TrackedFrame recycled = {});

  /// Goes on where another one of the same recording and person stood, from the first frame on:
  /// up to `state.lastFrame` frames are read and prepared, because what is background is learned
  /// from them, but their body isn't tracked.
  void resume(const TrackingState& state) { resumed_ = state; }

  TrackingState state() const;

  /// In the capture's world. Throws std::logic_error before the first frame.
  const avatar::Camera& camera() const;

  const RecordingInfo& info() const { return source_->info(); }

  /// Of the person: as given, or as estimated so far. Throws std::logic_error before the first
  /// frame.
  Eigen::VectorXd betas() const;

  /// As BodyTracker's. Throws std::logic_error before the first frame.
  Eigen::VectorXd clothWidths() const;

  /// Usable frames in the range, at most; 0 when nobody knows.
  int numFrames() const { return source_->info().numFrames.value_or(0); }

  /// Of the recording's own tracker. Throws std::logic_error before the first frame.
  const TrackerOptions& trackerOptions() const;

  int framesLeftOut() const { return framesLeftOut_; }  ///< before the person was found

  std::vector<std::string> warnings() const { return source_->warnings(); }

 private:
  void begin();
  bool wasCaptured(const RgbdFrame& picture) const;
  bool findBody(TrackedFrame& frame);
  TrackedBody knownBody(const RgbdFrame& picture) const;

  TrackedPerson person_;
  std::unique_ptr<FrameSource> source_;
  DepthPreparation preparation_;
  std::optional<avatar::Camera> camera_;  // once the person was found
  std::optional<BodyTracker> tracker_;    // none with known poses
  TrackerOptions trackerOptions_;
  std::optional<TrackingState> resumed_;
  int numRead_ = 0;
  int lastFrame_ = -1;
  int framesLeftOut_ = 0;
  std::optional<double> lastTime_;  // of a frame with the person [s]
};

}  // namespace simulcap
