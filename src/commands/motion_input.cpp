#include "src/commands/motion_input.h"

#include "avatar/io/file_error.h"
#include "avatar/io/motion_file.h"
#include "avatar/motion_clips.h"
#include "src/commands/commands.h"
#include "src/program/console.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <utility>

namespace simulcap {
namespace {

std::string clipList() {
  std::string names;
  for (const std::string_view name : avatar::clipNames())
    names += (names.empty() ? "" : ", ") + std::string(name);
  return names;
}

bool isClip(const std::string& name) {
  const std::vector<std::string_view>& names = avatar::clipNames();
  return std::find(names.begin(), names.end(), name) != names.end();
}

avatar::UpAxis upAxis(const std::string& text) {
  if (text == "z")
    return avatar::UpAxis::kZ;
  return text == "y" ? avatar::UpAxis::kY : avatar::UpAxis::kAuto;
}

avatar::Motion loadMotion(
    const MotionRequest& request, const avatar::RestSkeleton& body, const Console& console) {
  if (isClip(request.source))
    return avatar::makeClip(request.source, {.body = body});
  const std::string extension = std::filesystem::path(request.source).extension();
  if (extension != ".bvh" && extension != ".npz" && !std::filesystem::exists(request.source))
    throw avatar::FileError(
        request.source, "", "neither a built-in clip (" + clipList() + ") nor a .npz or .bvh file");
  avatar::MotionFile file =
      avatar::readMotion(request.source, {.up = upAxis(request.upAxis), .body = body});
  for (const std::string& warning : file.warnings)
    console.warn(warning);
  return std::move(file.motion);
}

/// Numbers of the asked frames; defaultCount of them, evenly spread, if none were asked for.
std::vector<int> chosenFrames(const MotionRequest& request, int numFrames, int defaultCount) {
  std::vector<int> frames = request.frames;
  for (int f = 0; request.every > 0 && f < numFrames; f += request.every)
    frames.push_back(f);
  if (!frames.empty())
    return frames;
  for (int i = 0; i < defaultCount; ++i)
    frames.push_back(defaultCount == 1 ? 0 : i * (numFrames - 1) / (defaultCount - 1));
  return frames;
}

}  // namespace

void addMotionOptions(CLI::App& verb, MotionRequest& request) {
  verb.add_option(
          "--motion",
          request.source,
          "Motion instead of poses: a clip (" + clipList() + "), an AMASS-style .npz or a .bvh")
      ->type_name("CLIP|FILE");
  CLI::Option* frames =
      verb.add_option(
              "--frame,--frames",
              request.frames,
              "Frames of the motion, separated by commas, from 0 (default: 0, or six on a sheet)")
          ->delimiter(',')
          ->check(CLI::NonNegativeNumber)
          ->needs("--motion");
  verb.add_option("--every", request.every, "Each n-th frame of the motion")
      ->check(CLI::PositiveNumber)
      ->needs("--motion")
      ->excludes(frames);
  verb.add_option(
          "--up",
          request.upAxis,
          "Up axis of the motion file, y or z (default: what the file says)")
      ->check(CLI::IsMember({"y", "z"}))
      ->needs("--motion");
}

avatar::RestSkeleton restSkeleton(const avatar::ShapedBody& body) {
  avatar::RestSkeleton skeleton;
  skeleton.joints = body.joints.leftCols<avatar::kNumSmplJoints>();
  skeleton.floorHeight = body.vertices.row(1).minCoeff();
  return skeleton;
}

std::vector<LabelledPose> motionPoses(
    const MotionRequest& request,
    const avatar::ShapedBody& body,
    int defaultCount,
    const Console& console) {
  const avatar::Motion motion = loadMotion(request, restSkeleton(body), console);
  const int numFrames = static_cast<int>(motion.frames.size());
  std::vector<LabelledPose> poses;
  for (const int frame : chosenFrames(request, numFrames, defaultCount)) {
    if (frame >= numFrames)
      throw UsageError(
          "--frame: " + request.source + " has the frames 0 to " + std::to_string(numFrames - 1) +
          ", found " + std::to_string(frame));
    char label[64];
    std::snprintf(label, sizeof label, "frame %d (%.2f s)", frame, frame / motion.framesPerSecond);
    poses.push_back({label, motion.frames[static_cast<std::size_t>(frame)]});
  }
  return poses;
}

}  // namespace simulcap
