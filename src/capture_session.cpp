#include "src/capture_session.h"

#include "avatar/avatar_pose.h"
#include "avatar/motion.h"
#include "bullet_ext/core/stability.h"
#include "src/program/parallel_for.h"
#include "src/simulation/cloth_setup.h"
#include "src/simulation/stable_hinges.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

constexpr double kPaperRate = 30.0;        // frames per second that momentum is counted by
constexpr double kDressingRate = 30.0;     // frames per second of dressing
constexpr double kDressingMomentum = 0.8;  // that is left after each of them
constexpr double kStabilitySafety = 0.6;

class StopWatch {
 public:
  /// Since the beginning or the last call [ms].
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double result = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return result;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// As gt/labels name the garments; kBackground for those that could be either.
PixelLabel labelOf(const std::string& name) {
  for (const char* upper : {"upper", "dress", "tshirt", "shirt"}) {
    if (name == upper)
      return kUpper;
  }
  for (const char* lower : {"lower", "trousers", "shorts", "skirt"}) {
    if (name == lower)
      return kLower;
  }
  return kBackground;
}

bullet_ext::CaptureGarment captureGarment(const avatar::Garment& garment, double substep) {
  bullet_ext::CaptureGarment result;
  result.vertices = garment.mesh.vertices;
  result.faces = garment.mesh.faces;
  result.material = clothMaterial(garment.cloth);
  result.mesh.pins = garment.pins;
  result.mesh.edgeStretchStiffness = garment.cloth.edgeStretchStiffness;
  result.mesh.hingeTorsionStiffness = stableHinges(garment, substep);
  result.mesh.vertexMasses = garment.cloth.vertexMasses;
  result.layer = garment.layer;
  return result;
}

/// The pose a garment was made in, where the person stands and facing as it does.
avatar::BodyPose dressingPose(const avatar::Garment& garment, const avatar::BodyPose& first) {
  avatar::BodyPose pose = garment.bindPose;
  pose.translation = first.translation;
  pose.jointRotations.head<3>() = Eigen::Vector3d(0.0, avatar::heading(first), 0.0);
  return pose;
}

std::vector<std::uint8_t> provenanceOf(const GarmentTargets& targets, Eigen::Index numVertices) {
  std::vector<std::uint8_t> provenance(static_cast<std::size_t>(numVertices), 0);
  for (const bullet_ext::DepthTarget& target : targets.targets)
    provenance[static_cast<std::size_t>(target.vertex)] =
        static_cast<std::uint8_t>(std::lround(255.0F * target.blend));
  return provenance;
}

}  // namespace

struct CaptureSession::Layer {
  const avatar::Garment& garment;
  PixelLabel label;
  SteadyTargets steady;
  avatar::SurfaceAttachment pins;  // empty without pins
  Eigen::Matrix3Xd vertices;       // 3 × N [m], as last read from the world
  Eigen::Matrix3Xd reference;      // 3 × N [m], as it follows the body
  Eigen::Matrix3Xd followed;  // 3 × N [m], the same of the last frame; 3 × 0 before the first
};

CaptureSession::CaptureSession(
    const CapturePerson& person,
    const avatar::Camera& camera,
    const CaptureOptions& options,
    int threads)
    : person_(person),
      camera_(camera),
      options_(options),
      threads_(threads),
      skinning_(person.model),
      shaped_(skinning_.shape(person.avatar.body.betas)),
      viewer_(camera, options.view) {
  options.validate();
  if (person.avatar.body.mesh.numVertices() == shaped_.vertices.cols())
    shaped_.vertices = person.avatar.body.mesh.vertices;  // with the person's own details
  for (const avatar::Garment& garment : person.avatar.garments)
    layers_.push_back(
        {garment,
         labelOf(garment.name),
         SteadyTargets(garment.mesh.numVertices(), options.steadiness),
         attachedPins(garment),
         {},
         {},
         {}});
  setup_ = captureSetup(threads);
  try {
    world_ = std::make_unique<bullet_ext::CaptureWorld>(setup_);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(std::string("the avatar can't be simulated: ") + error.what());
  }
  if (isWarped(options.method)) {
    std::vector<PixelLabel> labels;
    labels.reserve(layers_.size());
    for (const Layer& layer : layers_)
      labels.push_back(layer.label);
    const WarpedParts parts = options.method == CaptureMethod::kNonrigidIcp
                                  ? WarpedParts::kGarments
                                  : WarpedParts::kWholePerson;
    WarpOptions warp = options.warp;
    warp.view = options.view;
    warped_ = std::make_unique<WarpedClothes>(person.avatar, camera, labels, parts, warp);
  }
  largestSubstep_ = 1.0;
  for (int i = 0; i < world_->numGarments(); ++i)
    largestSubstep_ = std::min(
        largestSubstep_,
        bullet_ext::stability(world_->mesh(i), {.safety = kStabilitySafety}).largestSubstep);
}

