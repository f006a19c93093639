#include "src/commands/picture_input.h"

#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "avatar/skinning.h"
#include "src/commands/body_input.h"
#include "src/output/named_pose.h"
#include "src/program/console.h"
#include "src/report/report_input.h"
#include "src/scene/scene_file.h"
#include "src/simulation/motion_source.h"
#include "src/simulation/scene_run.h"
#include "src/simulation/stage_pictures.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <utility>

namespace simulcap {
namespace {

const Eigen::Vector3d kClothColor(0.45, 0.55, 0.70);  // of cloth that no avatar gives a colour

struct LabelledPose {
  std::string label;
  avatar::BodyPose pose;
};

avatar::UpAxis upAxis(const std::string& text) {
  if (text == "z")
    return avatar::UpAxis::kZ;
  return text == "y" ? avatar::UpAxis::kY : avatar::UpAxis::kAuto;
}

std::string frameLabel(int frame, double framesPerSecond) {
  char label[64];
  std::snprintf(label, sizeof label, "frame %d (%.2f s)", frame, frame / framesPerSecond);
  return label;
}

/// Numbers of the asked frames of `source`, which has so many.
std::vector<int> chosenFrames(
    const PictureRequest& request, const std::string& source, int numFrames) {
  std::vector<int> frames = request.frames;
  for (int f = 0; request.every > 0 && f < numFrames; f += request.every)
    frames.push_back(f);
  for (const int frame : frames)
    if (frame >= numFrames)
      throw UsageError(
          "--frame: " + source + " has the frames 0 to " + std::to_string(numFrames - 1) +
          ", found " + std::to_string(frame));
  if (!frames.empty())
    return frames;
  const int usual = std::min(request.usualFrames, numFrames);
  for (int i = 0; i < usual; ++i)
    frames.push_back(usual == 1 ? 0 : i * (numFrames - 1) / (usual - 1));
  return frames;
}

std::vector<LabelledPose> motionPoses(
    const PictureRequest& request, const avatar::ShapedBody& shaped, const Console& console) {
  const avatar::MotionFile file =
      loadMotion(request.motion, restSkeleton(shaped), upAxis(request.upAxis));
  for (const std::string& warning : file.warnings)
    console.warn(warning);
  const avatar::Motion& motion = file.motion;
  std::vector<LabelledPose> poses;
  for (const int frame :
       chosenFrames(request, request.motion, static_cast<int>(motion.frames.size())))
    poses.push_back(
        {frameLabel(frame, motion.framesPerSecond),
         motion.frames[static_cast<std::size_t>(frame)]});
  return poses;
}

/// Of one shape: its poses, or the frames of its motion.
std::vector<LabelledPose> chosenPoses(
    const PictureRequest& request, const avatar::ShapedBody& shaped, const Console& console) {
  if (!request.motion.empty())
    return motionPoses(request, shaped, console);
  if (!request.frames.empty() || request.every > 0)
    throw UsageError("--frame, --every: " + request.source + " has no frames; give it a --motion");
  std::vector<std::string> names = request.poses;
  if (names.empty())
    names = {"apose"};
  std::vector<LabelledPose> poses;
  poses.reserve(names.size());
  for (const std::string& name : names)
    poses.push_back({name, namedPose(name)});
  return poses;
}

PictureSubject bodySubject(const PictureRequest& request, const Console& console) {
  const auto model = std::make_shared<const avatar::BodyModel>(avatar::loadBody(request.source));
  PictureSubject subject{model, PicturedPerson(*model), {}, !request.motion.empty()};
  const avatar::Skinning skinning(*model);
  for (const NamedShape& shape : parseShapes(request.shapes, *model)) {
    const avatar::ShapedBody shaped = skinning.shape(shape.betas);
    for (const LabelledPose& pose : chosenPoses(request, shaped, console)) {
      const std::string separator = shape.label.empty() ? "" : ", ";
      subject.bodies.push_back(
          {shape.label + separator + pose.label, skinning.pose(shaped, pose.pose).vertices});
    }
  }
  return subject;
}

/// As a viewer shows it: garments follow the body unsimulated.
PictureSubject avatarSubject(const PictureRequest& request, const Console& console) {
  if (!request.shapes.empty())
    throw UsageError("--betas: an avatar has its own shape; leave it out");
  const auto dressed =
      std::make_shared<const avatar::LayeredAvatar>(avatar::readAvatar(request.source));
  PictureSubject subject{dressed, PicturedPerson(dressed->body), {}, !request.motion.empty()};
  const avatar::ShapedBody shaped{dressed->body.mesh.vertices, dressed->body.joints};
  for (const LabelledPose& pose : chosenPoses(request, shaped, console)) {
    PicturedBody body{pose.label, avatar::posedVertices(dressed->body, pose.pose)};
    for (const avatar::Garment& garment : dressed->garments)
      body.garments.push_back(
          {{avatar::posedVertices(garment, dressed->body, pose.pose), garment.mesh.faces},
           garment.color,
           garment.vertexColors});
    subject.bodies.push_back(std::move(body));
  }
  return subject;
}

void requireNoPose(const PictureRequest& request, const std::string& kind) {
  const std::pair<const char*, bool> given[] = {
      {"--betas", !request.shapes.empty()},
      {"--pose", !request.poses.empty()},
      {"--motion", !request.motion.empty()}};
  for (const auto& [option, isGiven] : given)
    if (isGiven)
      throw UsageError(std::string(option) + ": " + kind + " has its own; leave it out");
}

/// Puts moments where frames ask for them, which may be in any order and twice.
void place(
    const PicturedBody& moment,
    int frame,
    const std::vector<int>& frames,
    std::vector<PicturedBody>& bodies) {
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (frames[i] == frame)
      bodies[i] = moment;
}

bool isAsked(int frame, const std::vector<int>& frames) {
  return std::find(frames.begin(), frames.end(), frame) != frames.end();
}

PictureSubject sceneSubject(const PictureRequest& request, const CommandContext& context) {
  requireNoPose(request, "a scene");
  const Scene scene = readScene(request.source);
  const auto stage = std::make_shared<const Stage>(setStage(scene));
  for (const std::string& note : stage->notes)
    context.console.info(note);
  const StagePictures pictures(scene, *stage);
  const std::vector<int> frames = chosenFrames(request, request.source, stage->numFrames);
  PictureSubject subject{stage, pictures.person(), {}, true};
  subject.bodies.resize(frames.size());
  SceneRun run(scene, *stage, context.threads);
  const int last = stage->numPrerollFrames + *std::max_element(frames.begin(), frames.end());
  Progress progress(context.console, "simulating", last + 1, "frames");
  for (int staged = 0; staged <= last; ++staged) {
    if (staged > 0)
      run.advance();
    const int frame = staged - stage->numPrerollFrames;
    if (isAsked(frame, frames)) {
      PicturedBody moment = pictures.moment(run);
      moment.label = frameLabel(frame, stage->framesPerSecond);
      place(moment, frame, frames, subject.bodies);
    }
    progress.advance();
  }
  return subject;
}

PicturedBody momentOf(const ReportInput& input, const PerformanceFrame& frame) {
  PicturedBody moment;
  if (input.body)
    moment.vertices = input.body->vertices(frame.pose);
  const std::vector<PerformanceLayout::Garment>& layout = input.performance.layout().garments;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    PicturedMesh mesh{{frame.garments[i].vertices.cast<double>(), layout[i].faces}, kClothColor};
    if (input.avatar)
      for (const avatar::Garment& worn : input.avatar->garments)
        if (worn.name == layout[i].name) {
          mesh.color = worn.color;
          mesh.vertexColors = worn.vertexColors;
        }
    moment.garments.push_back(std::move(mesh));
  }
  return moment;
}

PictureSubject performanceSubject(const PictureRequest& request, const Console& console) {
  requireNoPose(request, "a performance");
  const std::shared_ptr<ReportInput> input = openPerformed(request.source);
  for (const std::string& note : input->notes)
    console.info(note);
  const std::vector<int> frames =
      chosenFrames(request, request.source, static_cast<int>(input->performance.numFrames()));
  PictureSubject subject{
      input,
      input->avatar ? PicturedPerson(input->avatar->body) : PicturedPerson::nobody(),
      {},
      true};
  subject.bodies.resize(frames.size());
  const int last = *std::max_element(frames.begin(), frames.end());
  for (int frame = 0; frame <= last; ++frame) {
    const std::optional<PerformanceFrame> performed = input->performance.next();
    if (!isAsked(frame, frames))
      continue;
    PicturedBody moment = momentOf(*input, *performed);
    moment.label = frameLabel(frame, input->performance.layout().framesPerSecond);
    place(moment, frame, frames, subject.bodies);
  }
  return subject;
}

}  // namespace

