#include "src/evaluation/capture_evaluation.h"

#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/avatar_file.h"
#include "avatar/io/file_error.h"
#include "src/evaluation/camera_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace simulcap {
namespace {

std::string inFolder(const std::string& folder, const char* name) {
  return (std::filesystem::path(folder) / name).string();
}

const avatar::Garment& garmentOf(
    const avatar::LayeredAvatar& avatar,
    const PerformanceLayout::Garment& garment,
    const std::string& avatarPath) {
  for (const avatar::Garment& candidate : avatar.garments)
    if (candidate.name == garment.name && candidate.mesh.numVertices() == garment.numVertices &&
        candidate.mesh.faces == garment.faces)
      return candidate;
  throw avatar::FileError(
      avatarPath,
      "garment " + garment.name,
      "missing, or of another mesh than in performance.npz: they are not of one capture");
}

/// The body model that an avatar names; null, and why, when it can't be had.
std::shared_ptr<const avatar::BodyModel> modelOf(
    const avatar::AvatarBody& body, std::string& problem) {
  try {
    auto model = std::make_shared<avatar::BodyModel>(avatar::loadBody(body.model));
    if (definesJointsOf(*model, body))
      return model;
    problem = body.model + " isn't the model that the body was made with";
  } catch (const avatar::FileError& error) {
    problem = error.what();
  }
  return nullptr;
}

}  // namespace

CaptureEvaluation::CaptureEvaluation(const std::string& folder, const EvaluationOptions& options)
    : avatar_(avatar::readAvatar(inFolder(folder, "avatar.glb"))),
      performance_(inFolder(folder, "performance.npz")) {
  for (const PerformanceLayout::Garment& garment : performance_.layout().garments) {
    garments_.push_back(&garmentOf(avatar_, garment, inFolder(folder, "avatar.glb")));
    edgeStrains_.emplace_back(garments_.back()->mesh);
  }
  jitters_.resize(garments_.size());
  body_.emplace(
      avatar_.body,
      options.captureModel ? options.captureModel : modelOf(avatar_.body, missingModel_));
  penetration_.emplace(avatar_.body.mesh);
  if (options.truthFolder.empty())
    return;
  cameraFromWorld_ = readCameraFromWorld(inFolder(folder, "camera.json"));
  openTruth(options);
}

void CaptureEvaluation::openTruth(const EvaluationOptions& options) {
  const TrueBodyModel model =
      trueBodyModel(options.truthFolder, options.bodyModel, avatar_.body.model);
  if (!model.problem.empty())
    notes_.push_back(model.problem);
  truth_ = std::make_unique<GroundTruth>(options.truthFolder, model.name);
  CapturedLayers layers{avatar_.body.mesh.faces, {}};
  for (const avatar::Garment* garment : garments_)
    layers.garments.push_back({garment->name, garment->mesh.faces});
  if (truth_->bodyModel() != nullptr && !definesJointsOf(*truth_->bodyModel(), avatar_.body))
    notes_.emplace_back(
        "the truth's body model defines other joints than the capture's: no joint errors; capture "
        "with --body the truth's model");
  const CommonBody common{
      .joints =
          truth_->bodyModel() != nullptr && definesJointsOf(*truth_->bodyModel(), avatar_.body),
      .vertices = truth_->bodyFaces().cols() > 0 && truth_->bodyFaces() == layers.bodyFaces};
  comparison_.emplace(*truth_, std::move(layers), common, options.threads);
}

CapturedFrame CaptureEvaluation::captured(const PerformanceFrame& frame) const {
  CapturedFrame captured;
  captured.number = frame.recordingIndex;
  captured.body = cameraFromWorld_ * body_->vertices(frame.pose);
  captured.joints = cameraFromWorld_ * body_->joints(frame.pose);
  for (std::size_t i = 0; i < garments_.size(); ++i) {
    captured.garments.push_back(cameraFromWorld_ * frame.garments[i].vertices.cast<double>());
    if (truth_ != nullptr)
      captured.skinned.push_back(
          cameraFromWorld_ * avatar::posedVertices(*garments_[i], avatar_.body, frame.pose));
  }
  return captured;
}

/// What was fitted to depth was visible; the person stands still while the tracked joints do.
CapturedView CaptureEvaluation::viewWithoutTruth(
    const PerformanceFrame& frame, const CapturedFrame& captured) {
  constexpr double kStill = 0.002;  // mean motion of the joints from frame to frame [m]
  CapturedView view;
  for (const PerformanceFrame::Garment& garment : frame.garments) {
    std::vector<bool>& visible = view.garmentsVisible.emplace_back();
    for (const std::uint8_t provenance : garment.provenance)
      visible.push_back(provenance > 0);
  }
  view.still = lastJoints_.cols() == captured.joints.cols() &&
               (captured.joints - lastJoints_).colwise().norm().mean() <= kStill;
  lastJoints_ = captured.joints;
  return view;
}

bool CaptureEvaluation::advance() {
  const std::optional<PerformanceFrame> frame = performance_.next();
  if (!frame)
    return false;
  ++framesMeasured_;
  const CapturedFrame captured = this->captured(*frame);
  penetration_->moveBody(captured.body);
  for (std::size_t i = 0; i < garments_.size(); ++i) {
    edgeStrains_[i].add(captured.garments[i], strains_);
    penetration_->add(captured.garments[i]);
  }
  CapturedView view;
  if (!comparison_) {
    view = viewWithoutTruth(*frame, captured);
  } else if (captured.number < truth_->numFrames()) {
    view = comparison_->add(captured);
  } else {
    ++framesWithoutTruth_;
    return true;
  }
  for (std::size_t i = 0; i < garments_.size(); ++i)
    jitters_[i].add(captured.number, captured.garments[i], view.garmentsVisible[i], view.still);
  return true;
}

nlohmann::json CaptureEvaluation::figures() const {
  nlohmann::json figures = nlohmann::json::object();
  if (!strains_.empty())
    figures["edge_strain"] = {
        {"mean", strains_.mean()}, {"p95", strains_.quantile(0.95)}, {"max", strains_.max()}};
  if (penetration_->vertices() > 0)
    figures["penetration"] = {
        {"fraction",
         static_cast<double>(penetration_->inside()) /
             static_cast<double>(penetration_->vertices())},
        {"max_mm", 1000.0 * penetration_->deepest()}};
  Jitter jitter;
  for (const Jitter& garment : jitters_)
    jitter += garment;
  if (jitter.measuredVisible())
    figures["jitter_mm_per_frame"]["visible"] = 1000.0 * jitter.visible();
  if (jitter.measuredHidden())
    figures["jitter_mm_per_frame"]["hidden"] = 1000.0 * jitter.hidden();
  if (comparison_)
    figures["ground_truth"] = comparison_->figures();
  return figures;
}

std::vector<std::string> CaptureEvaluation::notes() const {
  std::vector<std::string> notes = notes_;
  if (!missingModel_.empty())
    notes.push_back(
        std::to_string(framesMeasured_) +
        " frames have the avatar's body without pose blend shapes: " + missingModel_);
  if (comparison_)
    notes.insert(notes.end(), comparison_->notes().begin(), comparison_->notes().end());
  if (framesWithoutTruth_ > 0)
    notes.push_back(std::to_string(framesWithoutTruth_) + " frames lie beyond the truth's end");
  return notes;
}

}  // namespace simulcap
