#include "src/simulation/stage.h"

#include "avatar/avatar_pose.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/io/file_error.h"
#include "avatar/io/mesh_file.h"
#include "avatar/io/npz.h"
#include "avatar/wardrobe/outfit.h"
#include "src/output/named_pose.h"
#include "src/simulation/motion_source.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

constexpr double kBlendSeconds = 1.0;  // from one motion to the next, and from the A-pose [s]

Eigen::VectorXd betasOf(const SceneBody& body, const avatar::BodyModel& model) {
  Eigen::VectorXd betas = Eigen::VectorXd::Zero(model.numBetas());
  if (const auto* preset = std::get_if<std::string>(&body.betas)) {
    for (const avatar::BodyPreset& candidate : avatar::bodyPresets()) {
      if (candidate.name == *preset)
        return candidate.betas;
    }
    throw std::runtime_error("body.betas: there is no preset '" + *preset + "'");
  }
  const auto& values = std::get<std::vector<double>>(body.betas);
  if (static_cast<Eigen::Index>(values.size()) > betas.size())
    throw std::runtime_error(
        "body.betas: " + std::to_string(values.size()) + " numbers given, the body has " +
        std::to_string(betas.size()) + " shape parameters");
  for (std::size_t i = 0; i < values.size(); ++i)
    betas[static_cast<Eigen::Index>(i)] = values[i];
  return betas;
}

/// Do the poses differ so little that nobody sees a jump?
bool isClose(const avatar::BodyPose& a, const avatar::BodyPose& b) {
  constexpr double kAngle = 0.02;   // [rad]
  constexpr double kLength = 0.01;  // [m]
  return (a.jointRotations - b.jointRotations).cwiseAbs().maxCoeff() < kAngle &&
         (a.translation - b.translation).norm() < kLength;
}

/// Minimum-jerk frames between two poses, neither of them included.
std::vector<avatar::BodyPose> bridge(
    const avatar::BodyPose& from, const avatar::BodyPose& to, double framesPerSecond) {
  std::vector<avatar::BodyPose> frames;
  const int count = static_cast<int>(std::lround(kBlendSeconds * framesPerSecond));
  frames.reserve(static_cast<std::size_t>(std::max(0, count - 1)));
  for (int i = 1; i < count; ++i)
    frames.push_back(
        avatar::interpolated(from, to, avatar::minimumJerk(static_cast<double>(i) / count)));
  return frames;
}

/// The body's motions one after the other, bridged where one doesn't begin as the last one ended.
std::vector<avatar::BodyPose> performed(
    const SceneBody& body,
    const avatar::RestSkeleton& skeleton,
    double framesPerSecond,
    std::vector<std::string>& warnings) {
  std::vector<avatar::BodyPose> poses;
  for (const std::string& source : body.motion) {
    const avatar::MotionFile file = loadMotion(source, skeleton, body.upAxis);
    warnings.insert(warnings.end(), file.warnings.begin(), file.warnings.end());
    const avatar::Motion motion = avatar::resampled(file.motion, framesPerSecond);
    if (!poses.empty() && !isClose(poses.back(), motion.frames.front())) {
      const auto between = bridge(poses.back(), motion.frames.front(), framesPerSecond);
      poses.insert(poses.end(), between.begin(), between.end());
    }
    poses.insert(poses.end(), motion.frames.begin(), motion.frames.end());
  }
  return poses;
}

/// A named pose with the soles on the floor.
avatar::BodyPose standing(const std::string& name, const avatar::RestSkeleton& skeleton) {
  avatar::BodyPose pose = namedPose(name);
  pose.translation.y() -= avatar::lowestSole(skeleton, pose);
  return pose;
}

bool isPlaced(const Placement& placement) {
  return !placement.position.isZero(0.0) || !placement.rotationDegrees.isZero(0.0);
}

/// Is it put on the body rather than placed in the scene?
bool isWorn(const SceneGarment& garment, const Scene& scene) {
  if (std::holds_alternative<TailoredGarment>(garment.source))
    return true;
  const auto* imported = std::get_if<ImportedGarment>(&garment.source);
  return imported != nullptr && scene.body && !isPlaced(imported->placement);
}

avatar::TriangleMesh readCloth(const ImportedGarment& garment, std::vector<std::string>& notes) {
  // The file's unit is the scene's to say; the reader's own check of sizes needs it.
  avatar::MeshFile file = avatar::readMesh(garment.file);
  notes.insert(notes.end(), file.warnings.begin(), file.warnings.end());
  file.mesh.vertices *= garment.scale;
  return std::move(file.mesh);
}

avatar::OutfitPiece outfitPiece(const SceneGarment& garment, std::vector<std::string>& notes) {
  if (const auto* tailored = std::get_if<TailoredGarment>(&garment.source))
    return avatar::GarmentOrder{
        .name = tailored->cut,
        .ease = tailored->ease,
        .edgeLength = tailored->edgeLength,
        .label = garment.name};
  return avatar::ModelledGarment{
      .name = garment.name, .mesh = readCloth(std::get<ImportedGarment>(garment.source), notes)};
}