void addPictureInput(CLI::App& verb, PictureRequest& request) {
  verb.add_option(
          "WHAT",
          request.source,
          "'default' (the built-in body), a body model .npz, an avatar .glb, a scene .json (it is "
          "simulated as far as it is pictured), or the output folder of a capture or simulation")
      ->capture_default_str();
  addShapeOption(verb, request.shapes, "rows");
  verb.add_option(
          "--pose",
          request.poses,
          "Poses of a body or avatar, separated by commas (default: apose)")
      ->delimiter(',')
      ->check(CLI::IsMember(namedPoses()));
  CLI::Option* motion =
      verb.add_option(
              "--motion",
              request.motion,
              "Motion instead of poses: a clip (" + clipList() + "), an AMASS-style .npz or a .bvh")
          ->type_name("CLIP|FILE")
          ->excludes("--pose");
  CLI::Option* frames =
      verb.add_option(
              "--frame,--frames",
              request.frames,
              "Frames of the motion, the scene or the output, separated by commas, from 0 "
              "(default: 0, or six on a sheet)")
          ->delimiter(',')
          ->check(CLI::NonNegativeNumber);
  verb.add_option("--every", request.every, "Each n-th frame of these")
      ->check(CLI::PositiveNumber)
      ->excludes(frames);
  verb.add_option(
          "--up",
          request.upAxis,
          "Up axis of the motion file, y or z (default: what the file says)")
      ->check(CLI::IsMember({"y", "z"}))
      ->needs(motion);
}

PictureSubject pictureSubject(const PictureRequest& request, const CommandContext& context) {
  if (request.source.ends_with(".glb"))
    return avatarSubject(request, context.console);
  if (request.source.ends_with(".json"))
    return sceneSubject(request, context);
  if (std::filesystem::is_directory(request.source))
    return performanceSubject(request, context.console);
  return bodySubject(request, context.console);
}

}  // namespace simulcap
