#include "avatar/garment_pose_fit.h"

#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"
#include "avatar/skinning.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace avatar {
namespace {

/// Arms down, legs apart [rad], translation [m].
using Parameters = Eigen::Matrix<double, 5, 1>;
constexpr int kNumAngles = 2;

// A radian off the usual angle counts like this residual of every sample. A sleeve that is a tenth
// of a radian off is a centimetre or two nearer to the arm on one side, which costs far more.
constexpr double kPrior = 0.25;

/// Vertices that are looked at, and the planes that the cloth has there.
struct Samples {
  Eigen::Matrix3Xd points;               // [m]
  Eigen::Matrix3Xd tangents, binormals;  // unit; zero where the mesh has no normal
};

/// Every n-th vertex, so that the choice is the same every time.
Samples sampled(const MeshView& mesh, int count) {
  const Eigen::Matrix3Xd normals = vertexNormals(mesh);
  const Eigen::Index numSamples = std::min<Eigen::Index>(count, mesh.numVertices());
  Samples samples;
  samples.points.resize(3, numSamples);
  samples.tangents.setZero(3, numSamples);
  samples.binormals.setZero(3, numSamples);
  for (Eigen::Index i = 0; i < numSamples; ++i) {
    const Eigen::Index vertex = i * mesh.numVertices() / numSamples;
    const Eigen::Vector3d normal = normals.col(vertex);
    samples.points.col(i) = mesh.vertices.col(vertex);
    if (normal.squaredNorm() > 0.0) {
      samples.tangents.col(i) = normal.unitOrthogonal();
      samples.binormals.col(i) = normal.cross(samples.tangents.col(i));
    }
  }
  return samples;
}

/// Distances of points to the body, and the directions in which they grow.
struct Distances {
  Eigen::VectorXd values;      // [m]
  Eigen::Matrix3Xd gradients;  // unit
};

/// The body in one of the poses, at the origin.
class PosedSurface {
 public:
  PosedSurface(const BodyModel& model, const Eigen::VectorXd& betas)
      : skinning_(model),
        shaped_(skinning_.shape(betas)),
        vertices_(shaped_.vertices),
        surface_(MeshView(vertices_, model.faces)) {}

  void pose(double armsDown, double legsApart) {
    vertices_ = skinning_.pose(shaped_, constructionPose(armsDown, legsApart)).vertices;
    surface_.refit(vertices_);
  }

  const Eigen::Matrix3Xd& vertices() const { return vertices_; }

  Distances distances(const Eigen::Matrix3Xd& points, const Eigen::Vector3d& translation) const {
    Distances result{Eigen::VectorXd(points.cols()), Eigen::Matrix3Xd(3, points.cols())};
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Eigen::Vector3d point = points.col(i) - translation;
      const SignedDistanceResult found = surface_(point);
      result.values[i] = found.distance;
      result.gradients.col(i) = (point - found.closest.point).stableNormalized();
      result.gradients.col(i) *= found.distance < 0.0 ? -1.0 : 1.0;
    }
    return result;
  }

 private:
  Skinning skinning_;
  ShapedBody shaped_;
  Eigen::Matrix3Xd vertices_;
  SignedDistance surface_;
};

/// r(d) of the header and its derivative, d the distance less the clearance.
struct Residual {
  double value = 0.0;
  double slope = 0.0;
};

Residual residualOf(double distance, double scale) {
  constexpr double kPenetrationWeight = 4.0;
  if (distance < 0.0) {
    return {kPenetrationWeight * distance / scale, kPenetrationWeight / scale};
  }
  const double length = std::hypot(distance, scale);
  return {distance / length, scale * scale / (length * length * length)};
}

struct Candidate {
  Parameters parameters = Parameters::Zero();
  double cost = 0.0;
};

class ConstructionPoseFitter {
 public:
  ConstructionPoseFitter(
      const BodyModel& model,
      const Eigen::VectorXd& betas,
      const MeshView& garment,
      const ConstructionPoseOptions& options)
      : options_(options),
        garment_(garment),
        body_(model, betas),
        samples_(sampled(garment, options.samples)),
        coarseSamples_(sampled(garment, options.samples / 4).points) {}

  ConstructionPose run() {
    std::vector<Candidate> candidates = gridCandidates();
    Candidate best = refined(candidates.front());
    for (std::size_t i = 1; i < candidates.size(); ++i) {
      const Candidate other = refined(candidates[i]);
      best = other.cost < best.cost ? other : best;
    }
    return result(best.parameters);
  }

