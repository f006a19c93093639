#include "src/tracking/pose_solver.h"

#include "src/tracking/seen_samples.h"
#include "src/tracking/surface_visibility.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace simulcap {
namespace {

using avatar::NormalEquations;

/// Of the data term against λ_pri and the joints' stiffnesses: a limb's hundred samples 2 cm off
/// weigh as much as its joint half a radian away from where it was expected. Neighbouring pixels
/// err together, so a sample counts far less than the depth's noise alone would allow.
constexpr double kDataUnit = 20.0;

double between(double first, double last, int step, int steps) {
  return steps <= 1 ? last
                    : first * std::pow(last / first, static_cast<double>(step) / (steps - 1));
}

/// Feet don't go through the floor, and the one that stands on it stays there. Held ones don't tell
/// where the body is.
void addFloor(
    const TrackedSurface& surface,
    const PosedSamples& posed,
    const PoseSolverOptions& options,
    std::vector<SurfaceConstraint>& constraints) {
  constexpr double kContact = 0.03;  // [m]
  constexpr double kWeight = 4.0;
  int lowest[2] = {-1, -1};
  for (std::size_t s = 0; s < surface.samples().size(); ++s) {
    const TrackedSurface::Sample& sample = surface.samples()[s];
    const int joint = sample.joint;
    const bool left = joint == avatar::kLeftFoot || joint == avatar::kLeftAnkle;
    if (sample.cloth || options.held[static_cast<std::size_t>(joint)] ||
        (!left && joint != avatar::kRightFoot && joint != avatar::kRightAnkle)) {
      continue;
    }
    const int index = static_cast<int>(s);
    const double height = posed.positions(1, index) - *options.floorHeight;
    if (height < 0.0) {
      constraints.push_back({index, Eigen::Vector3d::UnitY(), height, kWeight});
    }
    int& best = lowest[left ? 0 : 1];
    if (best < 0 || posed.positions(1, index) < posed.positions(1, best)) {
      best = index;
    }
  }
  for (const int index : lowest) {
    const double height = index < 0 ? 1.0 : posed.positions(1, index) - *options.floorHeight;
    if (height >= 0.0 && height < kContact) {
      constraints.push_back({index, Eigen::Vector3d::UnitY(), height, kWeight});
    }
  }
}

/// Skin that can't be seen is as thick as most people's, more or less: B × B, of betas around 0.
/// Without it a trunk half in the picture makes the other half up.
Eigen::MatrixXd unseenShape(
    const TrackedSurface& surface, const SeenSamples& seen, const DepthView& view) {
  constexpr double kShare = 0.25;  // of depth's weight: people differ twice as much as noise does
  const double weight =
      kShare * kDataUnit * kUsualSamples / static_cast<double>(surface.samples().size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(surface.numBetas(), surface.numBetas());
  for (Eigen::Index s = 0; s < surface.normalShapes().rows(); ++s) {
    if (surface.samples()[static_cast<std::size_t>(s)].cloth || !isUnseen(seen, s, view))
      continue;
    const auto shape = surface.normalShapes().row(s);
    information.noalias() += weight * shape.transpose() * shape;
  }
  return information;
}

/// The Schur complement of the pose.
Eigen::MatrixXd marginalBetas(const Eigen::MatrixXd& lower) {
  constexpr int kPose = TrackingLayout::kBetas;
  const Eigen::Index numBetas = lower.rows() - kPose;
  const Eigen::MatrixXd full = lower.selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd cross = full.bottomLeftCorner(numBetas, kPose);
  const Eigen::MatrixXd pose = full.topLeftCorner<kPose, kPose>();
  return full.bottomRightCorner(numBetas, numBetas) - cross * pose.ldlt().solve(cross.transpose());
}

/// −H⁻¹ g, with steps limited to what the linearization can be trusted for.
Eigen::VectorXd limitedStep(const NormalEquations& equations) {
  constexpr double kMaxRotation = 0.35;  // [rad]
  constexpr double kMaxShift = 0.15;     // [m]
  constexpr double kMaxBeta = 0.7;
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(equations.matrix);
  Eigen::VectorXd step = -factor.solve(equations.gradient);
  if (factor.info() != Eigen::Success || !step.allFinite()) {
    return Eigen::VectorXd::Zero(step.size());
  }
  for (Eigen::Index i = 0; i < TrackingLayout::kBetas; i += 3) {
    const double limit = i == TrackingLayout::kTranslation ? kMaxShift : kMaxRotation;
    const double length = step.segment<3>(i).norm();
    if (length > limit) {
      step.segment<3>(i) *= limit / length;
    }
  }
  for (Eigen::Index i = TrackingLayout::kBetas; i < step.size(); ++i) {
    step[i] = std::clamp(step[i], -kMaxBeta, kMaxBeta);
  }
  return step;
}

constexpr double kHold = 1e12;  // on the diagonal of what doesn't move

void hold(const JointSet& joints, Eigen::Index numCertain, NormalEquations& equations) {
  for (std::size_t j = 0; j < joints.size(); ++j)
    if (joints[j])
      equations.matrix.diagonal().segment<3>(3 * static_cast<Eigen::Index>(j)).array() += kHold;
  equations.matrix.diagonal().segment(TrackingLayout::kBetas, numCertain).array() += kHold;
}

void apply(const Eigen::VectorXd& step, BodyParameters& parameters) {
  for (int i = 0; i < TrackingLayout::kTranslation; ++i) {
    parameters.pose.jointRotations[i] += step[i];
  }
  for (int axis = 0; axis < 3; ++axis) {
    parameters.pose.translation[axis] += step[TrackingLayout::kTranslation + axis];
  }
  const Eigen::Index numBetas = step.size() - TrackingLayout::kBetas;
  if (numBetas > 0) {
    constexpr double kMost = 5.0;  // standard deviations: nobody is further from the mean
    for (Eigen::Index b = 0; b < numBetas; ++b) {
      parameters.betas[b] =
          std::clamp(parameters.betas[b] + step[TrackingLayout::kBetas + b], -kMost, kMost);
    }
  }
}

}  // namespace

PoseSolution solvePose(
    const TrackedSurface& surface,
    const PoseRegularizer& regularizer,
    const DepthView& view,
    const BodyParameters& start,
    const PoseSolverOptions& options) {
  const std::optional<BetaKnowledge>& betas = options.betas;
  const Eigen::Index numCertain = betas ? betas->numCertain : 0;
  PoseSolution solution{.parameters = start};
  Eigen::MatrixXd unseen;
  for (int i = 0; i < options.iterations; ++i) {
    constexpr int kVisibilityPeriod = 6;  // what turns away in fewer steps hardly matters
    if (i % kVisibilityPeriod == 0) {
      solution.visible = visibleSamples(surface, solution.parameters, view.camera());
    }
    const PosedSamples posed = surface.pose(solution.parameters, betas.has_value());
    const MatchOptions match{
        .gate = between(options.firstGate, options.lastGate, i, options.iterations),
        .robustScale =
            between(options.firstRobustScale, options.lastRobustScale, i, options.iterations),
        .dataWeight = options.dataWeight,
        .interWeight =
            i < options.firstInterIterations ? options.firstInterWeight : options.laterInterWeight,
        .clothOffset = options.clothOffset};
    std::vector<SurfaceConstraint> constraints =
        depthMatches(surface, posed, solution.visible, view, match);
    if (options.floorHeight) {
      addFloor(surface, posed, options, constraints);
    }
    for (SurfaceConstraint& constraint : constraints) {
      constraint.weight *= kDataUnit;
    }
    NormalEquations equations = treeEquations(surface, posed, constraints, numCertain);
    if (i + 1 == options.iterations)
      solution.poseInformation =
          equations.matrix.topLeftCorner<TrackingLayout::kBetas, TrackingLayout::kBetas>()
              .selfadjointView<Eigen::Lower>();
    regularizer.add(solution.parameters, start.pose, options.regularization, equations);
    if (betas) {
      const Eigen::Index numBetas = surface.numBetas();
      if (i == 0)
        unseen = unseenShape(surface, seenBy(view.camera(), posed, solution.visible), view);
      equations.matrix.bottomRightCorner(numBetas, numBetas) += unseen;
      equations.gradient.tail(numBetas) += unseen * solution.parameters.betas;
      if (i + 1 == options.iterations)
        solution.betaInformation = marginalBetas(equations.matrix);
      equations.matrix.bottomRightCorner(numBetas, numBetas) += betas->information;
      equations.gradient.tail(numBetas) +=
          betas->information * (solution.parameters.betas - betas->mean);
    }
    hold(options.held, numCertain, equations);
    equations.matrix.diagonal().array() += 1e-6;
    apply(limitedStep(equations), solution.parameters);
  }
  return solution;
}

}  // namespace simulcap
