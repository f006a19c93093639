#include "src/capture/capture_output.h"

#include "avatar/io/atomic_file.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "avatar/io/performance_glb.h"
#include "src/evaluation/camera_file.h"
#include "src/evaluation/posed_avatar.h"
#include "src/output/image_file.h"
#include "src/output/performance_reader.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

constexpr int kSheetMoments = 8;

void remove(const std::string& path) {
  std::error_code ignored;
  fs::remove(path, ignored);
}

/// What a killed run was writing, under temporary names: ours, or libzip's, which add to the name.
void removeHalfWritten(const fs::path& folder) {
  std::error_code none;
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    for (const char* file :
         {"avatar.glb.",
          "camera.json.",
          "checkpoint.npz.",
          "contact_sheet.png.",
          "metrics.json.",
          "performance.glb.",
          "performance.mp4.",
          "performance.npz.",
          "report.html.",
          "timing.csv."})
      if (name.starts_with(file) && entry.is_regular_file(none))
        found.push_back(entry.path());
  }
  for (const fs::path& file : found)
    remove(file);
}

/// Of the i-th of the contact sheet's frames, from the first and the last on.
int momentNumber(int i, int numFrames) {
  return i * std::max(1, numFrames - 1) / (kSheetMoments - 1);
}

bool sameBytes(const std::string& a, const std::string& b) {
  std::ifstream first(a, std::ios::binary), second(b, std::ios::binary);
  using Bytes = std::istreambuf_iterator<char>;
  return first && second && std::equal(Bytes(first), Bytes(), Bytes(second), Bytes());
}

}  // namespace

CaptureOutput::CaptureOutput(fs::path folder, CaptureOutputSetup setup)
    : folder_(std::move(folder)), setup_(std::move(setup)) {
  removeHalfWritten(folder_);
  if (setup_.resume && fs::exists(path("checkpoint.npz")))
    resume();
  else
    begin();
}

PerformanceLayout CaptureOutput::layout() const {
  PerformanceLayout layout;
  layout.framesPerSecond = setup_.framesPerSecond;
  layout.betas = setup_.avatar.body.betas;
  layout.jointDeviations = setup_.tracked;
  for (const avatar::Garment& garment : setup_.avatar.garments)
    layout.garments.push_back(
        {garment.name, static_cast<int>(garment.mesh.numVertices()), garment.mesh.faces});
  return layout;
}

void CaptureOutput::begin() {
  remove(path("checkpoint.npz"));  // of another capture
  avatar::writeAvatar(path("avatar.glb"), setup_.avatar);
}

/// Without the parts of performance.npz that file itself is whole, and only what is made of it is
/// missing.
void CaptureOutput::resume() {
  resumed_ = readCheckpoint(path("checkpoint.npz"));
  const std::string again = path("avatar.glb.new");
  avatar::writeAvatar(again, setup_.avatar);
  const bool sameAvatar = sameBytes(again, path("avatar.glb"));
  remove(again);
  if (!sameAvatar || resumed_->settings != setup_.settings)
    throw avatar::FileError(
        path("checkpoint.npz"),
        "",
        "was left by a capture with another avatar or other settings (" + resumed_->settings +
            "); start anew without --resume");
  numFrames_ = resumed_->numFrames;
  figures_ = resumed_->figures;
  if (fs::exists(path("performance.npz.parts")))
    performance_.emplace(path("performance.npz"), layout(), numFrames_);
}

/// The first frame at or after each of evenly spread numbers: some may be missing.
void CaptureOutput::keepPicture(const TrackedFrame& frame) {
  if (!firstIndex_)
    firstIndex_ = frame.picture.index;
  const int number = frame.picture.index - *firstIndex_;
  if (nextMoment_ >= kSheetMoments || number < momentNumber(nextMoment_, setup_.numFrames))
    return;
  moments_.push_back(pictureMoment(frame));
  while (nextMoment_ < kSheetMoments && momentNumber(nextMoment_, setup_.numFrames) <= number)
    ++nextMoment_;
}

void CaptureOutput::add(
    const TrackedFrame& frame, const CaptureResult& result, const avatar::Camera& camera) {
  PerformanceFrame row{.pose = result.pose, .garments = {}, .recordingIndex = frame.picture.index};
  std::transform(
      frame.observed.body.jointDeviation.begin(),
      frame.observed.body.jointDeviation.end(),
      row.jointDeviations.begin(),
      [](double deviation) { return static_cast<float>(deviation); });
  for (const CapturedGarment& garment : result.garments)
    row.garments.push_back({garment.vertices.cast<float>(), garment.provenance});
  if (!performance_)
    performance_.emplace(path("performance.npz"), layout());
  performance_->append(row);
  ++numFrames_;
  figures_.add(result, camera, frame.observed.cloud);
  keepPicture(frame);
}

bool CaptureOutput::wantsCheckpoint() const {
  return numFrames_ % setup_.checkpointInterval == 0;
}

CaptureState CaptureOutput::checkpointed(const TrackingState& tracking, CaptureState cloth) {
  CaptureCheckpoint checkpoint{setup_.settings, numFrames_, tracking, std::move(cloth), figures_};
  writeCheckpoint(path("checkpoint.npz"), checkpoint);
  return std::move(checkpoint.cloth);
}

void CaptureOutput::finish(const avatar::Camera& camera) {
  writeCameraFromWorld(path("camera.json"), camera.cameraFromWorld);
  if (performance_)
    performance_->finish();
  writeFromPerformance(camera);
}

void CaptureOutput::close() {
  remove(path("checkpoint.npz"));
}

/// performance.glb and the contact sheet, from the file: an interrupted capture has nothing else.
void CaptureOutput::writeFromPerformance(const avatar::Camera& camera) {
  const auto most = static_cast<std::int64_t>(avatar::kMaxPerformanceFrames);
  const auto stride = static_cast<int>((numFrames_ + most - 1) / most);
  const PosedAvatarBody body(setup_.avatar.body, setup_.model);
  PerformanceReader reader(path("performance.npz"));
  std::vector<PerformanceFrame> viewersFrames;
  std::size_t moment = 0;
  for (int row = 0; std::optional<PerformanceFrame> frame = reader.next(); ++row) {
    if (moment < moments_.size() && moments_[moment].recordingIndex == frame->recordingIndex) {
      moments_[moment].body = body.vertices(frame->pose);
      for (const PerformanceFrame::Garment& garment : frame->garments)
        moments_[moment].garments.emplace_back(garment.vertices.cast<double>());
      ++moment;
    }
    if (row % stride == 0)
      viewersFrames.push_back(std::move(*frame));
  }
  writeViewersFile(viewersFrames, stride);
  if (!moments_.empty())
    writePng(path("contact_sheet.png"), composed(captureSheet(setup_.avatar, moments_, camera)));
}

void CaptureOutput::writeViewersFile(
    const std::vector<PerformanceFrame>& frames, int stride) const {
  avatar::Motion motion;
  motion.framesPerSecond = setup_.framesPerSecond / stride;
  for (const PerformanceFrame& frame : frames)
    motion.frames.push_back(frame.pose);
  const auto garmentFrames = [&](std::size_t garment, std::size_t frame) -> Eigen::Matrix3Xd {
    return frames[frame].garments[garment].vertices.cast<double>();
  };
  avatar::writePerformanceGlb(
      path("performance.glb"), avatar::dressedPerformance(setup_.avatar, motion, garmentFrames));
}

}  // namespace simulcap