 private:
  /// The best heights of the best poses, best first.
  std::vector<Candidate> gridCandidates() {
    constexpr int kArmSteps = 5;
    constexpr std::size_t kKept = 3;
    std::vector<Candidate> candidates;
    for (int i = 0; i < kArmSteps; ++i) {
      const double arms = options_.maxArmsDown * i / (kArmSteps - 1);
      candidates.push_back(bestHeight(arms, options_.usualLegsApart));
      candidates.push_back(bestHeight(arms, 0.5 * options_.maxLegsApart));
    }
    std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
      return a.cost < b.cost;
    });
    candidates.resize(kKept);
    return candidates;
  }

  /// Slides the body through the garment from below to above.
  Candidate bestHeight(double arms, double legs) {
    constexpr double kStep = 0.06;  // [m] a waist, a neck or a knee is longer
    body_.pose(arms, legs);
    const Eigen::AlignedBox3d box = boundingBox(garment_);
    // The garment's middle is level with some part of the body.
    const double lowest = box.center().y() - body_.vertices().row(1).maxCoeff();
    const double highest = box.center().y() - body_.vertices().row(1).minCoeff();
    const auto steps = static_cast<int>((highest - lowest) / kStep) + 1;
    Candidate best;
    best.cost = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= steps; ++i) {
      Parameters start;
      start << arms, legs, box.center().x(), lowest + i * kStep, box.center().z();
      const Candidate candidate = slid(start);
      best = candidate.cost < best.cost ? candidate : best;
    }
    return best;
  }

  /// A few steps of the translation alone with a wide kernel; the pose is set already.
  Candidate slid(const Parameters& start) const {
    constexpr int kSteps = 3;
    const double scale = options_.robustScale;
    Candidate candidate{start, 0.0};
    for (int step = 0;; ++step) {
      const Eigen::Vector3d translation = candidate.parameters.tail<3>();
      const Distances distances = body_.distances(coarseSamples_, translation);
      Eigen::Matrix3d matrix = 1e-6 * Eigen::Matrix3d::Identity();
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
      candidate.cost = 0.0;
      for (Eigen::Index i = 0; i < distances.values.size(); ++i) {
        const Residual r = residualOf(distances.values[i] - options_.clearance, scale);
        const Eigen::Vector3d row = -r.slope * distances.gradients.col(i);
        matrix += row * row.transpose();
        gradient += r.value * row;
        candidate.cost += r.value * r.value;
      }
      if (step == kSteps) {
        return candidate;
      }
      constexpr double kMaxMove = 0.05;  // [m]
      Eigen::Vector3d move = -matrix.ldlt().solve(gradient);
      move *= std::min(1.0, kMaxMove / std::max(kMaxMove, move.norm()));
      candidate.parameters.tail<3>() += move;
    }
  }

  struct Linearization {
    Eigen::VectorXd residuals;
    Eigen::Matrix<double, Eigen::Dynamic, 5> jacobian;

    double cost() const { return residuals.squaredNorm(); }
  };

  /// Three per sample, scaled to a mean: the clearance and the two components of the distance's
  /// gradient in the cloth; then the priors of the angles.
  Eigen::VectorXd residualsAt(const Parameters& p) {
    body_.pose(p[0], p[1]);
    const Distances distances = body_.distances(samples_.points, p.tail<3>());
    const Eigen::Index count = samples_.points.cols();
    const double weight = 1.0 / std::sqrt(static_cast<double>(count));
    Eigen::VectorXd residuals(3 * count + kNumAngles);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Vector3d gradient = distances.gradients.col(i);
      residuals.segment<3>(3 * i)
          << residualOf(distances.values[i] - options_.clearance, options_.robustScale).value,
          options_.parallelWeight * samples_.tangents.col(i).dot(gradient),
          options_.parallelWeight * samples_.binormals.col(i).dot(gradient);
      residuals.segment<3>(3 * i) *= weight;
    }
    const Eigen::Vector2d usual(options_.usualArmsDown, options_.usualLegsApart);
    residuals.tail<kNumAngles>() = kPrior * (p.head<kNumAngles>() - usual);
    return residuals;
  }

  /// Central differences over about a face of the body: within one the gradient is constant.
  Linearization linearize(const Parameters& p) {
    const Parameters steps(0.02, 0.02, 0.005, 0.005, 0.005);  // [rad, m]
    Linearization at{residualsAt(p), {}};
    at.jacobian.resize(at.residuals.size(), 5);
    for (int k = 0; k < 5; ++k) {
      const Parameters step = steps[k] * Parameters::Unit(k);
      at.jacobian.col(k) = (residualsAt(p + step) - residualsAt(p - step)) / (2.0 * steps[k]);
    }
    return at;
  }

  Parameters limited(Parameters p) const {
    p[0] = std::clamp(p[0], 0.0, options_.maxArmsDown);
    p[1] = std::clamp(p[1], 0.0, options_.maxLegsApart);
    return p;
  }

  /// Levenberg–Marquardt over all parameters.
  Candidate refined(const Candidate& start) {
    constexpr int kIterations = 30;
    constexpr double kSmallest = 1e-4;  // [rad, m]
    Parameters p = limited(start.parameters);
    Linearization at = linearize(p);
    double damping = 1e-3;
    for (int i = 0; i < kIterations && damping < 1e6; ++i) {
      Eigen::Matrix<double, 5, 5> matrix = at.jacobian.transpose() * at.jacobian;
      matrix.diagonal() *= 1.0 + damping;
      matrix.diagonal().array() += 1e-9;
      const Parameters gradient = at.jacobian.transpose() * at.residuals;
      const Parameters candidate = limited(p - matrix.ldlt().solve(gradient));
      if (!(residualsAt(candidate).squaredNorm() < at.cost())) {
        damping *= 10.0;
        continue;
      }
      const double step = (candidate - p).norm();
      p = candidate;
      at = linearize(p);
      damping = std::max(1e-7, 0.2 * damping);
      if (step < kSmallest) {
        break;
      }
    }
    return {p, at.cost()};
  }

  ConstructionPose result(const Parameters& p) {
    ConstructionPose fit;
    fit.armsDown = p[0];
    fit.legsApart = p[1];
    fit.pose = constructionPose(p[0], p[1]);
    fit.pose.translation = p.tail<3>();
    body_.pose(p[0], p[1]);
    Distances distances = body_.distances(garment_.vertices, p.tail<3>());
    const Eigen::Matrix3Xd normals = vertexNormals(garment_);
    const double agreement = normals.cwiseProduct(distances.gradients).colwise().sum().mean();
    fit.insideOut = agreement < 0.0;
    Eigen::VectorXd& sorted = distances.values;
    std::sort(sorted.begin(), sorted.end());
    const auto inside = std::lower_bound(sorted.begin(), sorted.end(), 0.0);
    fit.fractionInside =
        static_cast<double>(inside - sorted.begin()) / static_cast<double>(sorted.size());
    fit.maxDepth = std::max(0.0, -sorted[0]);
    fit.medianClearance = sorted[sorted.size() / 2];
    constexpr double kFar = 0.25;  // [m] half of a wide skirt's radius at the hem
    // Cloth around a body faces away from it everywhere, cloth beside it on one half only.
    constexpr double kAround = 0.5;
    const bool worn = fit.fractionInside <= options_.maxInside && fit.medianClearance < kFar &&
                      std::abs(agreement) > kAround;
    fit.status = worn ? ConstructionPoseStatus::kFitted : ConstructionPoseStatus::kNotFound;
    return fit;
  }

  ConstructionPoseOptions options_;
  MeshView garment_;
  PosedSurface body_;
  Samples samples_;
  Eigen::Matrix3Xd coarseSamples_;
};

}  // namespace

