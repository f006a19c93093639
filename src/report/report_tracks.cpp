#include "src/report/report_tracks.h"

#include <string>
#include <utility>

namespace simulcap {
namespace {

nlohmann::json trackJson(const TrackShape& shape, nlohmann::json chunks) {
  return {
      {"points", shape.points},
      {"components", shape.components},
      {"bytes", shape.bytesPerValue},
      {"over_time", shape.overTime},
      {"chunks", std::move(chunks)}};
}

/// The block's number; adds its bytes in the page to `size`.
int addPacked(ReportPage& page, const std::string& bytes, TrackSize& size) {
  const std::size_t before = page.numBytes();
  const int block = page.addBlock(bytes);
  size.packed += page.numBytes() - before;
  return block;
}

}  // namespace

void PositionTrack::add(Eigen::Matrix3Xf vertices) {
  points_ = static_cast<int>(vertices.cols());
  size_.raw += sizeof(float) * static_cast<std::size_t>(vertices.size());
  pending_.push_back(std::move(vertices));
  if (pending_.size() == kFramesPerBlock)
    flush();
}

void PositionTrack::flush() {
  if (pending_.empty())
    return;
  const PositionChunk chunk = quantized(pending_, step_);
  const int block = addPacked(page_, packedTrack(chunk.values, chunk.shape), size_);
  chunks_.push_back(
      {{"block", block},
       {"frames", chunk.shape.frames},
       {"step", chunk.step},
       {"origin", {chunk.origin[0], chunk.origin[1], chunk.origin[2]}}});
  pending_.clear();
}

nlohmann::json PositionTrack::finish() {
  flush();
  return trackJson({.points = points_, .components = 3}, std::move(chunks_));
}

void ValueTrack::add(const std::vector<std::uint32_t>& frame) {
  size_.raw += static_cast<std::size_t>(rawBytes_) * frame.size();
  pending_.insert(pending_.end(), frame.begin(), frame.end());
  if (++pendingFrames_ == kFramesPerBlock)
    flush();
}

void ValueTrack::flush() {
  if (pendingFrames_ == 0)
    return;
  TrackShape shape = shape_;
  shape.frames = pendingFrames_;
  const int block = addPacked(page_, packedTrack(pending_, shape), size_);
  chunks_.push_back({{"block", block}, {"frames", pendingFrames_}});
  pending_.clear();
  pendingFrames_ = 0;
}

nlohmann::json ValueTrack::finish() {
  flush();
  return trackJson(shape_, std::move(chunks_));
}

nlohmann::json constantTrack(
    ReportPage& page, const std::vector<std::uint32_t>& values, const TrackShape& shape) {
  ValueTrack track(page, shape, shape.bytesPerValue);
  track.add(values);
  return track.finish();
}

nlohmann::json facesTrack(ReportPage& page, const Eigen::Matrix3Xi& faces) {
  const std::vector<std::uint32_t> corners(faces.data(), faces.data() + faces.size());
  return constantTrack(
      page,
      corners,
      {.points = static_cast<int>(faces.cols()), .components = 3, .bytesPerValue = 4});
}

}  // namespace simulcap
