#include "src/simulation/motion_source.h"

#include "avatar/io/file_error.h"
#include "avatar/motion_clips.h"

#include <filesystem>
#include <optional>
#include <string_view>

namespace simulcap {

avatar::RestSkeleton restSkeleton(const avatar::ShapedBody& body) {
  avatar::RestSkeleton skeleton;
  skeleton.joints = body.joints.leftCols<avatar::kNumSmplJoints>();
  skeleton.floorHeight = body.vertices.row(1).minCoeff();
  return skeleton;
}

avatar::MotionFile loadMotion(
    const std::string& source, const avatar::RestSkeleton& body, avatar::UpAxis up) {
  if (std::optional<avatar::NamedClip> clip = avatar::namedClip(source)) {
    clip->options.body = body;
    return {avatar::makeClip(clip->name, clip->options), {}};
  }
  const std::string extension = std::filesystem::path(source).extension().string();
  if (extension != ".bvh" && extension != ".npz" && !std::filesystem::exists(source))
    throw avatar::FileError(
        source,
        "",
        "neither a built-in clip (" + clipList() +
            "; turn:3.2 takes 3.2 s) nor a .npz or .bvh file");
  return avatar::readMotion(source, {.up = up, .body = body});
}

std::string clipList() {
  std::string names;
  for (const std::string_view name : avatar::clipNames())
    names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}

}  // namespace simulcap
