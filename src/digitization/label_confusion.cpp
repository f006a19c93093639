#include "src/digitization/label_confusion.h"

#include "avatar/digitization/posed_frame.h"
#include "avatar/io/file_error.h"
#include "src/digitization/turn_labels.h"

#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <filesystem>

namespace simulcap {
namespace {

constexpr std::size_t kNumLabels = avatar::kNumSurfaceLabels + 1;

/// Pixels by their true label and by ours.
using Confusion = std::array<std::array<long, kNumLabels>, kNumLabels>;

void count(
    const ParsedPicture& picture,
    const std::vector<std::uint8_t>& truth,
    const PictureSize& size,
    Confusion& confusion) {
  for (std::size_t i = 0; i < picture.labels.size(); ++i) {
    const int x = picture.left + static_cast<int>(i) % picture.width;
    const int y = picture.top + static_cast<int>(i) / picture.width;
    const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) +
                              static_cast<std::size_t>(x);
    if (pixel < truth.size())
      ++confusion[truth[pixel]][picture.labels[i]];
  }
}

}  // namespace

nlohmann::json labelConfusion(
    const std::vector<ParsedPicture>& pictures,
    const std::string& truthFolder,
    const PictureSize& size) {
  const std::string folder = (std::filesystem::path(truthFolder) / "labels").string();
  Confusion confusion = {};
  bool known = false;
  for (const ParsedPicture& picture : pictures) {
    const std::string file = labelPicturePath(folder, picture.number);
    if (!std::filesystem::exists(file))
      continue;
    try {
      count(picture, readLabelPicture(file, size), size, confusion);
    } catch (const PictureProblem& problem) {
      throw avatar::FileError(file, "", problem.what());
    }
    known = true;
  }
  if (!known)
    return nullptr;
  constexpr std::array<const char*, kNumLabels> kNames = {"none", "skin", "upper", "lower"};
  nlohmann::json result = nlohmann::json::object();
  for (std::size_t truth = 1; truth < kNumLabels; ++truth) {
    long all = 0;
    for (std::size_t ours = 1; ours < kNumLabels; ++ours)
      all += confusion[truth][ours];
    for (std::size_t ours = 1; ours < kNumLabels && all > 0; ++ours)
      result[kNames[truth]][kNames[ours]] =
          static_cast<double>(confusion[truth][ours]) / static_cast<double>(all);
  }
  return result;
}

}  // namespace simulcap
