#include "src/tracking/body_tracker.h"

#include "avatar/axis_angle.h"
#include "avatar/io/prior_file.h"
#include "src/tracking/cloth_offsets.h"
#include "src/tracking/cloth_shapes.h"
#include "src/tracking/learned_bareness.h"
#include "src/tracking/limb_contact.h"
#include "src/tracking/match_quality.h"
#include "src/tracking/pose_solver.h"
#include "src/tracking/pose_uncertainty.h"
#include "src/tracking/start_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

namespace simulcap {
namespace {

/// Per unit² of beta, against the data term: what clothes hide, people are as others are.
constexpr double kBetaPrior = 1.0;
/// Per cm² of the widths of cloth regions. Where trunk and arms are, head and hands tell as well:
/// there, hardly anything was drawn to the camera.
constexpr std::array<double, kNumClothRegions> kWidthPriors = {0.2, 0.2, 0.8, 0.8, 0.2};
/// Of the shifts of loose clothes: most are smaller than their looseness, some aren't.
constexpr double kShiftPrior = 0.05;
/// Legs that cloth hides have next to nothing that tells how they are bent: most stand.
constexpr double kHiddenLegs = 2.0;  // [per rad²]
/// Of a frame's information that is new: noise, clothes and errors of matching repeat.
constexpr double kNewInformation = 0.2;
constexpr int kMinPersonPixels = 200;
/// Of λ_pri, in frames after the first with known clothes, and in captures of what holds hidden
/// legs straight: clothes tell more of a pose than the prior, which hardly knows some.
constexpr double kPriorInKnownClothes = 0.5;
constexpr double kFarOff = 0.08;  // [m]: a joint that may deviate by more is lost

avatar::BodyPose extrapolated(
    const avatar::BodyPose& before, const avatar::BodyPose& last, double ratio) {
  avatar::BodyPose pose = last;
  for (int joint = 0; joint < kNumTrackedJoints; ++joint) {
    const Eigen::Vector3d a = before.jointRotations.segment<3>(3 * joint);
    const Eigen::Vector3d b = last.jointRotations.segment<3>(3 * joint);
    const Eigen::Quaterniond now = avatar::quaternionFromAxisAngle(b);
    const Eigen::Vector3d turn =
        avatar::axisAngleFromQuaternion(avatar::quaternionFromAxisAngle(a).conjugate() * now);
    pose.jointRotations.segment<3>(3 * joint) =
        avatar::axisAngleFromQuaternion(now * avatar::quaternionFromAxisAngle(ratio * turn));
  }
  pose.translation += ratio * (last.translation - before.translation);
  return pose;
}

TrackedBody unknownBody() {
  TrackedBody body;
  body.jointDeviation.fill(std::numeric_limits<double>::infinity());
  body.jointLost.fill(true);
  return body;
}

bool isFound(const MatchQuality& quality, bool clothesKnown) {
  // Hems and skirts stand off farther than a match reaches while nobody knows them.
  const double minExplained = clothesKnown ? 0.90 : 0.80;
  constexpr double kMinOverlap = 0.70;
  constexpr double kMaxResidual = 0.04;  // [m]
  return quality.numMatches > 0 && quality.explained >= minExplained &&
         quality.overlap >= kMinOverlap && quality.medianResidual <= kMaxResidual;
}

}  // namespace

class BodyTracker::Implementation {
 public:
  Implementation(
      const avatar::BodyModel& model, const avatar::Camera& camera, const TrackerOptions& options)
      : model_(model),
        camera_(camera),
        options_((options.validate(), avatar::requireValid(camera), options)),
        surface_(std::make_unique<TrackedSurface>(model, options.numSamples)),
        regularizer_(
            avatar::PosePrior(options.posePrior ? *options.posePrior : avatar::builtInPrior()),
            options.usualLean),
        usualBareness_(usualBareness(*surface_)) {
    state_.betas = Eigen::VectorXd::Zero(surface_->numBetas());
    state_.betaInformation =
        kBetaPrior * Eigen::MatrixXd::Identity(surface_->numBetas(), surface_->numBetas());
    state_.bareness = usualBareness_;
    state_.clothOffsets = Eigen::VectorXd::Zero(std::ssize(surface_->samples()));
    state_.poseInformation = Eigen::MatrixXd::Zero(TrackingLayout::kBetas, TrackingLayout::kBetas);
    state_.betasHeld = !options.estimateShape || surface_->numBetas() == 0;
  }

