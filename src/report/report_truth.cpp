#include "src/report/report_truth.h"

#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace simulcap {
namespace {

constexpr double kTruthStep = 0.001;  // [m]
constexpr double kTruthCell = 0.015;  // [m]

}  // namespace

ThinnedMesh thinned(const avatar::TriangleMesh& mesh, double cell) {
  std::map<std::array<long, 3>, int> cells;
  ThinnedMesh result;
  std::vector<int> standsFor(static_cast<std::size_t>(mesh.numVertices()));
  for (int v = 0; v < mesh.numVertices(); ++v) {
    std::array<long, 3> key{};
    for (std::size_t c = 0; c < 3; ++c)
      key[c] = std::lround(mesh.vertices(static_cast<Eigen::Index>(c), v) / cell);
    const auto [place, isNew] = cells.emplace(key, static_cast<int>(result.kept.size()));
    if (isNew)
      result.kept.push_back(v);
    standsFor[static_cast<std::size_t>(v)] = place->second;
  }
  result.faces.resize(3, mesh.faces.cols());
  Eigen::Index count = 0;
  for (const auto& face : mesh.faces.colwise()) {
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k)
      corners[k] = standsFor[static_cast<std::size_t>(face[k])];
    if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
      result.faces.col(count++) = corners;
  }
  result.faces.conservativeResize(3, count);
  return result;
}

ReportTruth::ReportTruth(ReportPage& page, ReportInput& input, int threads)
    : page_(page), input_(input), threads_(threads) {
  for (const PerformanceLayout::Garment& garment : input.performance.layout().garments)
    errors_.emplace_back(
        page, TrackShape{.points = garment.numVertices, .bytesPerValue = 1}, sizeof(float));
}

/// Which vertices are shown is decided in the first frame.
void ReportTruth::begin(const TrueFrame& truth) {
  std::vector<avatar::TriangleMesh> layers;
  layers.reserve(truth.garments.size());
  for (std::size_t i = 0; i < truth.garments.size(); ++i) {
    const GroundTruth::Garment& garment = input_.truth->garments()[i];
    layers.push_back({truth.garments[i], garment.faces});
    ThinnedMesh mesh = thinned(layers.back(), kTruthCell);
    parts_.push_back(
        {.look =
             {{"name", garment.name}, {"kind", "truth"}, {"faces", facesTrack(page_, mesh.faces)}},
         .positions = PositionTrack(page_, kTruthStep),
         .kept = std::move(mesh.kept)});
  }
  surface_.emplace(layers);
}

void ReportTruth::move(const TrueFrame& truth) {
  if (surface_)
    surface_->move(truth.garments);
  else
    begin(truth);
  const Eigen::Isometry3d worldFromCamera = input_.recording->camera().cameraFromWorld.inverse();
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Eigen::Matrix3Xd kept = truth.garments[i](Eigen::all, parts_[i].kept);
    parts_[i].last = (worldFromCamera * kept).cast<float>();
  }
}

void ReportTruth::add(const ReportedFrame& frame, FrameSeries& series) {
  const bool known = frame.number >= 0 && frame.number < input_.truth->numFrames();
  if (known || !surface_)  // before the truth's first frame: that one
    move(input_.truth->frame(known ? frame.number : 0));
  for (TruePart& part : parts_)
    part.positions.add(part.last);
  Distribution millimetres(0.05);
  for (std::size_t i = 0; i < errors_.size(); ++i) {
    std::vector<std::uint32_t> bytes(static_cast<std::size_t>(frame.garments[i].cols()), 0U);
    std::vector<avatar::ClosestPoint> nearest;
    if (known)
      nearest = surface_->nearest(
          input_.recording->camera().cameraFromWorld * frame.garments[i], threads_);
    for (std::size_t v = 0; v < nearest.size(); ++v) {
      const double distance = std::sqrt(nearest[v].squaredDistance);
      bytes[v] = offsetByte(distance);
      millimetres.add(1000.0 * distance);
    }
    errors_[i].add(bytes);
  }
  series.add("truth_error_mm", millimetres);
}

nlohmann::json ReportTruth::finish() {
  nlohmann::json parts = nlohmann::json::array();
  for (TruePart& part : parts_) {
    part.look["positions"] = part.positions.finish();
    parts.push_back(std::move(part.look));
  }
  nlohmann::json errors = nlohmann::json::array();
  for (ValueTrack& track : errors_)
    errors.push_back(track.finish());
  return {{"parts", std::move(parts)}, {"errors", std::move(errors)}};
}

TrackSize ReportTruth::size() const {
  TrackSize size;
  for (const TruePart& part : parts_)
    size += part.positions.size();
  for (const ValueTrack& track : errors_)
    size += track.size();
  return size;
}

}  // namespace simulcap
