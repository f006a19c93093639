#pragma once

#include "src/input/frame_source.h"

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Frames in memory, and what they are frames of.
struct KeptFrames {
  RecordingInfo info;
  std::deque<RgbdFrame> frames;
};

/// Passes on what a source gives, and keeps the newest of it.
class KeepingSource final : public FrameSource {
 public:
  /// At most `most` frames are kept, the oldest dropped for newer ones; 0: none.
  KeepingSource(std::shared_ptr<FrameSource> source, std::size_t most);

  const RecordingInfo& info() const override { return source_->info(); }

  std::optional<RgbdFrame> next() override;

  std::vector<std::string> warnings() const override { return source_->warnings(); }

  const KeptFrames& kept() const { return kept_; }

  /// Drops the oldest until no more than `most` are kept.
  void forget(std::size_t most);

 private:
  std::shared_ptr<FrameSource> source_;
  std::size_t most_;
  KeptFrames kept_;
};

/// The kept frames as a recording of their own.
FrameSupply supplyOf(std::shared_ptr<const KeptFrames> kept, const std::string& name);

}  // namespace simulcap