  TrackedBody track(const DepthCloud& cloud, double timestamp) {
    requireFits(cloud, timestamp);
    const DepthView view(cloud, camera_, options_.numDepthSamples);
    const bool visible = view.numPersonPixels() >= kMinPersonPixels;
    if (state_.framesTracked == 0 && !visible) {
      return unknownBody();
    }
    const bool started = state_.framesTracked > 0;
    const JointSet held = longUnseen(state_.unseenSeconds);
    PoseSolution solution;
    solution.parameters = {started ? predicted(timestamp, held) : state_.pose, state_.betas};
    MatchQuality quality;
    bool found = false;
    if (visible && started) {
      PoseSolverOptions options = trackingOptions(timestamp);
      options.betas = betaKnowledge();
      options.held = held;
      solution = solvePose(*surface_, regularizer_, view, solution.parameters, options);
      solution.parameters.pose =
          settled(solution.parameters.pose, state_.pose, held, timestamp - state_.timestamp);
      quality = qualityOf(solution, view);
      found = isFound(quality, surface_->knowsClothes());
    }
    if (visible && (!started || (!found && state_.framesLost > 0))) {
      const PoseSolution fresh = startedAnew(view, timestamp);
      const MatchQuality freshQuality = qualityOf(fresh, view);
      constexpr double kClearlyBetter = 0.9;
      if (!started || freshQuality.meanCost < kClearlyBetter * quality.meanCost) {
        solution = fresh;
        quality = freshQuality;
        found = !started || isFound(quality, surface_->knowsClothes());
        state_.unseenSeconds = {};
        state_.poseInformation.setZero();
        addFrame(quality.jointUnseen, kNeverSeen, state_.unseenSeconds);
      }
    }
    if (found && cloud.labels.empty() && !surface_->knowsClothes())
      learn(solution, view);
    const double duration = started ? timestamp - state_.timestamp : 0.0;
    TrackedBody body = accepted(solution, quality, found, timestamp);
    if (surface_->clothUnknown() == ClothUnknown::kPlaces) {
      if (found)
        learnPlaces(solution, view, duration);
      else
        forgetPlaces();
    }
    return body;
  }

  const TrackerState& state() const { return state_; }

  void restore(const TrackerState& state) {
    if (state.betas.size() != surface_->numBetas() ||
        state.betaInformation.rows() != surface_->numBetas() ||
        state.betaInformation.cols() != surface_->numBetas() ||
        state.poseInformation.rows() != TrackingLayout::kBetas ||
        state.poseInformation.cols() != TrackingLayout::kBetas) {
      throw std::invalid_argument("BodyTracker::restore: the state is another model's");
    }
    surface_->setClothOffsets(state.clothOffsets);
    if (!surface_->knowsClothes())
      surface_->setBareness(state.bareness);
    state_ = state;
  }

  void setBetas(const Eigen::VectorXd& betas) {
    if (betas.size() > model_.numBetas() || !betas.allFinite()) {
      throw std::invalid_argument(
          "BodyTracker::setBetas: expected finite numbers, at most " +
          std::to_string(model_.numBetas()));
    }
    const Eigen::Index used = std::min<Eigen::Index>(betas.size(), surface_->numBodyBetas());
    state_.betas.head(surface_->numBodyBetas()).setZero();
    state_.betas.head(used) = betas.head(used);
    state_.betasHeld = true;
  }

  void holdBetas() { state_.betasHeld = true; }

