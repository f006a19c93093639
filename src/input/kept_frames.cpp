#include "src/input/kept_frames.h"

#include <utility>

namespace simulcap {
namespace {

class KeptSource final : public FrameSource {
 public:
  explicit KeptSource(std::shared_ptr<const KeptFrames> kept)
      : kept_(std::move(kept)), info_(kept_->info) {
    info_.numFrames = static_cast<int>(kept_->frames.size());
  }

  const RecordingInfo& info() const override { return info_; }

  std::optional<RgbdFrame> next() override {
    if (next_ == kept_->frames.size())
      return std::nullopt;
    return kept_->frames[next_++];
  }

  std::vector<std::string> warnings() const override { return {}; }

 private:
  std::shared_ptr<const KeptFrames> kept_;
  RecordingInfo info_;
  std::size_t next_ = 0;
};

}  // namespace

KeepingSource::KeepingSource(std::shared_ptr<FrameSource> source, std::size_t most)
    : source_(std::move(source)), most_(most), kept_{source_->info(), {}} {}

std::optional<RgbdFrame> KeepingSource::next() {
  std::optional<RgbdFrame> frame = source_->next();
  if (frame && most_ > 0) {
    kept_.frames.push_back(*frame);
    forget(most_);
  }
  return frame;
}

void KeepingSource::forget(std::size_t most) {
  while (kept_.frames.size() > most)
    kept_.frames.pop_front();
}

FrameSupply supplyOf(std::shared_ptr<const KeptFrames> kept, const std::string& name) {
  return {name, [kept = std::move(kept)] { return std::make_unique<KeptSource>(kept); }};
}

}  // namespace simulcap