std::vector<int> chosenPins(const SceneGarment& garment, const std::vector<int>& own) {
  if (garment.pins.empty())
    return own;
  std::vector<int> pins;
  for (const Pin& pin : garment.pins)
    pins.push_back(std::get<int>(pin));  // names were refused when the scene was read
  std::sort(pins.begin(), pins.end());
  pins.erase(std::unique(pins.begin(), pins.end()), pins.end());
  return pins;
}

void requirePinsExist(const StagedCloth& cloth) {
  if (!cloth.pins.empty() && cloth.pins.back() >= cloth.rest.numVertices())
    throw std::runtime_error(
        cloth.name + ": pins: vertex " + std::to_string(cloth.pins.back()) +
        " doesn't exist; the cloth has " + std::to_string(cloth.rest.numVertices()) + " vertices");
}

StagedCloth stagedProcedural(const SceneGarment& garment) {
  StagedCloth staged;
  const auto* sheet = std::get_if<ClothSheet>(&garment.source);
  const auto* tube = std::get_if<ClothTube>(&garment.source);
  const ProceduralCloth cloth = sheet != nullptr ? makeSheet(*sheet) : makeTube(*tube);
  staged.rest = cloth.mesh;
  staged.worldFromLocal = (sheet != nullptr ? sheet->placement : tube->placement).worldFromLocal();
  const std::optional<Twist>& twist = sheet != nullptr ? sheet->twist : tube->twist;
  staged.twist = twist.value_or(Twist{});
  const double turnsAtStart = staged.twist.seconds > 0.0 ? 0.0 : staged.twist.turns;
  staged.start = staged.worldFromLocal * twisted(cloth, turnsAtStart);
  staged.pins = pinnedVertices(cloth, garment.pins);
  if (staged.twist.seconds > 0.0)
    staged.twistedCloth = cloth;
  return staged;
}

StagedCloth stagedFree(const SceneGarment& garment, std::vector<std::string>& notes) {
  const auto* imported = std::get_if<ImportedGarment>(&garment.source);
  if (imported == nullptr)
    return stagedProcedural(garment);
  StagedCloth staged;
  staged.rest = readCloth(*imported, notes);
  staged.start = imported->placement.worldFromLocal() * staged.rest.vertices;
  staged.pins = chosenPins(garment, {});
  return staged;
}

/// What the body wears, in the pose in which the scene begins.
StagedCloth stagedWorn(
    const SceneGarment& garment,
    avatar::Garment& worn,
    const avatar::AvatarBody& dressed,
    const StagedBody& body) {
  worn.cloth = garment.cloth.parameters;
  worn.pins = chosenPins(garment, worn.pins);
  StagedCloth staged;
  staged.rest = worn.mesh;
  staged.start = avatar::posedVertices(worn, dressed, body.poses().front());
  staged.pins = worn.pins;
  staged.color = worn.color;
  if (!staged.pins.empty()) {
    requirePinsExist(staged);
    const Eigen::Matrix3Xd skin = body.vertices(0);
    staged.attachment = avatar::SurfaceAttachment(
        staged.start(Eigen::all, staged.pins), avatar::MeshView(skin, body.model().faces));
  }
  return staged;
}

void dressBody(const Scene& scene, Stage& stage) {
  avatar::Outfit outfit;
  outfit.order = avatar::LayerOrder::kAsListed;
  for (const SceneGarment& garment : scene.garments) {
    if (isWorn(garment, scene))
      outfit.pieces.push_back(outfitPiece(garment, stage.notes));
  }
  avatar::DressedAvatar dressed = avatar::dressed(stage.body->model(), stage.body->betas(), outfit);
  stage.notes.insert(stage.notes.end(), dressed.notes.begin(), dressed.notes.end());
  stage.avatar = std::move(dressed.avatar);
}

/// The body and how long it is on stage; no cloth yet.
Stage emptyStage(const Scene& scene, const StageOptions& options) {
  Stage stage;
  const SceneTime time = scene.time.value_or(SceneTime{});
  stage.framesPerSecond = time.framesPerSecond;
  stage.numFrames = numFrames(time).value_or(1);
  if (scene.body) {
    stage.body = std::make_unique<StagedBody>(*scene.body, time, options);
    stage.notes = stage.body->warnings();
    stage.numPrerollFrames = stage.body->numPrerollFrames();
    stage.numFrames = static_cast<int>(stage.body->poses().size()) - stage.numPrerollFrames;
  }
  return stage;
}

void addCloths(const Scene& scene, Stage& stage) {
  std::size_t worn = 0;
  for (const SceneGarment& garment : scene.garments) {
    StagedCloth cloth =
        isWorn(garment, scene)
            ? stagedWorn(garment, stage.avatar->garments[worn++], stage.avatar->body, *stage.body)
            : stagedFree(garment, stage.notes);
    cloth.name = garment.name;
    cloth.parameters = garment.cloth.parameters;
    requirePinsExist(cloth);
    stage.cloths.push_back(std::move(cloth));
  }
}

}  // namespace

