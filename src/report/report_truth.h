#pragma once

#include "src/evaluation/moving_surface.h"
#include "src/report/report_parts.h"

#include <deque>
#include <memory>
#include <optional>
#include <vector>

namespace simulcap {

/// A mesh with one vertex per cell of a grid.
struct ThinnedMesh {
  std::vector<int> kept;   ///< vertices of the mesh, ascending
  Eigen::Matrix3Xi faces;  ///< 3 × F, indices into `kept`
};

/// Of all vertices in a cell of a grid of `cell` [m] > 0 the first one stands for all; faces whose
/// corners are then not three are left out. Of the moving mesh the same vertices are kept.
ThinnedMesh thinned(const avatar::TriangleMesh& mesh, double cell);

/// The true garments in a report, and how far the captured ones are from them.
class ReportTruth {
 public:
  /// Keeps references. The input must have a recording and its truth. `threads` never changes the
  /// result. Throws avatar::FileError.
  ReportTruth(ReportPage& page, ReportInput& input, int threads);

  /// Throws avatar::FileError.
  void add(const ReportedFrame& frame, FrameSeries& series);

  /// "parts" as ReportParts has them, and "errors" per captured garment.
  nlohmann::json finish();

  TrackSize size() const;

 private:
  struct TruePart {
    nlohmann::json look;
    PositionTrack positions;
    std::vector<int> kept = {};  ///< vertices that are shown
    Eigen::Matrix3Xf last = {};  ///< 3 × kept [m], in the world
  };

  void move(const TrueFrame& truth);
  void begin(const TrueFrame& truth);

  ReportPage& page_;
  ReportInput& input_;
  int threads_;
  std::deque<TruePart> parts_;
  std::optional<MovingSurface> surface_;  ///< from the first frame on
  std::deque<ValueTrack> errors_;
};

}  // namespace simulcap
