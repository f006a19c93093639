#include "src/input/recording.h"

#include "avatar/io/file_error.h"
#include "src/input/frame_list.h"
#include "src/input/input_warnings.h"
#include "src/input/intrinsics_file.h"
#include "src/input/picture_file.h"

#include <algorithm>
#include <filesystem>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

/// Raw depth as metres: 0 stays 0, and so does the largest number, which sensors use for "too far".
std::vector<float> inMetres(const std::vector<std::uint16_t>& raw, double unitsPerMetre) {
  constexpr std::uint16_t kSaturated = 65535;
  const auto metresPerUnit = static_cast<float>(1.0 / unitsPerMetre);
  std::vector<float> depth(raw.size());
  std::transform(raw.begin(), raw.end(), depth.begin(), [=](std::uint16_t value) {
    return value == kSaturated ? 0.0F : static_cast<float>(value) * metresPerUnit;
  });
  return depth;
}

double medianOf(std::vector<float> values) {
  std::erase(values, 0.0F);
  if (values.empty())
    return 0.0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

/// A sequence of files, one frame at a time.
class Recording : public FrameSource {
 public:
  Recording(
      std::string folder,
      RecordingIntrinsics intrinsics,
      std::vector<FrameFiles> frames,
      InputWarnings warnings)
      : folder_(std::move(folder)),
        intrinsics_(std::move(intrinsics)),
        frames_(std::move(frames)),
        warnings_(std::move(warnings)) {
    intrinsics_.info.numFrames = static_cast<int>(frames_.size());
  }

  const RecordingInfo& info() const override { return intrinsics_.info; }

  std::vector<std::string> warnings() const override { return warnings_.lines(); }

  std::optional<RgbdFrame> next() override {
    while (position_ < frames_.size()) {
      auto frame = read(frames_[position_++]);
      if (frame)
        return frame;
    }
    if (!lastTime_)
      throw avatar::FileError(
          folder_, "", "not one frame can be used: " + warnings_.lines().front());
    return std::nullopt;
  }

 private:
  std::optional<RgbdFrame> read(const FrameFiles& files) {
    const double time = files.timestamp.value_or(files.index / intrinsics_.info.framesPerSecond);
    if (lastTime_ && time <= *lastTime_) {
      warnings_.add("frames not later than the one before are skipped", files.depth);
      return std::nullopt;
    }
    const PictureSize size{intrinsics_.info.camera.width, intrinsics_.info.camera.height};
    RgbdFrame frame{.index = files.index, .width = size.width, .height = size.height};
    try {
      frame.depth = inMetres(readDepthPicture(files.depth, size), intrinsics_.depthScale);
    } catch (const PictureProblem& problem) {
      warnings_.add("frames are skipped: " + std::string(problem.what()), files.depth);
      return std::nullopt;
    }
    if (!lastTime_) {
      requirePlausibleUnits(frame.depth, files.depth);
      firstTime_ = time;
    }
    lastTime_ = time;
    frame.timestamp = time - firstTime_;
    readExtras(files, size, frame);
    return frame;
  }

  /// A frame can do without colour and labels.
  void readExtras(const FrameFiles& files, const PictureSize& size, RgbdFrame& frame) {
    const std::string* current = &files.color;
    try {
      if (!files.color.empty())
        frame.color = readColorPicture(files.color, size);
      else if (anyColor())
        warnings_.add("frames without colour", files.depth);
      current = &files.labels;
      if (!files.labels.empty())
        frame.labels = readLabelPicture(files.labels, size);
    } catch (const PictureProblem& problem) {
      warnings_.add("colour or labels are left out: " + std::string(problem.what()), *current);
    }
  }

  bool anyColor() const {
    return std::any_of(
        frames_.begin(), frames_.end(), [](const FrameFiles& f) { return !f.color.empty(); });
  }

  /// A wrong depth_scale shows in the first picture: no depth camera's scene is that near or far.
  void requirePlausibleUnits(const std::vector<float>& depth, const std::string& path) {
    constexpr double kMin = 0.15;  // [m]
    constexpr double kMax = 15.0;  // [m]
    const double median = medianOf(depth);
    if (median == 0.0)
      warnings_.add("frames without any depth", path);
    else if (!(median >= kMin && median <= kMax))
      throw avatar::FileError(
          path,
          "depth_scale",
          "with " + std::to_string(intrinsics_.depthScale) +
              " raw units per metre half of the picture is at " + std::to_string(median) +
              " m; correct depth_scale in intrinsics.json (1000: millimetres, 5000: TUM)");
  }

  std::string folder_;
  RecordingIntrinsics intrinsics_;
  std::vector<FrameFiles> frames_;
  InputWarnings warnings_;
  std::size_t position_ = 0;
  double firstTime_ = 0.0;
  std::optional<double> lastTime_;
};

std::unique_ptr<FrameSource> openTum(const std::string& folder) {
  InputWarnings warnings;
  const std::string path = (fs::path(folder) / "intrinsics.json").string();
  const bool known = fs::exists(path);
  RecordingIntrinsics intrinsics = known ? readIntrinsics(path) : tumIntrinsics();
  if (!known)
    warnings.add("no intrinsics.json: fx = fy = 525, 5000 units per metre assumed", folder);
  auto frames = listTum(folder, warnings);
  return std::make_unique<Recording>(
      folder, std::move(intrinsics), std::move(frames), std::move(warnings));
}

std::unique_ptr<FrameSource> openSequence(const std::string& folder) {
  InputWarnings warnings;
  RecordingIntrinsics intrinsics = readIntrinsics((fs::path(folder) / "intrinsics.json").string());
  auto frames = listSequence(folder, warnings);
  return std::make_unique<Recording>(
      folder, std::move(intrinsics), std::move(frames), std::move(warnings));
}

}  // namespace

std::unique_ptr<FrameSource> openRecording(const std::string& folder) {
  const fs::path root(folder);
  if (!fs::is_directory(root))
    throw avatar::FileError(
        folder, "", "no such folder; a recording is a folder with depth/ and intrinsics.json");
  if (fs::exists(root / "associations.txt") || fs::exists(root / "depth.txt"))
    return openTum(folder);
  return openSequence(folder);
}

FrameSupply recordingIn(const std::string& folder) {
  return {folder, [folder] { return openRecording(folder); }};
}

}  // namespace simulcap