  void setOuterLayer(const OuterLayer& layer) {
    surface_ = std::make_unique<TrackedSurface>(model_, options_.numSamples, &layer);
    const Eigen::VectorXd priors = clothPriors();
    state_.betas.conservativeResize(surface_->numBetas());
    state_.betas.tail(priors.size()).setZero();
    state_.betaInformation.conservativeResizeLike(
        Eigen::MatrixXd::Zero(surface_->numBetas(), surface_->numBetas()));
    state_.betaInformation.rightCols(priors.size()).setZero();
    state_.betaInformation.bottomRows(priors.size()).setZero();
    state_.betaInformation.diagonal().tail(priors.size()) = priors;
    state_.clothOffsets = Eigen::VectorXd::Zero(std::ssize(surface_->samples()));
  }

  Eigen::VectorXd betas() const { return state_.betas.head(surface_->numBodyBetas()); }

  Eigen::VectorXd clothWidths() const {
    const bool known = surface_->clothUnknown() != ClothUnknown::kWidths;
    return state_.betas.tail(known ? 0 : kNumClothRegions);
  }

 private:
  void requireFits(const DepthCloud& cloud, double timestamp) const {
    const auto size =
        static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height);
    if (cloud.width != camera_.width || cloud.height != camera_.height ||
        cloud.depth.size() != size || cloud.person.size() != size ||
        static_cast<std::size_t>(cloud.points.cols()) != size ||
        static_cast<std::size_t>(cloud.normals.cols()) != size ||
        (!cloud.labels.empty() && cloud.labels.size() != size)) {
      throw std::invalid_argument("BodyTracker: the cloud's size is not the camera's");
    }
    if (!std::isfinite(timestamp) || (state_.framesTracked > 0 && timestamp <= state_.timestamp)) {
      throw std::invalid_argument("BodyTracker: time must increase from frame to frame");
    }
  }

  avatar::BodyPose predicted(double timestamp, const JointSet& held) const {
    const double step = state_.timestamp - state_.timestampBefore;
    constexpr double kLongest = 0.15;  // [s]: farther ahead nobody moves on in a straight line
    constexpr double kPersistence = 0.8;
    if (state_.framesTracked < 2 || state_.framesLost > 0 || step > kLongest) {
      return state_.pose;
    }
    const double ahead = std::min(timestamp - state_.timestamp, kLongest);
    avatar::BodyPose pose = extrapolated(state_.before, state_.pose, kPersistence * ahead / step);
    for (int joint = 0; joint < kNumTrackedJoints; ++joint)
      if (held[static_cast<std::size_t>(joint)])
        pose.jointRotations.segment<3>(3 * joint) =
            state_.pose.jointRotations.segment<3>(3 * joint);
    return pose;
  }

  PoseSolverOptions trackingOptions(double timestamp) const {
    PoseSolverOptions solver = startOptions();
    solver.iterations = options_.iterations;
    solver.firstGate = options_.firstGate;
    solver.lastGate = options_.lastGate;
    solver.firstInterIterations = std::min(3, options_.iterations - 1);
    if (surface_->knowsClothes())
      solver.regularization.prior *= kPriorInKnownClothes;
    if (surface_->clothUnknown() == ClothUnknown::kPlaces)
      solver.regularization.straightLegs *= kPriorInKnownClothes;
    // What may have changed grows with time.
    constexpr double kUsualStep = 1.0 / 30.0;
    const double step = std::max(timestamp - state_.timestamp, 0.25 * kUsualStep);
    solver.regularization.temporal = std::min(4.0, kUsualStep / step) / (1.0 + state_.framesLost);
    return solver;
  }

  PoseSolverOptions startOptions() const {
    PoseSolverOptions solver;
    solver.dataWeight = options_.dataWeight;
    solver.firstInterWeight = options_.firstInterWeight;
    solver.laterInterWeight = options_.laterInterWeight;
    solver.clothOffset = options_.clothOffset;
    solver.floorHeight = options_.floorHeight;
    solver.regularization.prior = options_.priorWeight;
    solver.regularization.straightLegs = surface_->coversLegs() ? kHiddenLegs : 0.0;
    return solver;
  }

