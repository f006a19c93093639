#pragma once

#include "avatar/layered_avatar.h"

#include <Eigen/Core>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// What leaves the program: an avatar and, from a folder that a capture or a simulation wrote, how
/// it moved.
struct ExportSource {
  avatar::LayeredAvatar avatar;
  std::optional<std::string> performance;  ///< performance.npz of the same garments
};

/// Reads an avatar (.glb), or the avatar.glb and performance.npz of a folder. Throws
/// avatar::FileError for what can't be used: missing, damaged, a performance of other garments.
ExportSource openExportSource(const std::filesystem::path& path);

/// A frame's number, the body's pose and every garment's vertices, in the avatar's order [m].
using FrameVisitor =
    std::function<void(int, const avatar::BodyPose&, const std::vector<Eigen::Matrix3Xf>&)>;

/// Shows `visit` every frame of the source's performance; one is held at a time.
void forEachFrame(const ExportSource& source, const FrameVisitor& visit);

/// Where a format writes. A path with the format's own extension names the main file, and what goes
/// with it lies beside it under the same stem; any other path is a folder.
struct ExportPlace {
  std::filesystem::path folder;
  std::string stem;
  bool isFolder = true;

  std::string file(const std::string& name) const { return (folder / name).string(); }

  std::string main(const std::string& extension) const { return file(stem + extension); }
};

/// `extension` with its dot, or empty for formats that are folders.
ExportPlace exportPlace(const std::filesystem::path& path, const std::string& extension);

}  // namespace simulcap