bullet_ext::CaptureSetup CaptureSession::captureSetup(int threads) const {
  bullet_ext::CaptureSetup setup;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    avatar::Garment garment = layers_[i].garment;
    if (!person_.restShapes.empty())
      garment.mesh.vertices = person_.restShapes.at(i);
    setup.garments.push_back(captureGarment(garment, options_.substepDuration));
  }
  setup.bodyFaces = person_.model.faces;
  setup.numBodyVertices = person_.model.numVertices();
  setup.garmentContact = options_.garmentContact && layers_.size() > 1;
  setup.contactInterval = options_.garmentContactInterval;
  if (options_.strainLimit)
    setup.strainLimit = bullet_ext::StrainLimitOptions{.limit = *options_.strainLimit};
  setup.simulation.stepper.threads = threads;
  setup.simulation.mostRedos = options_.mostRedos;
  return setup;
}

CaptureSession::~CaptureSession() = default;

CaptureResult CaptureSession::processFrame(const ObservedFrame& frame) {
  CaptureResult result{.pose = frame.body.pose, .status = frame.body.status};
  if (!dressed_ && isSimulated(options_.method))
    dress(frame.body.pose);
  StopWatch watch;
  result.bodyVertices = bodySurface(frame.body.pose);
  result.stable = moveGarments(frame, result.bodyVertices);
  for (const Layer& layer : layers_)
    result.garments.push_back({.unfitted = layer.vertices});
  result.times.simulation = watch.lap();

  const std::vector<GarmentView> views = view(result.bodyVertices);
  const bool fitted = isFitted(options_.method) && frame.body.status != TrackingStatus::kLost;
  const std::vector<GarmentTargets> targets =
      fitted ? fit(frame, views) : std::vector<GarmentTargets>(layers_.size());
  if (isSimulated(options_.method))
    calm(frame, targets);
  pose_ = frame.body.pose;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    CapturedGarment& garment = result.garments[i];
    garment.vertices = layers_[i].vertices;
    garment.visible.assign(views[i].visible.begin(), views[i].visible.end());
    garment.provenance = provenanceOf(targets[i], garment.vertices.cols());
    garment.rejected = targets[i].rejected;
  }
  result.times.fitting = watch.lap();
  return result;
}

/// In the pose the garment was made in, in which its mesh lies on the body.
avatar::SurfaceAttachment CaptureSession::attachedPins(const avatar::Garment& garment) const {
  if (garment.pins.empty())
    return {};
  const Eigen::Matrix3Xd body = bodySurface(garment.bindPose);
  return {garment.mesh.vertices(Eigen::all, garment.pins), {body, person_.model.faces}};
}

Eigen::Matrix3Xd CaptureSession::bodySurface(const avatar::BodyPose& pose) const {
  return skinning_.pose(shaped_, pose).vertices;
}

Eigen::Matrix3Xd CaptureSession::skinned(int garment, const avatar::BodyPose& pose) const {
  return avatar::posedVertices(
      layers_[static_cast<std::size_t>(garment)].garment, person_.avatar.body, pose);
}

int CaptureSession::substepsFor(double duration) const {
  const double substep = std::min(options_.longestSubstep, largestSubstep_);
  return std::max(1, static_cast<int>(std::ceil(duration / substep - 0.01)));
}

