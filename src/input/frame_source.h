#pragma once

#include "src/input/rgbd_frame.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Frames one after the other, from files or a camera.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  FrameSource(FrameSource&&) = delete;
  FrameSource& operator=(FrameSource&&) = delete;
  virtual ~FrameSource() = default;

  virtual const RecordingInfo& info() const = 0;

  /// The next usable frame; nothing at the end. Frames that can't be used are skipped and warned
  /// of once per kind. Throws avatar::FileError for what makes the whole recording unusable.
  virtual std::optional<RgbdFrame> next() = 0;

  /// What was wrong so far, one line per kind with its count and the first file concerned.
  virtual std::vector<std::string> warnings() const = 0;
};

/// Frames that can be had from the first one on, again and again.
struct FrameSupply {
  std::string name;  ///< what errors call it: the recording's folder
  std::function<std::unique_ptr<FrameSource>()> open;
};

}  // namespace simulcap
