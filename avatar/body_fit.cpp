#include "avatar/body_fit.h"

#include "avatar/axis_angle.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"
#include "avatar/skinning_jacobian.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace avatar {
namespace {

/// A third of the area of the faces around each vertex [m²].
Eigen::VectorXd vertexAreas(const MeshView& mesh) {
  const Eigen::VectorXd areas = faceAreas(mesh);
  Eigen::VectorXd result = Eigen::VectorXd::Zero(mesh.numVertices());
  for (Eigen::Index face = 0; face < mesh.numFaces(); ++face) {
    for (int corner = 0; corner < 3; ++corner) {
      result[mesh.faces(corner, face)] += areas[face] / 3.0;
    }
  }
  return result;
}

struct WeightedDistance {
  double distance = 0.0;
  double weight = 0.0;
};

void appendDistances(
    const MeshView& from, const TriangleBvh& to, std::vector<WeightedDistance>& distances) {
  const Eigen::VectorXd areas = vertexAreas(from);
  const double total = areas.sum();
  for (Eigen::Index v = 0; v < from.numVertices(); ++v) {
    if (areas[v] > 0.0) {
      const double squared = to.closestPoint(from.vertices.col(v)).squaredDistance;
      distances.push_back({std::sqrt(squared), areas[v] / total});
    }
  }
}

/// The distance below which a share of the weight lies; `distances` sorted.
double quantile(const std::vector<WeightedDistance>& distances, double share) {
  double total = 0.0;
  for (const WeightedDistance& entry : distances) {
    total += entry.weight;
  }
  double below = 0.0;
  for (const WeightedDistance& entry : distances) {
    below += entry.weight;
    if (below >= share * total) {
      return entry.distance;
    }
  }
  return distances.back().distance;
}

/// What is matched in one direction: every n-th vertex, so that the choice is the same every time.
std::vector<int> sampledVertices(const MeshView& mesh, int count) {
  const Eigen::VectorXd areas = vertexAreas(mesh);
  const Eigen::Index numSamples = std::min<Eigen::Index>(count, mesh.numVertices());
  std::vector<int> samples;
  for (Eigen::Index i = 0; i < numSamples; ++i) {
    const Eigen::Index vertex = i * mesh.numVertices() / numSamples;
    if (areas[vertex] > 0.0) {
      samples.push_back(static_cast<int>(vertex));
    }
  }
  return samples;
}

/// What one stage of the fit may change, and how.
struct Stage {
  int iterations = 0;
  double robustScale = 0.0;    ///< [m]
  double priorScale = 1.0;     ///< of both priors
  bool posesAllJoints = true;  ///< otherwise the root alone
};

/// Hands, feet and head of a foreign body differ in make; their joints would follow noise.
bool isStiff(int joint) {
  return joint == kLeftHand || joint == kRightHand || joint == kLeftFoot || joint == kRightFoot;
}

class BodyFitter {
 public:
  BodyFitter(const BodyModel& model, const MeshView& target, const BodyFitOptions& options)
      : options_(options),
        model_(model),
        target_(target),
        skinning_(model),
        jacobian_(skinning_),
        targetBvh_(target),
        targetNormals_(vertexNormals(target)),
        targetFaceNormals_(faceNormals(target)),
        modelSamples_(
            sampledVertices({model.templateVertices, model.faces}, options.samplesPerDirection)),
        targetSamples_(sampledVertices(target, options.samplesPerDirection)),
        cosMaxAngle_(std::cos(options.maxAngle * kDegree)) {
    const BodyParameterLayout layout = jacobian_.layout();
    x_ = Eigen::VectorXd::Zero(layout.size());
    const Eigen::VectorXd& start = options.startPose.jointRotations;
    const Eigen::Index used = std::min<Eigen::Index>(start.size(), 3 * layout.numJoints);
    x_.head(used) = start.head(used);
    start_ = x_;
    x_.segment<3>(layout.translation()) = startTranslation();
  }

  BodyFitResult run() {
    const double sigma = options_.robustScale;
    // Betas first move as stature and limb lengths: the root and a wide kernel keep them honest.
    runStage(
        {.iterations = 10, .robustScale = 5.0 * sigma, .priorScale = 4.0, .posesAllJoints = false});
    runStage({.iterations = 15, .robustScale = 2.0 * sigma, .priorScale = 2.0});
    runStage({.iterations = options_.iterations, .robustScale = sigma});
    const bool converged =
        runStage({.iterations = options_.iterations, .robustScale = 0.5 * sigma});
    return result(converged);
  }

 private:
  BodyPose poseAt(const Eigen::VectorXd& x) const {
    BodyPose pose;
    pose.jointRotations = x.head(3 * jacobian_.layout().numJoints);
    pose.translation = x.segment<3>(jacobian_.layout().translation());
    return pose;
  }

  ShapedBody shapeAt(const Eigen::VectorXd& x) const {
    return skinning_.shape(x.tail(jacobian_.layout().numBetas));
  }