/// The clothes are put on in the pose they were made in, and the body moves from there to the first
/// frame's pose. They lose their momentum on the way: a skirt that still swings in the first frame
/// is decimetres from where it hangs.
void CaptureSession::dress(const avatar::BodyPose& pose) {
  dressed_ = true;
  pose_ = pose;
  if (layers_.empty())
    return;
  const avatar::BodyPose begin = dressingPose(layers_.front().garment, pose);
  for (int i = 0; i < world_->numGarments(); ++i) {
    const Eigen::Matrix3Xd start = skinned(i, begin);
    world_->setState(i, start, Eigen::Matrix3Xd::Zero(3, start.cols()));
  }
  world_->placeBody(bodySurface(begin));
  const int moving = static_cast<int>(std::lround(options_.dressingSeconds * kDressingRate));
  for (int i = 1; i <= moving + moving / 2; ++i) {
    const double share = static_cast<double>(i) / moving;
    const avatar::BodyPose next = avatar::interpolated(begin, pose, avatar::minimumJerk(share));
    simulate(bodySurface(next), 1.0 / kDressingRate);
    for (int garment = 0; garment < world_->numGarments(); ++garment)
      world_->setState(
          garment, world_->vertices(garment), kDressingMomentum * world_->velocities(garment));
  }
}

/// Takes the clothes along with the body through the part of a frame that isn't simulated; returns
/// what is left of it [s]. Where the body jumps, that is all of its way: they come to rest there.
double CaptureSession::carry(const ObservedFrame& frame) {
  const double simulated = std::min(frame.duration, options_.longestSimulated);
  const bool jumps = frame.body.status != TrackingStatus::kTracked;
  if (!jumps && simulated == frame.duration)
    return simulated;
  const avatar::BodyPose reached =
      jumps ? frame.body.pose
            : avatar::interpolated(pose_, frame.body.pose, 1.0 - simulated / frame.duration);
  for (int i = 0; i < world_->numGarments(); ++i) {
    Layer& layer = layers_[static_cast<std::size_t>(i)];
    Eigen::Matrix3Xd positions = world_->vertices(i);
    Eigen::Matrix3Xd velocities = world_->velocities(i);
    Eigen::Index v = 0;
    for (const Eigen::Affine3d& way :
         avatar::carryingTransforms(layer.garment, person_.avatar.body, pose_, reached)) {
      positions.col(v) = way * Eigen::Vector3d(positions.col(v));
      velocities.col(v) = (jumps ? 0.0 : 1.0) * (way.linear() * velocities.col(v));
      ++v;
    }
    world_->setState(i, positions, velocities);
    layer.followed = skinned(i, reached);
  }
  world_->placeBody(bodySurface(reached));
  return simulated;
}

/// Puts the clothes on as they follow the joints.
void CaptureSession::wear(const avatar::BodyPose& pose) {
  for (int i = 0; i < world_->numGarments(); ++i) {
    const Eigen::Matrix3Xd worn = skinned(i, pose);
    world_->setState(i, worn, Eigen::Matrix3Xd::Zero(3, worn.cols()));
    layers_[static_cast<std::size_t>(i)].vertices = world_->vertices(i);
  }
}

bool CaptureSession::simulate(const Eigen::Matrix3Xd& body, double duration) {
  const avatar::MeshView surface(body, person_.model.faces);
  for (int i = 0; i < world_->numGarments(); ++i) {
    const Layer& layer = layers_[static_cast<std::size_t>(i)];
    if (!layer.garment.pins.empty())
      world_->movePins(i, layer.pins.points(surface));
  }
  const bullet_ext::FrameReport report = world_->step(body, duration, substepsFor(duration));
  bodyVertices_ = body;
  for (int i = 0; i < world_->numGarments(); ++i)
    layers_[static_cast<std::size_t>(i)].vertices = world_->vertices(i);
  return report.stable;
}

void CaptureSession::follow(const avatar::BodyPose& pose) {
  if (warped_) {
    warped_->follow(pose);
    takeWarped();
    return;
  }
  for (int i = 0; i < static_cast<int>(layers_.size()); ++i)
    layers_[static_cast<std::size_t>(i)].vertices = skinned(i, pose);
}

void CaptureSession::takeWarped() {
  for (std::size_t i = 0; i < layers_.size(); ++i)
    layers_[i].vertices = warped_->garment(i);
}

