#pragma once

#include "src/input/frame_source.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Which frames of a recording are looked at, in the order in which they come.
struct FrameRange {
  int first = 0;             ///< of the usable frames, from 0
  std::optional<int> count;  ///< ≥ 1; absent: all that follow
};

/// The frames of a range alone.
class RangedSource final : public FrameSource {
 public:
  /// `name` is what errors call the source. Throws avatar::FileError when it is known to end before
  /// the range begins, std::invalid_argument for a range without frames or that begins below 0.
  RangedSource(
      std::unique_ptr<FrameSource> source, const std::string& name, const FrameRange& range);

  const RecordingInfo& info() const override { return info_; }

  std::optional<RgbdFrame> next() override;

  std::vector<std::string> warnings() const override { return source_->warnings(); }

 private:
  std::unique_ptr<FrameSource> source_;
  FrameRange range_;
  RecordingInfo info_;
  int numRead_ = 0;
};

}  // namespace simulcap