  Eigen::Matrix3Xd verticesAt(const Eigen::VectorXd& x) const {
    return skinning_.pose(shapeAt(x), poseAt(x)).vertices;
  }

  /// Boxes over each other: feet on the same height, middle on the same spot.
  Eigen::Vector3d startTranslation() const {
    const Eigen::Matrix3Xd vertices = verticesAt(x_);
    const Eigen::AlignedBox3d ours = boundingBox({vertices, model_.faces});
    const Eigen::AlignedBox3d theirs = boundingBox(target_);
    return theirs.center() - ours.center();
  }

  bool matches(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    return a.dot(b) > cosMaxAngle_;
  }

  static double robustWeight(double squaredDistance, double sigma) {
    const double ratio = sigma * sigma / (sigma * sigma + squaredDistance);
    return ratio * ratio;
  }

  /// Model vertices to the target's surface.
  std::vector<PlaneConstraint> matchesToTarget(
      const Eigen::Matrix3Xd& vertices, double sigma) const {
    const Eigen::Matrix3Xd normals = vertexNormals({vertices, model_.faces});
    std::vector<PlaneConstraint> planes;
    for (const int v : modelSamples_) {
      const ClosestPoint closest = targetBvh_.closestPoint(vertices.col(v));
      const Eigen::Vector3d normal = targetFaceNormals_.col(closest.face);
      if (matches(normals.col(v), normal)) {
        planes.push_back(
            {{v, v, v},
             {1.0, 0.0, 0.0},
             normal,
             normal.dot(closest.point),
             robustWeight(closest.squaredDistance, sigma)});
      }
    }
    return planes;
  }

  /// The target's vertices to the model's surface; planes with the target's normals.
  std::vector<PlaneConstraint> matchesFromTarget(
      const Eigen::Matrix3Xd& vertices, double sigma) const {
    const MeshView body(vertices, model_.faces);
    const TriangleBvh bvh(body);
    const Eigen::Matrix3Xd normals = faceNormals(body);
    std::vector<PlaneConstraint> planes;
    for (const int v : targetSamples_) {
      const Eigen::Vector3d point = target_.vertices.col(v);
      const Eigen::Vector3d normal = targetNormals_.col(v);
      const ClosestPoint closest = bvh.closestPoint(point);
      if (matches(normals.col(closest.face), normal)) {
        planes.push_back(
            {model_.faces.col(closest.face),
             closest.weights,
             normal,
             normal.dot(point),
             robustWeight(closest.squaredDistance, sigma)});
      }
    }
    return planes;
  }

  std::vector<PlaneConstraint> matchesAt(const Eigen::VectorXd& x, double sigma) const {
    const Eigen::Matrix3Xd vertices = verticesAt(x);
    std::vector<PlaneConstraint> planes = matchesToTarget(vertices, sigma);
    const std::vector<PlaneConstraint> back = matchesFromTarget(vertices, sigma);
    planes.insert(planes.end(), back.begin(), back.end());
    return planes;
  }

  /// Weights of the quadratic priors per parameter, in units of one match.
  Eigen::VectorXd priorWeights(const Stage& stage) const {
    const BodyParameterLayout layout = jacobian_.layout();
    const auto numMatches = static_cast<double>(modelSamples_.size() + targetSamples_.size());
    const double pose = stage.priorScale * options_.posePrior;
    const double beta = stage.priorScale * options_.betaPrior;
    constexpr double kHeld = 1e6;
    // The priors are compared with the mean squared distance, a few mm, not with the sum's size.
    constexpr double kShare = 1e-3;
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(layout.size());
    for (int joint = 0; joint < layout.numJoints; ++joint) {
      const bool held = joint > 0 && (!stage.posesAllJoints || isStiff(joint));
      weights.segment<3>(3 * joint).setConstant(
          held         ? kHeld
          : joint == 0 ? 0.1 * pose * pose
                       : pose * pose);
    }
    weights.tail(layout.numBetas).setConstant(beta * beta);
    return kShare * numMatches * weights;
  }

  double costOf(
      const Eigen::VectorXd& x,
      const std::vector<PlaneConstraint>& planes,
      const Eigen::VectorXd& prior) const {
    const Eigen::Matrix3Xd vertices = verticesAt(x);
    double cost = (x - start_).cwiseAbs2().dot(prior);
    for (const PlaneConstraint& plane : planes) {
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      for (int i = 0; i < 3; ++i) {
        point += plane.weights[i] * vertices.col(plane.vertices[i]);
      }
      const double residual = plane.normal.dot(point) - plane.offset;
      cost += plane.weight * residual * residual;
    }
    return cost;
  }