  /// Nothing: all are known.
  std::optional<BetaKnowledge> betaKnowledge() const {
    const Eigen::Index body = surface_->numBodyBetas();
    if (state_.betasHeld && surface_->numBetas() == body)
      return std::nullopt;
    BetaKnowledge knowledge{
        .mean = state_.betas,
        .information = state_.betaInformation,
        .numCertain = state_.betasHeld ? body : 0};
    if (surface_->clothUnknown() == ClothUnknown::kPlaces)
      knowledge.mean.tail(kNumClothShifts).setZero();
    return knowledge;
  }

  /// Of what is unknown of the clothes (inverse variances around 0).
  Eigen::VectorXd clothPriors() const {
    const Eigen::Index count = surface_->numBetas() - surface_->numBodyBetas();
    if (surface_->clothUnknown() == ClothUnknown::kWidths)
      return Eigen::Map<const Eigen::VectorXd>(kWidthPriors.data(), count);
    return Eigen::VectorXd::Constant(count, kShiftPrior);
  }

  /// The betas of the body, unless they are held, and the widths of the clothes. Where these hang
  /// is another thing in each frame, but the next one starts from there.
  void learnBetas(const PoseSolution& solution) {
    if (solution.betaInformation.size() == 0)
      return;
    const Eigen::VectorXd known = betas();
    state_.betas = solution.parameters.betas;
    if (state_.betasHeld)
      state_.betas.head(known.size()) = known;
    const bool hang = surface_->clothUnknown() == ClothUnknown::kPlaces;
    const Eigen::Index lasting = hang ? known.size() : state_.betas.size();
    state_.betaInformation.topLeftCorner(lasting, lasting) +=
        kNewInformation * solution.betaInformation.topLeftCorner(lasting, lasting);
  }

  /// Where loose clothes are.
  void learnPlaces(const PoseSolution& solution, const DepthView& view, double duration) {
    const PosedSamples posed = surface_->pose(solution.parameters, false);
    const SeenSamples seen = seenBy(view.camera(), posed, solution.visible);
    state_.clothOffsets =
        learnedOffsets(*surface_, seen, view.cloud(), duration, state_.clothOffsets);
    surface_->setClothOffsets(state_.clothOffsets);
  }

  /// Lost, what was learned of clothes led astray.
  void forgetPlaces() {
    state_.betas.tail(kNumClothShifts).setZero();
    state_.clothOffsets.setZero();
    surface_->setClothOffsets(state_.clothOffsets);
  }

  /// Which skin is bare.
  void learn(const PoseSolution& solution, const DepthView& view) {
    state_.bareness = learnedBareness(
        surface_->pose(solution.parameters, false),
        solution.visible,
        view,
        usualBareness_,
        std::move(state_.bareness));
    surface_->setBareness(state_.bareness);
  }

  MatchQuality qualityOf(const PoseSolution& solution, const DepthView& view) const {
    const PosedSamples posed = surface_->pose(solution.parameters, false);
    return matchQuality(*surface_, posed, solution.visible, view);
  }

  /// How far somebody may have turned since the last frame that they were found in [rad].
  double farthestTurn(double timestamp) const {
    constexpr double kUnsure = 1.0;   // [rad]: of the last pose itself
    constexpr double kFastest = 6.0;  // [rad/s]: a pirouette
    const double step = timestamp - state_.timestamp;
    return kUnsure + kFastest * step * (1.0 + state_.framesLost);
  }

  PoseSolution startedAnew(const DepthView& view, double timestamp) const {
    StartSearch search{
        .surface = *surface_,
        .regularizer = regularizer_,
        .solver = startOptions(),
        .betas = state_.betas,
        .fitHeight = !state_.betasHeld};
    search.solver.betas = betaKnowledge();
    if (state_.framesTracked > 0)
      search.last = LastFound{state_.pose, farthestTurn(timestamp)};
    return foundStart(search, view);
  }

