#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/camera.h"
#include "avatar/layered_avatar.h"
#include "src/capture/capture_checkpoint.h"
#include "src/capture/capture_figures.h"
#include "src/capture/capture_pictures.h"
#include "src/capture/tracked_recording.h"
#include "src/capture_session.h"
#include "src/output/performance_file.h"

#include <nlohmann/json_fwd.hpp>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// What is captured, for those who write it down.
struct CaptureOutputSetup {
  const avatar::LayeredAvatar& avatar;
  std::shared_ptr<const avatar::BodyModel> model;
  std::string settings;  ///< all that decides about the result, beside recording and avatar
  double framesPerSecond = 30.0;
  int numFrames = 0;            ///< that are expected
  bool resume = false;          ///< go on where an interrupted capture stood, if there is one
  int checkpointInterval = 20;  ///< frames that an interruption may cost, ≥ 1
  bool tracked = false;         ///< frames tell how far off each joint may be
};

/// Captured frames on their way into the output folder: avatar.glb at the beginning;
/// performance.npz frame by frame; camera.json, performance.glb (every n-th frame of long captures)
/// and contact_sheet.png at the end. Each file appears whole or not at all. What an interrupted
/// capture needs to go on lies in checkpoint.npz, which close() removes, and performance.npz.parts.
/// Memory doesn't grow with the frames.
class CaptureOutput {
 public:
  /// Keeps a reference to the avatar. Throws avatar::FileError when the folder can't be written, or
  /// holds the beginning of another capture that `resume` can't go on from.
  CaptureOutput(std::filesystem::path folder, CaptureOutputSetup setup);

  /// Where the capture that is gone on with stood; nothing when it begins anew.
  const std::optional<CaptureCheckpoint>& resumed() const { return resumed_; }

  bool isCaptured(const TrackedFrame& frame) const {
    return resumed_ && frame.picture.index <= resumed_->tracking.lastFrame;
  }

  /// A frame of the capture that is gone on with; of some, the pictures are wanted again.
  void addCaptured(const TrackedFrame& frame) { keepPicture(frame); }

  void add(const TrackedFrame& frame, const CaptureResult& result, const avatar::Camera& camera);

  bool wantsCheckpoint() const;

  /// Lets the capture be gone on with after its last frame. Returns the cloth as it was written,
  /// for the session to go on from as a resumed one does.
  CaptureState checkpointed(const TrackingState& tracking, CaptureState cloth);

  /// Writes what is written at the end. Throws avatar::FileError.
  void finish(const avatar::Camera& camera);

  /// Everything is written, by others as well: there is nothing to go on with.
  void close();

  /// Frames that a resumed capture needn't capture again.
  std::int64_t numKept() const { return numFrames_ - numFrames_ % setup_.checkpointInterval; }

  std::int64_t numFrames() const { return numFrames_; }

  const CaptureFigures& figures() const { return figures_; }

 private:
  std::string path(const char* name) const { return (folder_ / name).string(); }

  PerformanceLayout layout() const;
  void resume();
  void begin();
  void keepPicture(const TrackedFrame& frame);
  void writeFromPerformance(const avatar::Camera& camera);
  void writeViewersFile(const std::vector<PerformanceFrame>& frames, int stride) const;

  std::filesystem::path folder_;
  CaptureOutputSetup setup_;
  std::optional<CaptureCheckpoint> resumed_;
  std::optional<PerformanceWriter> performance_;  // none: no frame yet, or it is finished
  std::int64_t numFrames_ = 0;
  CaptureFigures figures_;
  std::vector<CaptureMoment> moments_;  // without geometry
  std::optional<int> firstIndex_;       // number of the first frame within the recording
  int nextMoment_ = 0;                  // of the contact sheet
};

}  // namespace simulcap
