#include "src/report/capture_video.h"

#include "avatar/io/file_error.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

namespace simulcap {
namespace {

constexpr int kHeight = 480;           // [px]
constexpr int kTurningWidth = 432;     // [px]
constexpr double kSecondsPerTurn = 8;  // of the turning view

/// The camera with the video's height; H.264 wants an even width.
avatar::Camera panelOf(avatar::Camera camera) {
  const double scale = static_cast<double>(kHeight) / camera.height;
  camera.width = 2 * static_cast<int>(std::lround(0.5 * scale * camera.width));
  camera.height = kHeight;
  camera.fx *= scale;
  camera.fy *= scale;
  // Pixel centres are at whole numbers.
  camera.cx = (camera.cx + 0.5) * scale - 0.5;
  camera.cy = (camera.cy + 0.5) * scale - 0.5;
  return camera;
}

CaptureMoment momentOf(ReportInput& input, const PerformanceFrame& frame) {
  CaptureMoment moment{.recordingIndex = frame.recordingIndex};
  moment.body = input.body->vertices(frame.pose);
  for (const PerformanceFrame::Garment& garment : frame.garments)
    moment.garments.emplace_back(garment.vertices.cast<double>());
  return moment;
}

avatar::ColorImage besideEachOther(
    const avatar::ColorImage& left, const avatar::ColorImage& right) {
  avatar::ColorImage both{left.width + right.width, left.height, {}};
  both.rgb.reserve(left.rgb.size() + right.rgb.size());
  for (int y = 0; y < both.height; ++y)
    for (const avatar::ColorImage* image : {&left, &right}) {
      const auto row = image->rgb.begin() + 3 * (std::ptrdiff_t{image->width} * y);
      both.rgb.insert(both.rgb.end(), row, row + 3 * std::ptrdiff_t{image->width});
    }
  return both;
}

}  // namespace

CaptureVideo::CaptureVideo(
    const std::string& folder, const std::string& path, const std::string& recording)
    : input_(openReportInput(folder, {.recording = recording})) {
  if (!input_->avatar)
    throw avatar::FileError(
        (std::filesystem::path(folder) / "avatar.glb").string(),
        "",
        "missing: only people's performances are filmed");
  if (input_->recording)
    panel_ = panelOf(input_->recording->camera());
  video_ = std::make_unique<VideoWriter>(
      path,
      kTurningWidth + (panel_ ? panel_->width : 0),
      kHeight,
      input_->performance.layout().framesPerSecond);
}

bool CaptureVideo::advance() {
  const std::optional<PerformanceFrame> frame = input_->performance.next();
  if (!frame)
    return false;
  CaptureMoment moment = momentOf(*input_, *frame);
  const avatar::ColorImage turning = turningView(*frame, moment);
  ++row_;
  if (!panel_) {
    video_->add(turning);
    return true;
  }
  const avatar::Camera& camera = input_->recording->camera();
  if (const SeenFrame* seen = input_->recording->frame(frame->recordingIndex)) {
    moment.color = seen->color;
    moment.depth = seen->cloud.depth;
  } else {
    moment.depth.assign(static_cast<std::size_t>(camera.width) * camera.height, 0.0F);
  }
  video_->add(besideEachOther(overlaidPicture(*input_->avatar, moment, camera, *panel_), turning));
  return true;
}

/// About the pelvis, at the heights that the first frame fills.
avatar::ColorImage CaptureVideo::turningView(
    const PerformanceFrame& frame, const CaptureMoment& moment) {
  if (row_ == 0) {
    constexpr double kMargin = 0.08;  // of the height: what is nearer to the camera looks larger
    const double low = moment.body.row(1).minCoeff(), high = moment.body.row(1).maxCoeff();
    bottom_ = low - kMargin * (high - low);
    top_ = high + kMargin * (high - low);
  }
  const double seconds = row_ / input_->performance.layout().framesPerSecond;
  const double angle = 2.0 * std::numbers::pi * seconds / kSecondsPerTurn;
  const BodyView view{.name = "turning", .direction = {std::sin(angle), -0.1, -std::cos(angle)}};
  const Eigen::Vector3d pelvis = input_->body->joints(frame.pose).col(0);
  // Only the height, so that the scale is the same from every side.
  const Eigen::AlignedBox3d axis(
      Eigen::Vector3d(pelvis.x(), bottom_, pelvis.z()),
      Eigen::Vector3d(pelvis.x(), top_, pelvis.z()));
  return picture(
      dressed(*input_->avatar, moment),
      view,
      axis,
      {.width = kTurningWidth, .height = kHeight, .supersampling = 1});
}

}  // namespace simulcap
