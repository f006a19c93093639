#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/layered_avatar.h"
#include "src/capture/capture_pictures.h"
#include "src/capture/tracked_recording.h"
#include "src/evaluation/posed_avatar.h"
#include "src/output/contact_sheet.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Chooses moments that are spread over a capture, where a sequence has depth of the hidden side
/// among those frames.
class MomentChoice {
 public:
  MomentChoice(std::filesystem::path sequence, int numFrames);

  void add(const TrackedFrame& frame);

  /// With pictures, without geometry.
  const std::vector<CaptureMoment>& chosen() const { return chosen_; }

 private:
  std::filesystem::path sequence_;
  int numFrames_;
  std::vector<CaptureMoment> chosen_;
};

/// The same moments as several captures have them.
struct PicturedCapture {
  std::string name;
  std::vector<CaptureMoment> moments;
};

/// The moments of a capture's output folder, with what a camera measured of them and the geometry
/// that was captured. Throws avatar::FileError.
PicturedCapture readPicturedCapture(
    const std::filesystem::path& folder,
    std::vector<CaptureMoment> moments,
    const PosedAvatarBody& body);

/// Moments from left to right. On top what the camera measured, below how far each capture's
/// garments are from it, as in captureSheet(), coloured fully at `full` [m]. The paper's figure 11
/// for the camera of the recording, figure 10 for one that no capture used.
ContactSheet depthErrorSheet(
    const avatar::LayeredAvatar& avatar,
    const std::vector<PicturedCapture>& captures,
    const avatar::Camera& camera,
    double full);

/// Moments from left to right: what the camera saw, its depth, and the shape that each capture
/// gives it, seen from there. `bodyVertices`: what is looked at closely; none: all. The paper's
/// figure 9.
ContactSheet shapeSheet(
    const avatar::LayeredAvatar& avatar,
    const std::vector<PicturedCapture>& captures,
    const avatar::Camera& camera,
    const std::vector<int>& bodyVertices = {});

/// A second camera of the truth, which sees the hidden side.
struct BackView {
  avatar::Camera camera;               ///< in the capture's world
  std::vector<CaptureMoment> moments;  ///< those that it has depth of; without geometry
};

/// gt/depth_back of a sequence, where it has some of these moments; nothing when it has none.
/// `camera`: the recording's in the capture's world. Throws avatar::FileError.
std::optional<BackView> readBackView(
    const std::filesystem::path& sequence,
    const std::vector<CaptureMoment>& moments,
    const avatar::Camera& camera);

}  // namespace simulcap