void ConstructionPoseOptions::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) {
      throw std::invalid_argument(std::string("ConstructionPoseOptions: ") + what);
    }
  };
  constexpr double kPi = 3.14159265358979323846;
  require(maxArmsDown >= 0.0 && maxArmsDown <= kPi / 2.0, "maxArmsDown must be 0 to pi/2");
  require(maxLegsApart >= 0.0 && maxLegsApart <= kPi / 4.0, "maxLegsApart must be 0 to pi/4");
  require(
      usualArmsDown >= 0.0 && usualArmsDown <= maxArmsDown, "usualArmsDown must be 0 to maximal");
  require(
      usualLegsApart >= 0.0 && usualLegsApart <= maxLegsApart,
      "usualLegsApart must be 0 to maximal");
  require(clearance >= 0.0 && clearance <= 0.05, "clearance must be 0 to 0.05 m");
  require(robustScale >= 0.001 && robustScale <= 0.2, "robustScale must be 0.001 to 0.2 m");
  require(maxInside >= 0.0 && maxInside <= 1.0, "maxInside must be 0 to 1");
  require(samples >= 50 && samples <= 100000, "samples must be 50 to 100000");
}

BodyPose constructionPose(double armsDown, double legsApart) {
  BodyPose pose;
  pose.jointRotations[3 * kLeftShoulder + 2] = -armsDown;
  pose.jointRotations[3 * kRightShoulder + 2] = armsDown;
  pose.jointRotations[3 * kLeftHip + 2] = legsApart;
  pose.jointRotations[3 * kRightHip + 2] = -legsApart;
  return pose;
}

ConstructionPose fitConstructionPose(
    const BodyModel& model,
    const Eigen::VectorXd& betas,
    const MeshView& garment,
    const ConstructionPoseOptions& options) {
  options.validate();
  requireValid(garment, "fitConstructionPose");
  if (garment.numVertices() == 0 || model.numJoints() <= kRightShoulder) {
    throw std::invalid_argument(
        "fitConstructionPose: needs a garment with vertices and a body with SMPL's joints");
  }
  return ConstructionPoseFitter(model, betas, garment, options).run();
}

}  // namespace avatar