/// False: the cloth blew up.
bool CaptureSession::moveGarments(const ObservedFrame& frame, const Eigen::Matrix3Xd& body) {
  if (!isSimulated(options_.method)) {
    follow(frame.body.pose);
    return true;
  }
  const bool stable = simulate(body, carry(frame));
  if (!stable)
    wear(frame.body.pose);
  return stable;
}

std::vector<GarmentView> CaptureSession::view(const Eigen::Matrix3Xd& body) {
  std::vector<avatar::MeshView> garments;
  for (const Layer& layer : layers_)
    garments.emplace_back(layer.vertices, layer.garment.mesh.faces);
  return viewer_(avatar::MeshView(body, person_.model.faces), garments);
}

/// Garments at the same time.
void CaptureSession::forEachLayer(const std::function<void(std::size_t)>& task) const {
  parallelFor(static_cast<long>(layers_.size()), threads_, [&](long i) {
    task(static_cast<std::size_t>(i));
  });
}

std::vector<GarmentTargets> CaptureSession::findTargets(
    const std::vector<GarmentView>& views, const DepthCloud& cloud) const {
  std::vector<GarmentTargets> targets(layers_.size());
  forEachLayer([&](std::size_t i) {
    const avatar::MeshView mesh(layers_[i].vertices, layers_[i].garment.mesh.faces);
    targets[i] = depthTargets(
        {.mesh = mesh, .view = views[i], .label = layers_[i].label},
        camera_,
        cloud,
        options_.targets);
  });
  return targets;
}

void CaptureSession::pull(const std::vector<GarmentTargets>& targets, bool goesOn) {
  const double substep = std::min(options_.fitSubstep, largestSubstep_);
  std::vector<std::unique_ptr<bullet_ext::DepthFittingForce>> forces;
  std::vector<const bullet_ext::ExternalForce*> pulling;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    forces.push_back(std::make_unique<bullet_ext::DepthFittingForce>(
        world_->mesh(static_cast<int>(i)), targets[i].targets, substep, options_.force));
    pulling.push_back(forces.back().get());
  }
  world_->fit(
      pulling,
      {.iterations = options_.fitIterations, .substepDuration = substep, .goesOn = goesOn});
  for (std::size_t i = 0; i < layers_.size(); ++i)
    layers_[i].vertices = world_->vertices(static_cast<int>(i));
}

/// Returns what the garments are pulled to at the end.
std::vector<GarmentTargets> CaptureSession::fit(
    const ObservedFrame& frame, const std::vector<GarmentView>& views) {
  if (options_.method == CaptureMethod::kSimulcap)
    return fitPhysically(frame, views);
  if (options_.method == CaptureMethod::kDirectFit)
    return fitDirectly(frame, views);
  std::vector<GarmentTargets> targets = warped_->fit(
      {bodySurface(frame.body.pose), person_.model.faces}, frame.cloud, options_.targets);
  takeWarped();
  return targets;
}

/// From where the joints have brought the garments, in every round.
std::vector<GarmentTargets> CaptureSession::fitDirectly(
    const ObservedFrame& frame, const std::vector<GarmentView>& views) {
  for (Layer& layer : layers_)
    layer.reference = layer.vertices;
  std::vector<GarmentTargets> targets = findTargets(views, frame.cloud);
  for (int round = 0; round < options_.fitRounds; ++round) {
    for (std::size_t i = 0; i < layers_.size(); ++i)
      layers_[i].vertices = directlyFitted(
          {layers_[i].reference, layers_[i].garment.mesh.faces}, targets[i], options_.direct);
    targets = findTargets(views, frame.cloud);
  }
  return targets;
}

std::vector<GarmentTargets> CaptureSession::fitPhysically(
    const ObservedFrame& frame, const std::vector<GarmentView>& views) {
  forEachLayer(
      [&](std::size_t i) { layers_[i].reference = skinned(static_cast<int>(i), frame.body.pose); });
  std::vector<GarmentTargets> targets = findTargets(views, frame.cloud);
  for (int round = 0; round < options_.fitRounds; ++round) {
    forEachLayer([&](std::size_t i) {
      Layer& layer = layers_[i];
      layer.steady.steady(targets[i], layer.reference, camera_);
      if (options_.pullAlongNormals)
        targets[i] = alongNormals(targets[i], {layer.vertices, layer.garment.mesh.faces});
    });
    pull(targets, options_.roundsGoOn && round > 0);
    targets = findTargets(views, frame.cloud);
  }
  for (Layer& layer : layers_)
    layer.steady.endFrame();
  return targets;
}

