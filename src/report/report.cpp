#include "src/report/report.h"

#include "src/program/version.h"

#include <filesystem>

namespace simulcap {
namespace {

nlohmann::json saving(const char* what, const char* how, const TrackSize& size) {
  return {{"what", what}, {"how", how}, {"raw", size.raw}, {"packed", size.packed}};
}

int strideFor(std::int64_t frames, int most) {
  return static_cast<int>((frames + most - 1) / most);
}

}  // namespace

Report::Report(const std::string& folder, const std::string& path, const ReportOptions& options)
    : input_(openReportInput(folder, options)),
      page_(path),
      stride_(strideFor(input_->performance.numFrames(), options.maxFrames)),
      parts_(page_, *input_) {
  if (input_->recording)
    camera_.emplace(page_, *input_);
  if (input_->truth)
    truth_.emplace(page_, *input_, options.threads);
}

bool Report::advance() {
  const std::optional<PerformanceFrame> frame = input_->performance.next();
  if (!frame)
    return false;
  if (row_++ % stride_ != 0)
    return true;
  series_.begin(frame->recordingIndex);
  ++numShown_;
  const ReportedFrame reported = parts_.add(*frame, series_);
  if (camera_)
    camera_->add(reported, series_);
  if (truth_)
    truth_->add(reported, series_);
  return true;
}

nlohmann::json Report::savings() const {
  nlohmann::json list = nlohmann::json::array();
  list.push_back(saving("garments", "vertices in steps of 0.2 mm", parts_.garmentSize()));
  list.push_back(saving("body", "vertices in steps of 0.5 mm", parts_.bodySize()));
  if (camera_)
    for (nlohmann::json& one : camera_->savings())
      list.push_back(std::move(one));
  if (truth_)
    list.push_back(saving(
        "truth",
        "garments only, a vertex per 15 mm, in steps of 1 mm; errors are of all",
        truth_->size()));
  return list;
}

void Report::finish() {
  if (input_->timing)
    series_.addTiming(
        (std::filesystem::path(input_->folder) / "timing.csv").string(), *input_->timing);
  nlohmann::json data = {
      {"program", std::string("simulcap ") + kVersion},
      {"frames", numShown_},
      {"frames_of", numFrames()},
      {"stride", stride_},
      {"frames_per_second", input_->performance.layout().framesPerSecond},
      {"series", series_.json()},
      {"metrics", input_->metrics},
      {"notes", input_->notes}};
  data["parts"] = parts_.finish();
  if (camera_)
    data["camera"] = camera_->finish();
  if (truth_)
    data["truth"] = truth_->finish();
  if (input_->comparison)
    data["comparison"] = *input_->comparison;
  if (input_->stability)
    data["stability"] = *input_->stability;
  if (input_->scene)
    data["scene"] = *input_->scene;
  data["savings"] = savings();  // after the last blocks are written
  page_.finish(data);
}

}  // namespace simulcap
