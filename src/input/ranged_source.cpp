#include "src/input/ranged_source.h"

#include "avatar/io/file_error.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace simulcap {

RangedSource::RangedSource(
    std::unique_ptr<FrameSource> source, const std::string& name, const FrameRange& range)
    : source_(std::move(source)), range_(range), info_(source_->info()) {
  if (range.first < 0 || (range.count && *range.count < 1))
    throw std::invalid_argument("RangedSource: a range has frames and begins at 0 or later");
  if (!info_.numFrames)
    return;
  if (range.first >= *info_.numFrames)
    throw avatar::FileError(
        name,
        "",
        "has " + std::to_string(*info_.numFrames) + " frames, none from number " +
            std::to_string(range.first) + " on");
  const int left = *info_.numFrames - range.first;
  info_.numFrames = std::min(left, range.count.value_or(left));
}

std::optional<RgbdFrame> RangedSource::next() {
  for (; numRead_ < range_.first; ++numRead_) {
    if (!source_->next())
      return std::nullopt;
  }
  if (range_.count && numRead_ - range_.first >= *range_.count)
    return std::nullopt;
  ++numRead_;
  return source_->next();
}

}  // namespace simulcap
