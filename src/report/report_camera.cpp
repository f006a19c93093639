#include "src/report/report_camera.h"

#include "avatar/geometry/mesh.h"
#include "src/capture/capture_pictures.h"
#include "src/evaluation/depth_error.h"
#include "src/output/image_file.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace simulcap {
namespace {

constexpr int kPictureWidth = 320;  // [px], at most
constexpr int kPictureQuality = 80;
constexpr int kDepthColumns = 160;     // at most
constexpr double kDepthStep = 0.0005;  // [m], of thinnedDepth()

int samples(int pixels, int stride) {
  return (pixels + stride - 1) / stride;
}

nlohmann::json rowsOf(const Eigen::Matrix4d& matrix) {
  nlohmann::json numbers = nlohmann::json::array();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      numbers.push_back(matrix(row, column));
  return numbers;
}

std::string thumbnail(const SeenFrame& seen, const avatar::Camera& camera) {
  const avatar::ColorImage picture =
      seen.color.rgb.empty() ? depthPicture(seen.cloud.depth, camera.width, camera.height)
                             : seen.color;
  const int width = std::min(kPictureWidth, camera.width);
  const int height = std::max(1, camera.height * width / camera.width);
  return jpegBytes(resized(picture, width, height), kPictureQuality);
}

}  // namespace

ReportCamera::ReportCamera(ReportPage& page, ReportInput& input)
    : page_(page),
      input_(input),
      viewer_(input.recording->camera()),
      depthStride_(samples(input.recording->camera().width, kDepthColumns)),
      depth_(
          page,
          {.points = samples(input.recording->camera().width, depthStride_) *
                     samples(input.recording->camera().height, depthStride_),
           .overTime = false},
          static_cast<int>(sizeof(float)) * depthStride_ * depthStride_),
      depthSamples_(
          static_cast<std::size_t>(samples(input.recording->camera().width, depthStride_)) *
          static_cast<std::size_t>(samples(input.recording->camera().height, depthStride_))) {
  for (const PerformanceLayout::Garment& garment : input.performance.layout().garments)
    errors_.emplace_back(
        page, TrackShape{.points = garment.numVertices, .bytesPerValue = 1}, sizeof(float));
}

void ReportCamera::add(const ReportedFrame& frame, FrameSeries& series) {
  const SeenFrame* seen = input_.recording->frame(frame.number);
  if (seen == nullptr) {
    addNothing();
    return;
  }
  addPicture(*seen);
  addDepth(*seen);
  addErrors(*seen, frame, series);
}

void ReportCamera::addNothing() {
  pictures_.push_back(nullptr);
  depth_.add(std::vector<std::uint32_t>(depthSamples_, 0U));
  for (std::size_t i = 0; i < errors_.size(); ++i)
    errors_[i].add(std::vector<std::uint32_t>(
        static_cast<std::size_t>(input_.performance.layout().garments[i].numVertices), 0U));
}

void ReportCamera::addPicture(const SeenFrame& seen) {
  const std::size_t before = page_.numBytes();
  pictures_.push_back(page_.addPicture(thumbnail(seen, input_.recording->camera())));
  pictureSize_.raw += 3 * seen.cloud.depth.size();
  pictureSize_.packed += page_.numBytes() - before;
}

void ReportCamera::addDepth(const SeenFrame& seen) {
  std::vector<std::uint32_t> values = thinnedDepth(seen.cloud, depthStride_);
  const auto isMeasured = [](std::uint32_t value) { return value > 0; };
  measured_ += static_cast<std::size_t>(
      std::count(seen.cloud.person.begin(), seen.cloud.person.end(), std::uint8_t{1}));
  kept_ += static_cast<std::size_t>(std::count_if(values.begin(), values.end(), isMeasured));
  depth_.add(values);
}

void ReportCamera::addErrors(
    const SeenFrame& seen, const ReportedFrame& frame, FrameSeries& series) {
  std::vector<avatar::MeshView> garments;
  garments.reserve(frame.garments.size());
  for (std::size_t i = 0; i < frame.garments.size(); ++i)
    garments.emplace_back(frame.garments[i], input_.performance.layout().garments[i].faces);
  const Eigen::Matrix3Xi noFaces(3, 0);
  const avatar::MeshView body(frame.body, input_.avatar ? input_.avatar->body.mesh.faces : noFaces);
  const std::vector<GarmentView> views = viewer_(body, garments);
  Distribution millimetres(0.05);
  for (std::size_t i = 0; i < garments.size(); ++i) {
    std::vector<std::uint32_t> bytes(views[i].visible.size(), 0U);
    for (std::size_t v = 0; v < bytes.size(); ++v) {
      if (views[i].visible[v] == 0)
        continue;
      const std::optional<double> offset = depthOffset(
          frame.garments[i].col(static_cast<Eigen::Index>(v)),
          input_.recording->camera(),
          seen.cloud);
      bytes[v] = offsetByte(offset);
      if (offset)
        millimetres.add(1000.0 * std::abs(*offset));
    }
    errors_[i].add(bytes);
  }
  series.add("depth_error_mm", millimetres);
}

nlohmann::json ReportCamera::finish() {
  const avatar::Camera& camera = input_.recording->camera();
  nlohmann::json errors = nlohmann::json::array();
  for (ValueTrack& track : errors_)
    errors.push_back(track.finish());
  return {
      {"width", camera.width},
      {"height", camera.height},
      {"fx", camera.fx},
      {"fy", camera.fy},
      {"cx", camera.cx},
      {"cy", camera.cy},
      {"camera_from_world", rowsOf(camera.cameraFromWorld.matrix())},
      {"pictures", pictures_},
      {"depth",
       {{"columns", samples(camera.width, depthStride_)},
        {"stride", depthStride_},
        {"step", kDepthStep},
        {"track", depth_.finish()}}},
      {"errors", std::move(errors)}};
}

nlohmann::json ReportCamera::savings() const {
  TrackSize errors;
  for (const ValueTrack& track : errors_)
    errors += track.size();
  return nlohmann::json::array(
      {{{"what", "depth points"},
        {"how",
         std::to_string(kept_) + " of " + std::to_string(measured_) +
             " measured pixels of the person, in steps of 0.5 mm"},
        {"raw", depth_.size().raw},
        {"packed", depth_.size().packed}},
       {{"what", "camera pictures"},
        {"how", "JPEG, at most " + std::to_string(kPictureWidth) + " pixels wide"},
        {"raw", pictureSize_.raw},
        {"packed", pictureSize_.packed}},
       {{"what", "depth errors"},
        {"how", "steps of 0.5 mm, up to 63 mm"},
        {"raw", errors.raw},
        {"packed", errors.packed}}});
}

}  // namespace simulcap