  JointDeviations deviations(const BodyParameters& parameters) const {
    avatar::NormalEquations equations(TrackingLayout::kBetas);
    equations.matrix = state_.poseInformation;
    equations.matrix.diagonal().array() += 1e-6;
    regularizer_.add(
        parameters, parameters.pose, {.prior = options_.priorWeight, .temporal = 0.0}, equations);
    return jointDeviations(surface_->pose(parameters, false), equations.matrix);
  }

  TrackedBody accepted(
      PoseSolution& solution, const MatchQuality& quality, bool found, double timestamp) {
    shortenRotations(solution.parameters.pose);
    TrackedBody tracked = unknownBody();
    tracked.pose = solution.parameters.pose;
    tracked.medianResidual = quality.medianResidual;
    tracked.numCorrespondences = quality.numMatches;
    const bool wasLost = state_.framesLost > 0;
    tracked.status = !found    ? TrackingStatus::kLost
                     : wasLost ? TrackingStatus::kRecovered
                               : TrackingStatus::kTracked;
    if (state_.framesTracked > 0)
      state_.poseInformation =
          fadedInformation(state_.poseInformation, timestamp - state_.timestamp);
    if (found) {
      state_.poseInformation =
          informationWithDepth(state_.poseInformation, solution.poseInformation);
      tracked.jointConfidence = quality.jointSupport;
      tracked.jointDeviation = deviations(solution.parameters);
      for (std::size_t j = 0; j < tracked.jointLost.size(); ++j)
        tracked.jointLost[j] = quality.jointLost[j] || tracked.jointDeviation[j] > kFarOff;
      if (state_.framesTracked > 0)
        addFrame(quality.jointUnseen, timestamp - state_.timestamp, state_.unseenSeconds);
      learnBetas(solution);
    }
    state_.before = wasLost || state_.framesTracked == 0 ? tracked.pose : state_.pose;
    state_.pose = tracked.pose;
    state_.timestampBefore = state_.framesTracked == 0 ? timestamp - 1.0 : state_.timestamp;
    state_.timestamp = timestamp;
    state_.framesLost = found ? 0 : state_.framesLost + 1;
    ++state_.framesTracked;
    if (options_.armsApart)
      tracked.pose = armsApart(*surface_, {tracked.pose, solution.parameters.betas});
    return tracked;
  }

  const avatar::BodyModel& model_;
  avatar::Camera camera_;
  TrackerOptions options_;
  std::unique_ptr<TrackedSurface> surface_;
  PoseRegularizer regularizer_;
  Eigen::VectorXd usualBareness_;
  TrackerState state_;
};

BodyTracker::BodyTracker(
    const avatar::BodyModel& model, const avatar::Camera& camera, const TrackerOptions& options)
    : implementation_(std::make_unique<Implementation>(model, camera, options)) {}

BodyTracker::~BodyTracker() = default;
BodyTracker::BodyTracker(BodyTracker&&) noexcept = default;
BodyTracker& BodyTracker::operator=(BodyTracker&&) noexcept = default;

TrackedBody BodyTracker::track(const DepthCloud& cloud, double timestamp) {
  return implementation_->track(cloud, timestamp);
}

Eigen::VectorXd BodyTracker::betas() const {
  return implementation_->betas();
}

Eigen::VectorXd BodyTracker::clothWidths() const {
  return implementation_->clothWidths();
}

void BodyTracker::setBetas(const Eigen::VectorXd& betas) {
  implementation_->setBetas(betas);
}

void BodyTracker::holdBetas() {
  implementation_->holdBetas();
}

void BodyTracker::setOuterLayer(const OuterLayer& layer) {
  implementation_->setOuterLayer(layer);
}

const TrackerState& BodyTracker::state() const {
  return implementation_->state();
}

void BodyTracker::restore(const TrackerState& state) {
  implementation_->restore(state);
}

}  // namespace simulcap