/// Takes momentum relative to the body, whose last motion took as long as was simulated.
void CaptureSession::calm(const ObservedFrame& frame, const std::vector<GarmentTargets>& targets) {
  const double frames = kPaperRate * frame.duration;
  const double simulated = std::min(frame.duration, options_.longestSimulated);
  const double hidden = std::pow(options_.hiddenMomentum, frames);
  const double fitted = std::pow(options_.fittedMomentum, frames);
  for (int i = 0; i < world_->numGarments(); ++i) {
    Layer& layer = layers_[static_cast<std::size_t>(i)];
    const Eigen::Matrix3Xd followed = skinned(i, frame.body.pose);
    if (layer.followed.cols() > 0 && (hidden < 1.0 || fitted < 1.0)) {
      Eigen::RowVectorXd kept = Eigen::RowVectorXd::Constant(followed.cols(), hidden);
      for (const bullet_ext::DepthTarget& target : targets[static_cast<std::size_t>(i)].targets)
        kept[target.vertex] += static_cast<double>(target.blend) * (fitted - hidden);
      const Eigen::Matrix3Xd body = (followed - layer.followed) / simulated;
      const Eigen::Matrix3Xd own = world_->velocities(i) - body;
      world_->setState(i, world_->vertices(i), body + own * kept.asDiagonal());
    }
    layer.followed = followed;
  }
}

CaptureState CaptureSession::state() const {
  CaptureState state{.bodyVertices = bodyVertices_, .pose = pose_};
  for (int i = 0; i < world_->numGarments(); ++i)
    state.garments.push_back(
        {world_->vertices(i),
         world_->velocities(i),
         layers_[static_cast<std::size_t>(i)].followed,
         layers_[static_cast<std::size_t>(i)].steady.state()});
  if (warped_)
    state.warps = warped_->state();
  return state;
}

void CaptureSession::restore(const CaptureState& state) {
  if (state.garments.size() != layers_.size())
    throw std::invalid_argument("CaptureSession: the state is of another avatar");
  bodyVertices_ = state.bodyVertices;
  pose_ = state.pose;
  if (warped_)
    warped_->restore(state.warps);
  if (bodyVertices_.cols() == 0)
    return;
  dressed_ = true;
  world_ = std::make_unique<bullet_ext::CaptureWorld>(setup_);
  world_->placeBody(bodyVertices_);
  for (int i = 0; i < world_->numGarments(); ++i) {
    const CaptureState::Garment& garment = state.garments[static_cast<std::size_t>(i)];
    world_->setState(i, garment.positions, garment.velocities);
    layers_[static_cast<std::size_t>(i)].followed = garment.followed;
    layers_[static_cast<std::size_t>(i)].steady.restore(garment.offsets);
  }
}

avatar::LayeredAvatar draped(const CapturePerson& person, int threads, double seconds) {
  avatar::LayeredAvatar avatar = person.avatar;
  if (std::all_of(avatar.garments.begin(), avatar.garments.end(), [](const auto& garment) {
        return garment.asWorn;
      }))
    return avatar;
  const avatar::Camera unused{.width = 1, .height = 1, .fx = 1.0, .fy = 1.0};
  CaptureSession session(
      person,
      unused,
      {.method = CaptureMethod::kSimulateOnly, .dressingSeconds = seconds},
      threads);
  const avatar::BodyPose pose = avatar.garments.front().bindPose;
  session.dress(pose);
  const CaptureState state = session.state();
  for (std::size_t i = 0; i < avatar.garments.size(); ++i) {
    if (avatar.garments[i].asWorn)
      continue;
    avatar.garments[i].mesh.vertices = state.garments[i].positions;
    avatar.garments[i].bindPose = pose;
  }
  return avatar;
}

}  // namespace simulcap
