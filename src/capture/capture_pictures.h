#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/shading.h"
#include "avatar/layered_avatar.h"
#include "src/capture/tracked_recording.h"
#include "src/output/body_view.h"
#include "src/output/contact_sheet.h"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace simulcap {

/// A moment of a capture as it is pictured: what the camera saw, and what was captured.
struct CaptureMoment {
  std::string label;
  int recordingIndex = 0;
  avatar::ColorImage color;                ///< of the camera; empty: none
  std::vector<float> depth;                ///< W·H [m]; 0 where the person is not
  Eigen::Matrix3Xd body;                   ///< 3 × V [m], in the world
  std::vector<Eigen::Matrix3Xd> garments;  ///< 3 × N [m] each, in the world
};

/// What the camera saw of the person, without what was captured.
CaptureMoment pictureMoment(const TrackedFrame& frame);

/// Moments from left to right. From top to bottom: what the camera saw; the capture laid over it;
/// how far the garments are from the depth (blue: behind it, red: in front of it, full at 20 mm,
/// grey: nothing measured); the capture from three-quarter and from behind.
ContactSheet captureSheet(
    const avatar::LayeredAvatar& avatar,
    const std::vector<CaptureMoment>& moments,
    const avatar::Camera& camera);

/// The camera with its image cut to the person, or to those vertices of its body, and brought to a
/// panel's size, one per moment and all at one scale.
std::vector<avatar::Camera> panelCameras(
    const std::vector<CaptureMoment>& moments,
    const avatar::Camera& camera,
    const std::vector<int>& bodyVertices = {});

/// What the camera saw, its colour or else its depth.
avatar::ColorImage seenPicture(
    const CaptureMoment& moment, const avatar::Camera& camera, const avatar::Camera& panel);

/// The capture's shape: all of a garment in one colour, so that its folds are seen.
avatar::ColorImage shapePicture(
    const avatar::LayeredAvatar& avatar, const CaptureMoment& moment, const avatar::Camera& panel);

/// What the camera saw, its colour or else its depth, with the capture over it, half transparent.
avatar::ColorImage overlaidPicture(
    const avatar::LayeredAvatar& avatar,
    const CaptureMoment& moment,
    const avatar::Camera& camera,
    const avatar::Camera& panel);

/// Body and garments as they are at the moment.
std::vector<PicturedMesh> dressed(const avatar::LayeredAvatar& avatar, const CaptureMoment& moment);

/// How far the garments are from the moment's depth, coloured as in captureSheet(), but fully at
/// `full` [m]. `camera`: that measured it; `panel`: that it is seen with.
avatar::ColorImage depthErrorPicture(
    const avatar::LayeredAvatar& avatar,
    const CaptureMoment& moment,
    const avatar::Camera& camera,
    const avatar::Camera& panel,
    double full = 0.02);

/// The moment's depth as grey, where it is within 0.15 m of what was captured.
avatar::ColorImage measuredPicture(
    const avatar::LayeredAvatar& avatar,
    const CaptureMoment& moment,
    const avatar::Camera& camera,
    const avatar::Camera& panel);

/// Depth as grey, near is bright, for where there is no colour.
avatar::ColorImage depthPicture(const std::vector<float>& depth, int width, int height);

}  // namespace simulcap
