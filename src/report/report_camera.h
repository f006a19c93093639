#pragma once

#include "src/fitting/layer_view.h"
#include "src/report/report_parts.h"

#include <cstddef>
#include <deque>
#include <vector>

namespace simulcap {

/// What the camera saw in a report: pictures, thinned depth, and how far the garments are from it.
class ReportCamera {
 public:
  /// Keeps references. The input must have a recording.
  ReportCamera(ReportPage& page, ReportInput& input);

  void add(const ReportedFrame& frame, FrameSeries& series);

  /// Camera, "pictures", "depth", and "errors" per garment.
  nlohmann::json finish();

  /// What was left out, and what it saved.
  nlohmann::json savings() const;

 private:
  void addPicture(const SeenFrame& seen);
  void addDepth(const SeenFrame& seen);
  void addErrors(const SeenFrame& seen, const ReportedFrame& frame, FrameSeries& series);
  void addNothing();

  ReportPage& page_;
  ReportInput& input_;
  LayerViewer viewer_;
  int depthStride_;
  ValueTrack depth_;
  std::deque<ValueTrack> errors_;
  std::size_t depthSamples_;
  nlohmann::json pictures_ = nlohmann::json::array();
  TrackSize pictureSize_;
  std::size_t measured_ = 0, kept_ = 0;  // pixels of the person
};

}  // namespace simulcap
