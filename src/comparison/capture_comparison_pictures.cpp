#include "src/comparison/capture_comparison_pictures.h"

#include "avatar/io/file_error.h"
#include "src/evaluation/camera_file.h"
#include "src/input/intrinsics_file.h"
#include "src/input/picture_file.h"
#include "src/output/performance_reader.h"

#include <cstdio>
#include <utility>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

fs::path backDepthPath(const fs::path& sequence, int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "%06d.png", frame);
  return sequence / "gt" / "depth_back" / name;
}

std::vector<float> readDepth(
    const fs::path& path, const avatar::Camera& camera, double unitsPerMetre) {
  try {
    const std::vector<std::uint16_t> values =
        readDepthPicture(path.string(), {camera.width, camera.height});
    std::vector<float> depth;
    depth.reserve(values.size());
    for (const std::uint16_t raw : values)
      depth.push_back(static_cast<float>(raw / unitsPerMetre));
    return depth;
  } catch (const PictureProblem& problem) {
    throw avatar::FileError(path.string(), "", problem.what());
  }
}

}  // namespace

MomentChoice::MomentChoice(fs::path sequence, int numFrames)
    : sequence_(std::move(sequence)), numFrames_(numFrames) {}

void MomentChoice::add(const TrackedFrame& frame) {
  constexpr int kMoments = 5;
  const auto taken = static_cast<int>(chosen_.size());
  const bool due = taken < kMoments && frame.ordinal * kMoments >= taken * numFrames_;
  const bool hasBack = !fs::is_directory(sequence_ / "gt" / "depth_back") ||
                       fs::exists(backDepthPath(sequence_, frame.picture.index));
  if (due && hasBack)
    chosen_.push_back(pictureMoment(frame));
}

PicturedCapture readPicturedCapture(
    const fs::path& folder, std::vector<CaptureMoment> moments, const PosedAvatarBody& body) {
  PerformanceReader reader((folder / "performance.npz").string());
  std::size_t next = 0;
  for (std::optional<PerformanceFrame> frame = reader.next(); frame && next < moments.size();
       frame = reader.next()) {
    CaptureMoment& moment = moments[next];
    if (moment.recordingIndex != frame->recordingIndex)
      continue;
    moment.body = body.vertices(frame->pose);
    for (const PerformanceFrame::Garment& garment : frame->garments)
      moment.garments.emplace_back(garment.vertices.cast<double>());
    ++next;
  }
  return {folder.filename().string(), std::move(moments)};
}

ContactSheet depthErrorSheet(
    const avatar::LayeredAvatar& avatar,
    const std::vector<PicturedCapture>& captures,
    const avatar::Camera& camera,
    double full) {
  const std::vector<CaptureMoment>& first = captures.at(0).moments;
  const std::vector<avatar::Camera> panels = panelCameras(first, camera);
  ContactSheet sheet;
  sheet.rowLabels.emplace_back("depth");
  for (std::size_t i = 0; i < first.size(); ++i) {
    sheet.columnLabels.push_back(first[i].label);
    sheet.panels.push_back(measuredPicture(avatar, first[i], camera, panels[i]));
  }
  for (const PicturedCapture& capture : captures) {
    sheet.rowLabels.push_back(capture.name);
    for (std::size_t i = 0; i < capture.moments.size(); ++i)
      sheet.panels.push_back(
          depthErrorPicture(avatar, capture.moments[i], camera, panels[i], full));
  }
  return sheet;
}

ContactSheet shapeSheet(
    const avatar::LayeredAvatar& avatar,
    const std::vector<PicturedCapture>& captures,
    const avatar::Camera& camera,
    const std::vector<int>& bodyVertices) {
  const std::vector<CaptureMoment>& first = captures.at(0).moments;
  const std::vector<avatar::Camera> panels = panelCameras(first, camera, bodyVertices);
  ContactSheet sheet;
  sheet.rowLabels = {"camera", "depth"};
  for (std::size_t i = 0; i < first.size(); ++i) {
    sheet.columnLabels.push_back(first[i].label);
    sheet.panels.push_back(seenPicture(first[i], camera, panels[i]));
  }
  for (std::size_t i = 0; i < first.size(); ++i)
    sheet.panels.push_back(measuredPicture(avatar, first[i], camera, panels[i]));
  for (const PicturedCapture& capture : captures) {
    sheet.rowLabels.push_back(capture.name);
    for (std::size_t i = 0; i < first.size(); ++i)
      sheet.panels.push_back(shapePicture(avatar, capture.moments[i], panels[i]));
  }
  return sheet;
}

std::optional<BackView> readBackView(
    const fs::path& sequence,
    const std::vector<CaptureMoment>& moments,
    const avatar::Camera& camera) {
  if (!fs::is_directory(sequence / "gt" / "depth_back"))
    return std::nullopt;
  BackView view{camera, {}};
  const RecordingIntrinsics intrinsics = readIntrinsics((sequence / "intrinsics.json").string());
  for (const CaptureMoment& moment : moments) {
    const fs::path path = backDepthPath(sequence, moment.recordingIndex);
    if (!fs::exists(path))
      continue;
    view.moments.push_back(moment);
    view.moments.back().color = {};
    view.moments.back().depth = readDepth(path, camera, intrinsics.depthScale);
  }
  if (view.moments.empty())
    return std::nullopt;
  const std::string cameras = (sequence / "gt" / "camera.json").string();
  view.camera.cameraFromWorld = readCameraFromWorld(cameras, "back_camera_from_world") *
                                readCameraFromWorld(cameras).inverse() * camera.cameraFromWorld;
  return view;
}

}  // namespace simulcap
