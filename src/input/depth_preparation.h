#pragma once

#include "src/input/capture_frame.h"
#include "src/input/depth_cleaning.h"
#include "src/input/depth_cloud.h"
#include "src/input/depth_surface.h"
#include "src/input/person_tracker.h"
#include "src/input/rgbd_frame.h"

#include <optional>

namespace simulcap {

struct DepthPreparationOptions {
  DepthCleaningOptions cleaning;
  NormalOptions normals;
  /// Where up is, in the camera's frame, when it is known (an accelerometer, a levelled camera); a
  /// floor in sight within 6° of it is more exact and wins.
  std::optional<Eigen::Vector3f> up;

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// From the frames of a fixed camera, in order, to clean depth with the person told from the rest.
/// The first frame with depth in a twentieth of its pixels tells the floor and the walls, the first
/// person found (the most central) is the one followed, and defines the capture's world.
class DepthPreparation {
 public:
  explicit DepthPreparation(
      const avatar::Camera& camera, const DepthPreparationOptions& options = {});

  /// `recycled`: an earlier result that is no longer needed; its memory serves the new one, which
  /// halves the time. Throws std::invalid_argument when the frame has another size than the camera.
  DepthCloud operator()(const RgbdFrame& frame, DepthCloud recycled = {});

  /// The capture's world; nothing until a person was found.
  const std::optional<CaptureFrame>& captureFrame() const { return captureFrame_; }

 private:
  avatar::Camera camera_;
  DepthPreparationOptions options_;
  std::optional<PersonTracker> tracker_;
  std::optional<CaptureFrame> captureFrame_;
};

/// The cloud with the person's pixels from the person's cells: pixels in and around them at their
/// depth and off the floor. The cloud must have a size, depth and nobody in it.
DepthCloud withPerson(
    DepthCloud cloud,
    const avatar::Camera& camera,
    const CoarseDepth& coarse,
    const std::vector<std::uint8_t>& personCells,
    const std::optional<Plane>& floor);

/// The capture's world from the first frame's person.
CaptureFrame captureFrameOf(
    const CoarseDepth& coarse,
    const std::vector<std::uint8_t>& personCells,
    const SceneLayout& layout,
    bool upGiven);

}  // namespace simulcap
