#pragma once

#include "src/report/report_page.h"
#include "src/report/track_codec.h"

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace simulcap {

/// Frames that are in memory before they go into the page as one block.
inline constexpr int kFramesPerBlock = 30;

/// Bytes that a track would take as it comes, and that it takes in the page.
struct TrackSize {
  std::size_t raw = 0;
  std::size_t packed = 0;

  TrackSize& operator+=(const TrackSize& other) {
    raw += other.raw;
    packed += other.packed;
    return *this;
  }
};

/// Vertices over time on their way into the page.
class PositionTrack {
 public:
  /// `step` [m]: see quantized(). Keeps a reference.
  PositionTrack(ReportPage& page, double step) : page_(page), step_(step) {}

  /// 3 × V [m].
  void add(Eigen::Matrix3Xf vertices);

  /// For the page: {"points","components","bytes","over_time","chunks":[{"block","frames","step",
  /// "origin"}]}.
  nlohmann::json finish();

  const TrackSize& size() const { return size_; }

 private:
  void flush();

  ReportPage& page_;
  double step_;
  std::vector<Eigen::Matrix3Xf> pending_;
  nlohmann::json chunks_ = nlohmann::json::array();
  int points_ = 0;
  TrackSize size_;
};

/// Numbers over time on their way into the page.
class ValueTrack {
 public:
  /// `frame`: the shape of one frame. `rawBytes`: of a value as it comes.
  ValueTrack(ReportPage& page, const TrackShape& frame, int rawBytes)
      : page_(page), shape_(frame), rawBytes_(rawBytes) {}

  void add(const std::vector<std::uint32_t>& frame);

  /// As PositionTrack's, without step and origin.
  nlohmann::json finish();

  const TrackSize& size() const { return size_; }

 private:
  void flush();

  ReportPage& page_;
  TrackShape shape_;
  int rawBytes_;
  int pendingFrames_ = 0;
  std::vector<std::uint32_t> pending_;
  nlohmann::json chunks_ = nlohmann::json::array();
  TrackSize size_;
};

/// What is the same in every frame, as a track of one frame.
nlohmann::json constantTrack(
    ReportPage& page, const std::vector<std::uint32_t>& values, const TrackShape& shape);

/// 3 × F vertex indices as a track of one frame.
nlohmann::json facesTrack(ReportPage& page, const Eigen::Matrix3Xi& faces);

}  // namespace simulcap
