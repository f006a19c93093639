#include "src/exporting/export_source.h"

#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "src/output/performance_reader.h"

#include <algorithm>

namespace simulcap {
namespace {

void requireSameGarments(const avatar::LayeredAvatar& avatar, const std::string& performance) {
  const PerformanceLayout layout = PerformanceReader(performance).layout();
  for (const avatar::Garment& garment : avatar.garments) {
    const auto found = std::find_if(
        layout.garments.begin(), layout.garments.end(), [&](const PerformanceLayout::Garment& g) {
          return g.name == garment.name;
        });
    const std::string key = "garment_" + garment.name;
    if (found == layout.garments.end())
      throw avatar::FileError(performance, key, "missing: the avatar beside it wears this garment");
    if (found->numVertices != garment.mesh.numVertices())
      throw avatar::FileError(
          performance,
          key,
          "has " + std::to_string(found->numVertices) + " vertices, the avatar's garment " +
              std::to_string(garment.mesh.numVertices()) + "; they are of different runs");
  }
}

/// The place of each of the avatar's garments in the performance.
std::vector<std::size_t> placesIn(
    const PerformanceLayout& layout, const avatar::LayeredAvatar& avatar) {
  std::vector<std::size_t> places;
  for (const avatar::Garment& garment : avatar.garments)
    places.push_back(static_cast<std::size_t>(
        std::find_if(
            layout.garments.begin(),
            layout.garments.end(),
            [&](const PerformanceLayout::Garment& g) { return g.name == garment.name; }) -
        layout.garments.begin()));
  return places;
}

}  // namespace

ExportSource openExportSource(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path))
    return {.avatar = avatar::readAvatar(path.string()), .performance = std::nullopt};
  const std::filesystem::path avatarFile = path / "avatar.glb";
  if (!std::filesystem::exists(avatarFile))
    throw avatar::FileError(
        path.string(),
        "avatar.glb",
        "missing: give an avatar, or the folder of a capture or simulation of one");
  ExportSource source = {.avatar = avatar::readAvatar(avatarFile.string()), .performance = {}};
  const std::filesystem::path performance = path / "performance.npz";
  if (std::filesystem::exists(performance)) {
    requireSameGarments(source.avatar, performance.string());
    source.performance = performance.string();
  }
  return source;
}

void forEachFrame(const ExportSource& source, const FrameVisitor& visit) {
  PerformanceReader reader(*source.performance);
  const std::vector<std::size_t> places = placesIn(reader.layout(), source.avatar);
  int number = 0;
  while (std::optional<PerformanceFrame> frame = reader.next()) {
    std::vector<Eigen::Matrix3Xf> garments;
    garments.reserve(places.size());
    for (const std::size_t place : places)
      garments.push_back(std::move(frame->garments[place].vertices));
    visit(number++, frame->pose, garments);
  }
}

ExportPlace exportPlace(const std::filesystem::path& path, const std::string& extension) {
  if (extension.empty() || path.extension() != extension)
    return {.folder = path, .stem = "avatar", .isFolder = true};
  return {.folder = path.parent_path(), .stem = path.stem().string(), .isFolder = false};
}

}  // namespace simulcap
