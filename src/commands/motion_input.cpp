#include "src/commands/motion_input.h"

#include "src/commands/commands.h"
#include "src/program/console.h"
#include "src/simulation/motion_source.h"

#include <CLI/CLI.hpp>

#include <cstdio>

namespace simulcap {
namespace {

avatar::UpAxis upAxis(const std::string& text) {
  if (text == "z")
    return avatar::UpAxis::kZ;
  return text == "y" ? avatar::UpAxis::kY : avatar::UpAxis::kAuto;
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

std::vector<LabelledPose> motionPoses(
    const MotionRequest& request,
    const avatar::ShapedBody& body,
    int defaultCount,
    const Console& console) {
  const avatar::MotionFile file =
      loadMotion(request.source, restSkeleton(body), upAxis(request.upAxis));
  for (const std::string& warning : file.warnings)
    console.warn(warning);
  const avatar::Motion& motion = file.motion;
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
