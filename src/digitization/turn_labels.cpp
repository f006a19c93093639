#include "src/digitization/turn_labels.h"

#include "avatar/io/file_error.h"
#include "src/input/picture_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

/// The part of a whole picture's labels that a frame shows, where depth shows the person.
std::vector<std::uint8_t> labelsOfBox(
    const std::vector<std::uint8_t>& labels,
    const avatar::Camera& whole,
    const avatar::PosedDepthFrame& frame) {
  const auto left = static_cast<int>(std::lround(whole.cx - frame.camera.cx));
  const auto top = static_cast<int>(std::lround(whole.cy - frame.camera.cy));
  std::vector<std::uint8_t> result(frame.depth.size(), kBackground);
  for (int y = 0; y < frame.camera.height; ++y) {
    for (int x = 0; x < frame.camera.width; ++x) {
      const std::size_t pixel = frame.index(x, y);
      if (frame.depth[pixel] > 0.0F)
        result[pixel] = labels
            [static_cast<std::size_t>(y + top) * static_cast<std::size_t>(whole.width) +
             static_cast<std::size_t>(x + left)];
    }
  }
  return result;
}

/// Pixels of the person by what a network took them for.
struct ClassCounts {
  std::array<long, kOnePieceClass + 1> pixels = {};

  long of(ParsingClass what) const { return pixels[what]; }

  long all() const {
    long sum = 0;
    for (const long count : pixels)
      sum += count;
    return sum;
  }
};

void label(avatar::PosedDepthFrame& frame, HumanParser& parser, ClassCounts& counts) {
  const std::vector<ParsingClass> classes = parser(frame.color);
  frame.labels.assign(frame.depth.size(), avatar::kNoLabel);
  for (std::size_t i = 0; i < classes.size(); ++i) {
    if (frame.depth[i] <= 0.0F)
      continue;
    ++counts.pixels[classes[i]];
    frame.labels[i] = classes[i] == kOnePieceClass ? std::uint8_t{avatar::kUpperLabel}
                                                   : static_cast<std::uint8_t>(classes[i]);
  }
}

}  // namespace

std::string labelPicturePath(const std::string& folder, int number) {
  std::array<char, 32> name = {};
  std::snprintf(name.data(), name.size(), "%06d.png", number);
  return (fs::path(folder) / name.data()).string();
}

void readTurnLabels(Turn& turn, const std::string& folder) {
  int found = 0;
  for (std::size_t f = 0; f < turn.frames.size(); ++f) {
    const std::string path = labelPicturePath(folder, turn.numbers[f]);
    if (!fs::exists(path))
      continue;
    try {
      const PictureSize size{.width = turn.camera.width, .height = turn.camera.height};
      turn.frames[f].labels =
          labelsOfBox(readLabelPicture(path, size), turn.camera, turn.frames[f]);
    } catch (const PictureProblem& problem) {
      throw avatar::FileError(
          path,
          "",
          std::string(problem.what()) +
              "; expected 8 bits: 0 background, 1 skin, 2 upper garment or dress, 3 lower garment");
    }
    ++found;
  }
  if (found == 0)
    throw avatar::FileError(
        folder,
        "",
        "has no labels of the turn's frames; expected " +
            fs::path(labelPicturePath("", turn.numbers.front())).string() +
            " or another of the frames that are used");
}

NetworkLabels parseTurn(Turn& turn, HumanParser& parser, int most) {
  std::vector<avatar::PosedDepthFrame*> open;
  for (avatar::PosedDepthFrame& frame : turn.frames) {
    if (frame.labels.empty() && !frame.color.rgb.empty())
      open.push_back(&frame);
  }
  const bool nothingLabelled = std::all_of(
      turn.frames.begin(), turn.frames.end(), [](const auto& f) { return f.labels.empty(); });
  if (open.empty() && nothingLabelled)
    throw std::runtime_error(
        "the recording has no colours that a human-parsing network could be shown");
  const auto count = std::min(open.size(), static_cast<std::size_t>(most));
  ClassCounts counts;
  for (std::size_t i = 0; i < count; ++i)
    label(*open[i * open.size() / count], parser, counts);
  // A network that works takes nearly all of a person for one.
  constexpr long kLeastShare = 4;
  if (counts.all() > 0 && kLeastShare * (counts.all() - counts.of(kNoClass)) < counts.all())
    throw std::runtime_error(
        "the human-parsing network takes most of the person for background: check what it expects "
        "(colour order, mean, scale, classes) and say so in a .json file beside it");
  constexpr long kFewLower = 10;
  return {
      .frames = static_cast<int>(count),
      .onePiece = counts.of(kOnePieceClass) > counts.of(kUpperClass) &&
                  counts.of(kOnePieceClass) > kFewLower * counts.of(kLowerClass)};
}

}  // namespace simulcap