  /// One Levenberg–Marquardt step on fixed matches; the new parameters.
  Eigen::VectorXd step(const std::vector<PlaneConstraint>& planes, const Eigen::VectorXd& prior) {
    const BodyLinearization at = jacobian_.linearize(shapeAt(x_), poseAt(x_));
    NormalEquations equations(x_.size());
    for (const PlaneConstraint& plane : planes) {
      addPlaneConstraint(jacobian_, at, plane, equations);
    }
    equations.matrix.diagonal() += prior;
    equations.gradient += prior.cwiseProduct(x_ - start_);
    const double before = costOf(x_, planes, prior);
    constexpr int kMaxTries = 8;
    for (int i = 0; i < kMaxTries; ++i) {
      Eigen::MatrixXd damped = equations.matrix;
      damped.diagonal() *= 1.0 + damping_;
      damped.diagonal().array() += 1e-9;
      Eigen::VectorXd candidate =
          x_ - damped.selfadjointView<Eigen::Lower>().ldlt().solve(equations.gradient);
      if (candidate.allFinite() && costOf(candidate, planes, prior) <= before) {
        damping_ = std::max(1e-7, 0.2 * damping_);
        return candidate;
      }
      damping_ *= 10.0;
    }
    return x_;
  }

  /// True when the surface came to rest.
  bool runStage(const Stage& stage) {
    const Eigen::VectorXd prior = priorWeights(stage);
    Eigen::Matrix3Xd vertices = verticesAt(x_);
    for (int i = 0; i < stage.iterations; ++i) {
      const auto planes = matchesAt(x_, stage.robustScale);
      enoughMatches_ = planes.size() > static_cast<std::size_t>(x_.size());
      if (!enoughMatches_) {
        return false;
      }
      x_ = step(planes, prior);
      ++iterations_;
      const Eigen::Matrix3Xd moved = verticesAt(x_);
      const double meanSquare = (moved - vertices).colwise().squaredNorm().mean();
      vertices = moved;
      if (std::sqrt(meanSquare) < options_.stepTolerance) {
        return true;
      }
    }
    return false;
  }

  BodyFitResult result(bool converged) const {
    const Eigen::Matrix3Xd vertices = verticesAt(x_);
    BodyFitResult fit{
        .betas = x_.tail(jacobian_.layout().numBetas),
        .pose = poseAt(x_),
        .iterations = iterations_,
        .distance = symmetricSurfaceDistance({vertices, model_.faces}, target_)};
    constexpr double kNoFit = 0.1;  // [m] in the mean: not the same body, pose or unit
    fit.status = !enoughMatches_ || !(fit.distance.mean < kNoFit) ? BodyFitStatus::kFailed
                 : converged                                      ? BodyFitStatus::kConverged
                                                                  : BodyFitStatus::kMaxIterations;
    return fit;
  }

  BodyFitOptions options_;
  const BodyModel& model_;
  MeshView target_;
  Skinning skinning_;
  SkinningJacobian jacobian_;
  TriangleBvh targetBvh_;
  Eigen::Matrix3Xd targetNormals_, targetFaceNormals_;
  std::vector<int> modelSamples_, targetSamples_;
  double cosMaxAngle_;
  Eigen::VectorXd x_, start_;  // as BodyParameterLayout
  double damping_ = 1e-3;
  int iterations_ = 0;
  bool enoughMatches_ = true;
};

}  // namespace

void BodyFitOptions::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) {
      throw std::invalid_argument(std::string("BodyFitOptions: ") + what);
    }
  };
  require(iterations >= 1 && iterations <= 1000, "iterations must be 1 to 1000");
  require(
      samplesPerDirection >= 100 && samplesPerDirection <= 100000,
      "samplesPerDirection must be 100 to 100000");
  require(robustScale >= 0.001 && robustScale <= 1.0, "robustScale must be 0.001 to 1 m");
  require(maxAngle >= 1.0 && maxAngle <= 90.0, "maxAngle must be 1 to 90 degrees");
  require(betaPrior >= 0.0 && posePrior >= 0.0, "priors must not be negative");
  require(stepTolerance > 0.0, "stepTolerance must be positive");
}

DistanceStatistics symmetricSurfaceDistance(const MeshView& a, const MeshView& b) {
  std::vector<WeightedDistance> distances;
  appendDistances(a, TriangleBvh(b), distances);
  appendDistances(b, TriangleBvh(a), distances);
  if (distances.empty() || a.numFaces() == 0 || b.numFaces() == 0) {
    throw std::invalid_argument("symmetricSurfaceDistance: a mesh has no surface");
  }
  std::sort(distances.begin(), distances.end(), [](const auto& p, const auto& q) {
    return std::pair(p.distance, p.weight) < std::pair(q.distance, q.weight);
  });
  DistanceStatistics statistics;
  double total = 0.0;
  for (const WeightedDistance& entry : distances) {
    statistics.mean += entry.weight * entry.distance;
    total += entry.weight;
  }
  statistics.mean /= total;
  statistics.median = quantile(distances, 0.5);
  statistics.p95 = quantile(distances, 0.95);
  statistics.max = distances.back().distance;
  return statistics;
}

BodyFitResult fitBody(
    const BodyModel& model, const MeshView& target, const BodyFitOptions& options) {
  options.validate();
  if (target.numFaces() == 0 || model.numFaces() == 0) {
    throw std::invalid_argument("fitBody: a mesh has no faces");
  }
  return BodyFitter(model, target, options).run();
}

}  // namespace avatar