StagedBody::StagedBody(const SceneBody& body, const SceneTime& time, const StageOptions& options)
    : model_(std::make_unique<avatar::BodyModel>(avatar::loadBody(body.model))),
      skinning_(std::make_unique<avatar::Skinning>(*model_)),
      betas_(betasOf(body, *model_)),
      shaped_(skinning_->shape(betas_)) {
  const avatar::RestSkeleton skeleton = restSkeleton(shaped_);
  std::vector<avatar::BodyPose> shown =
      body.motion.empty() ? std::vector<avatar::BodyPose>{standing(body.pose, skeleton)}
                          : performed(body, skeleton, time.framesPerSecond, warnings_);
  if (const std::optional<int> count = numFrames(time))
    shown.resize(static_cast<std::size_t>(*count), shown.back());
  // Clothes are made in the A-pose: from there, where the first pose stands.
  avatar::BodyPose begin = standing("apose", skeleton);
  begin.translation.x() = shown.front().translation.x();
  begin.translation.z() = shown.front().translation.z();
  begin.jointRotations.head<3>() = Eigen::Vector3d(0.0, avatar::heading(shown.front()), 0.0);
  numSettleFrames_ = static_cast<int>(std::lround(options.settleSeconds * time.framesPerSecond));
  poses_.assign(static_cast<std::size_t>(numSettleFrames_), begin);
  if (!isClose(begin, shown.front())) {
    poses_.push_back(begin);
    const auto between = bridge(begin, shown.front(), time.framesPerSecond);
    poses_.insert(poses_.end(), between.begin(), between.end());
  }
  numPrerollFrames_ = static_cast<int>(poses_.size());
  poses_.insert(poses_.end(), shown.begin(), shown.end());
  if (!body.softTissue.empty())
    loadSoftTissue(body.softTissue);
  if (options.softTissue)
    softTissue_ = options.softTissue(*model_, shaped_);
}

void StagedBody::loadSoftTissue(const std::string& path) {
  const avatar::NpzArrays arrays = avatar::readNpz(path, {"offsets"});
  const auto found = arrays.find("offsets");
  const Eigen::Index numVertices = model_->numVertices();
  if (found == arrays.end() || found->second.shape.size() != 3 ||
      found->second.shape[1] != numVertices || found->second.shape[2] != 3)
    throw avatar::FileError(
        path,
        "offsets",
        "expected shape (T, " + std::to_string(numVertices) + ", 3), found " +
            (found == arrays.end() ? std::string("no such key") : found->second.shapeText()));
  const Eigen::MatrixXd rows = found->second.asMatrix();
  if (!rows.allFinite())
    throw avatar::FileError(path, "offsets", "expected finite numbers");
  for (const auto& row : rows.rowwise())
    recordedTissue_.push_back(row.reshaped(3, numVertices));
}

Eigen::Matrix3Xd StagedBody::vertices(int frame) const {
  const avatar::BodyPose& pose = poses_.at(static_cast<std::size_t>(frame));
  if (recordedTissue_.empty() && !softTissue_)
    return skinning_->pose(shaped_, pose).vertices;
  avatar::ShapedBody soft = shaped_;
  if (!recordedTissue_.empty()) {
    const auto shown = static_cast<std::size_t>(std::max(0, frame - numPrerollFrames_));
    soft.vertices += recordedTissue_[std::min(shown, recordedTissue_.size() - 1)];
  }
  if (softTissue_) {
    const double grown = avatar::minimumJerk((frame + 1.0) / (numSettleFrames_ + 1.0));
    soft.vertices += grown * softTissue_(pose);
  }
  return skinning_->pose(soft, pose).vertices;
}

Stage setStage(const Scene& scene, const StageOptions& options) {
  Stage stage = emptyStage(scene, options);
  if (scene.body)
    dressBody(scene, stage);
  addCloths(scene, stage);
  return stage;
}

Scene sceneOf(const avatar::LayeredAvatar& avatar, const SceneBody& body, const SceneTime& time) {
  Scene scene;
  scene.body = body;
  scene.time = time;
  for (const avatar::Garment& worn : avatar.garments) {
    SceneGarment garment;
    garment.name = worn.name;
    garment.cloth.parameters = worn.cloth;
    scene.garments.push_back(std::move(garment));
  }
  return scene;
}

Stage setStage(const Scene& scene, avatar::LayeredAvatar avatar) {
  if (!scene.body || scene.garments.size() != avatar.garments.size())
    throw std::invalid_argument("setStage: the scene is not the avatar's");
  Stage stage = emptyStage(scene, {});
  stage.avatar = std::move(avatar);
  addCloths(scene, stage);
  return stage;
}

Eigen::Matrix3Xd pinPositions(
    const StagedCloth& cloth, double seconds, const avatar::MeshView* body) {
  if (cloth.attachment && body != nullptr)
    return cloth.attachment->points(*body);
  if (!cloth.twistedCloth)
    return cloth.start(Eigen::all, cloth.pins);
  const double share = std::clamp(seconds / cloth.twist.seconds, 0.0, 1.0);
  const Eigen::Matrix3Xd turned =
      cloth.worldFromLocal * twisted(*cloth.twistedCloth, share * cloth.twist.turns);
  return turned(Eigen::all, cloth.pins);
}

}  // namespace simulcap
