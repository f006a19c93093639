#include "src/input/frame_list.h"

#include "avatar/io/file_error.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

/// The whole text as a number, or nothing.
template <typename Number>
std::optional<Number> numberIn(const std::string& text) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end)
    return std::nullopt;
  return value;
}

std::optional<double> timeIn(const std::string& text) {
  const auto value = numberIn<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

/// Pictures of a folder by the number that is their name.
std::map<int, std::string> numberedPictures(const std::string& folder, InputWarnings& warnings) {
  std::map<int, std::string> result;
  std::vector<fs::path> paths;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const fs::path& path : paths) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
      return static_cast<char>(std::tolower(c));
    });
    const auto number = numberIn<int>(path.stem().string());
    const bool picture = extension == ".png" || extension == ".jpg" || extension == ".jpeg";
    if (!picture || !number || *number < 0)
      warnings.add("files that are no numbered PNG or JPEG are left out", path.string());
    else if (!result.emplace(*number, path.string()).second)
      warnings.add("frames with the same number: only the first is used", path.string());
  }
  return result;
}

/// One entry per line; nothing where a line is no time.
std::vector<std::optional<double>> readTimestamps(const std::string& path) {
  std::vector<std::optional<double>> result;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string word;
    if (words >> word && word[0] != '#')
      result.push_back(timeIn(word));
  }
  return result;
}

/// One stamp per frame: per file if the counts agree, else per frame number.
void assignTimestamps(
    const std::string& path, std::vector<FrameFiles>& frames, InputWarnings& warnings) {
  if (!fs::exists(path))
    return;
  const auto stamps = readTimestamps(path);
  const bool perFile = stamps.size() == frames.size();
  std::vector<FrameFiles> kept;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t line = perFile ? i : static_cast<std::size_t>(frames[i].index);
    if (line < stamps.size() && stamps[line]) {
      frames[i].timestamp = stamps[line];
      kept.push_back(std::move(frames[i]));
    } else {
      warnings.add("frames without a time in timestamps.txt are skipped", frames[i].depth);
    }
  }
  if (kept.empty())
    throw avatar::FileError(
        path,
        "",
        "has a time for none of the frames: write seconds, one per frame, or delete the file");
  frames = std::move(kept);
}

std::string found(const std::map<int, std::string>& pictures, int index) {
  const auto entry = pictures.find(index);
  return entry == pictures.end() ? "" : entry->second;
}

/// One line of TUM's lists: times and file names in turn.
struct TimedFile {
  double time = 0.0;
  std::string path;
};

/// The pairs (time, file) of every line with at least `pairs` of them.
std::vector<std::vector<TimedFile>> readTimedFiles(
    const std::string& folder, const char* name, std::size_t pairs, InputWarnings& warnings) {
  std::vector<std::vector<TimedFile>> lines;
  const std::string path = (fs::path(folder) / name).string();
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::string time;
    std::string picture;
    std::vector<TimedFile> entries;
    if (line.empty() || line[0] == '#' || line[0] == '\r')
      continue;
    while (words >> time >> picture) {
      if (const auto seconds = timeIn(time))
        entries.push_back({*seconds, (fs::path(folder) / picture).string()});
    }
    if (entries.size() >= pairs)
      lines.push_back(std::move(entries));
    else
      warnings.add(
          "lines that are no \"time file\" are left out",
          std::string(path).append(": ").append(line));
  }
  return lines;
}

std::vector<FrameFiles> associatedFrames(const std::string& folder, InputWarnings& warnings) {
  std::vector<FrameFiles> frames;
  for (auto& pair : readTimedFiles(folder, "associations.txt", 2, warnings)) {
    // associate.py puts the first list first, mostly colour; the names tell.
    const std::size_t name = pair[0].path.rfind("depth");
    const bool depthFirst = name != std::string::npos && name >= folder.size();
    const TimedFile& depth = pair[depthFirst ? 0 : 1];
    const TimedFile& color = pair[depthFirst ? 1 : 0];
    frames.push_back(
        {.index = static_cast<int>(frames.size()),
         .timestamp = depth.time,
         .depth = depth.path,
         .color = color.path});
  }
  return frames;
}

/// The colour nearest in time, if it is near enough to show the same moment.
std::string nearestColor(const std::vector<TimedFile>& colors, double time) {
  constexpr double kMaxDifference = 0.02;  // [s], TUM's associate.py
  const auto after = std::lower_bound(
      colors.begin(), colors.end(), time, [](const TimedFile& c, double t) { return c.time < t; });
  std::string best;
  double bestDifference = kMaxDifference;
  const auto consider = [&](const TimedFile& color) {
    if (std::abs(color.time - time) <= bestDifference) {
      best = color.path;
      bestDifference = std::abs(color.time - time);
    }
  };
  if (after != colors.begin())
    consider(*(after - 1));
  if (after != colors.end())
    consider(*after);
  return best;
}

std::vector<FrameFiles> matchedFrames(const std::string& folder, InputWarnings& warnings) {
  std::vector<TimedFile> colors;
  for (auto& line : readTimedFiles(folder, "rgb.txt", 1, warnings))
    colors.push_back(std::move(line[0]));
  std::stable_sort(colors.begin(), colors.end(), [](const TimedFile& a, const TimedFile& b) {
    return a.time < b.time;
  });
  std::vector<FrameFiles> frames;
  for (auto& line : readTimedFiles(folder, "depth.txt", 1, warnings)) {
    frames.push_back(
        {.index = static_cast<int>(frames.size()),
         .timestamp = line[0].time,
         .depth = line[0].path,
         .color = nearestColor(colors, line[0].time)});
  }
  return frames;
}

}  // namespace

std::vector<FrameFiles> listSequence(const std::string& folder, InputWarnings& warnings) {
  const fs::path root(folder);
  const auto depth = numberedPictures((root / "depth").string(), warnings);
  if (depth.empty())
    throw avatar::FileError(
        (root / "depth").string(), "", "has no depth pictures (000000.png, 000001.png, ...)");
  const auto color = numberedPictures((root / "color").string(), warnings);
  const auto labels = numberedPictures((root / "labels").string(), warnings);
  std::vector<FrameFiles> frames;
  for (const auto& [index, path] : depth) {
    for (int gap = frames.empty() ? index : frames.back().index + 1; gap < index; ++gap)
      warnings.add("frames are missing", "before " + path);
    frames.push_back(
        {.index = index,
         .depth = path,
         .color = found(color, index),
         .labels = found(labels, index)});
  }
  assignTimestamps((root / "timestamps.txt").string(), frames, warnings);
  return frames;
}

std::vector<FrameFiles> listTum(const std::string& folder, InputWarnings& warnings) {
  const bool associated = fs::exists(fs::path(folder) / "associations.txt");
  auto frames = associated ? associatedFrames(folder, warnings) : matchedFrames(folder, warnings);
  if (frames.empty())
    throw avatar::FileError(
        (fs::path(folder) / (associated ? "associations.txt" : "depth.txt")).string(),
        "",
        "names no depth picture: lines are \"time depth/file.png\" (depth.txt) or \"time "
        "rgb/file.png time depth/file.png\" (associations.txt)");
  return frames;
}

}  // namespace simulcap
