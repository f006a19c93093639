#pragma once

#include "src/evaluation/cloth_metrics.h"
#include "src/report/frame_series.h"
#include "src/report/report_input.h"
#include "src/report/report_page.h"
#include "src/report/report_tracks.h"

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <deque>
#include <optional>
#include <vector>

namespace simulcap {

/// A frame of a performance as surfaces in the world [m].
struct ReportedFrame {
  int number = 0;                          ///< within the recording
  Eigen::Matrix3Xd body;                   ///< 3 × V; no columns: none
  std::vector<Eigen::Matrix3Xd> garments;  ///< 3 × V each, in the performance's order
};

/// Body and garments of a report.
class ReportParts {
 public:
  /// Keeps references.
  ReportParts(ReportPage& page, const ReportInput& input);

  /// Returns the surfaces, and adds the strain of the garments' edges to the plots.
  ReportedFrame add(const PerformanceFrame& frame, FrameSeries& series);

  /// A list of what is the same in every frame and tracks of what isn't.
  nlohmann::json finish();

  TrackSize garmentSize() const;

  TrackSize bodySize() const { return body_ ? body_->size() : TrackSize{}; }

 private:
  struct GarmentPart {
    nlohmann::json look;  ///< what is the same in every frame
    PositionTrack positions;
    ValueTrack provenance;
    std::optional<EdgeStrain> strain;  ///< against the mesh at rest, else the first frame
  };

  void addGarment(const PerformanceLayout::Garment& garment);
  nlohmann::json madeLook(const avatar::Garment& made);

  ReportPage& page_;
  const ReportInput& input_;
  nlohmann::json bodyLook_;
  std::optional<PositionTrack> body_;
  std::deque<GarmentPart> garments_;
};

}  // namespace simulcap
