#include "src/input/scene_planes.h"

#include "src/input/depth_noise.h"

#include <Eigen/Eigenvalues>
#include <pcl/console/print.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_parallel_plane.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

#include <algorithm>
#include <cmath>

namespace simulcap {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Model = pcl::SampleConsensusModelPlane<pcl::PointXYZ>;

constexpr double kRansacDistance = 0.03;  // [m]
constexpr int kRansacIterations = 300;

Plane towardsCamera(const Eigen::Vector3f& normal, float offset) {
  return offset < 0.0F ? Plane{-normal, -offset} : Plane{normal, offset};
}

/// Least squares through the points near the plane, repeated until they settle.
Plane refined(Plane plane, const Eigen::Matrix3Xf& points) {
  for (int round = 0; round < 4; ++round) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    double weights = 0.0;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Eigen::Vector3f point = points.col(i);
      const float tolerance = planeTolerance(plane, point);
      if (std::abs(plane.distance(point)) > tolerance)
        continue;
      const double weight = 1e-4 / static_cast<double>(tolerance * tolerance);
      const Eigen::Vector3d p = point.cast<double>();
      sum += weight * p;
      moments += weight * p * p.transpose();
      weights += weight;
    }
    if (weights == 0.0)
      return plane;
    const Eigen::Vector3d mean = sum / weights;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
        moments / weights - mean * mean.transpose());
    const Eigen::Vector3d normal = solver.eigenvectors().col(0);
    plane = towardsCamera(normal.cast<float>(), static_cast<float>(-normal.dot(mean)));
  }
  return plane;
}

/// RANSAC; PCL's random numbers start from a fixed seed.
std::optional<Plane> ransac(const Model::Ptr& model) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // no plane is an answer, not an error
  pcl::RandomSampleConsensus<pcl::PointXYZ> consensus(model, kRansacDistance);
  consensus.setMaxIterations(kRansacIterations);
  Eigen::VectorXf coefficients;
  if (!consensus.computeModel())
    return std::nullopt;
  consensus.getModelCoefficients(coefficients);
  return towardsCamera(coefficients.head<3>(), coefficients[3]);
}

/// A PCL cloud of at most `kMaxPoints` of the points that are wanted, evenly chosen.
Cloud::Ptr cloudOf(const Eigen::Matrix3Xf& points, const std::vector<bool>& wanted) {
  constexpr long kMaxPoints = 3000;
  const long total = std::count(wanted.begin(), wanted.end(), true);
  const long stride = std::max(1L, total / kMaxPoints);
  auto cloud = std::make_shared<Cloud>();
  long seen = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (wanted[i] && seen++ % stride == 0)
      cloud->push_back({points(0, i), points(1, i), points(2, i)});
  }
  return cloud;
}

/// What lies on a plane and beneath it.
struct PlaneSupport {
  float area = 0.0F;                                 ///< [m²]
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();  ///< of what lies on it [m]
  float below = 0.0F;                                ///< [m²]
};

PlaneSupport supportOf(const Plane& plane, const ScenePoints& scene) {
  PlaneSupport support;
  for (Eigen::Index i = 0; i < scene.points.cols(); ++i) {
    const Eigen::Vector3f point = scene.points.col(i);
    const float distance = plane.distance(point);
    const float tolerance = planeTolerance(plane, point);
    if (std::abs(distance) <= tolerance) {
      support.area += scene.areas[i];
      support.centre += scene.areas[i] * point;
    } else if (distance < -(tolerance + 0.05F)) {
      support.below += scene.areas[i];
    }
  }
  if (support.area > 0.0F)
    support.centre /= support.area;
  return support;
}

void leaveOut(const Plane& plane, const Eigen::Matrix3Xf& points, std::vector<bool>& wanted) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3f point = points.col(i);
    if (std::abs(plane.distance(point)) <= planeTolerance(plane, point) + 0.02F)
      wanted[i] = false;
  }
}

}  // namespace

float planeTolerance(const Plane& plane, const Eigen::Vector3f& point) {
  const float alongRay = std::abs(plane.normal.dot(point)) / std::max(point.z(), 0.1F);
  return 0.012F + 3.0F * depthNoise(point.z()) * alongRay;
}

std::optional<Plane> findFloor(const ScenePoints& scene, const FloorOptions& options) {
  constexpr int kMaxPlanes = 4;
  constexpr float kMaxBelow = 0.1F;      // share of the plane's own area
  constexpr float kNormalError = 0.35F;  // of a normal from a few noisy depths [rad]
  // A time-of-flight camera sees a floor bent, lower by centimetres where it looks along it: what
  // lies a little beneath is the same floor, of which the larger part tells where it is [m].
  constexpr float kStep = 0.2F;
  std::vector<bool> wanted(static_cast<std::size_t>(scene.points.cols()));
  for (std::size_t i = 0; i < wanted.size(); ++i)
    wanted[i] = scene.normals.col(i).dot(options.up) > std::cos(options.maxTilt + kNormalError);
  std::optional<Plane> floor;
  for (int attempt = 0; attempt < kMaxPlanes; ++attempt) {
    const Cloud::Ptr cloud = cloudOf(scene.points, wanted);
    if (cloud->size() < 30)
      break;
    auto model =
        std::make_shared<pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>>(cloud);
    model->setAxis(options.up);
    model->setEpsAngle(static_cast<double>(options.maxTilt));
    const auto found = ransac(model);
    if (!found)
      break;
    const Plane plane = refined(*found, scene.points);
    leaveOut(plane, scene.points, wanted);
    const PlaneSupport support = supportOf(plane, scene);
    const bool level = plane.normal.dot(options.up) >= std::cos(options.maxTilt);
    const bool beneath = plane.offset >= options.minHeight && plane.offset <= options.maxHeight;
    const bool lowest = support.below <= kMaxBelow * support.area;
    if (level && beneath && lowest && support.area >= options.minArea &&
        (!floor || floor->distance(support.centre) < -kStep))
      floor = plane;
  }
  return floor;
}

std::vector<Plane> findUprightPlanes(
    const ScenePoints& scene, const Eigen::Vector3f& up, const std::optional<Plane>& floor) {
  constexpr int kMaxPlanes = 5;
  constexpr double kMaxTilt = 0.15;        // [rad]
  constexpr float kMaxNormalSlope = 0.5F;  // of the normals, with their errors
  constexpr float kMinArea = 1.0F;         // more than a person's front [m²]
  std::vector<bool> wanted(static_cast<std::size_t>(scene.points.cols()));
  for (std::size_t i = 0; i < wanted.size(); ++i)
    wanted[i] = scene.normals.col(i).squaredNorm() > 0.0F &&
                std::abs(scene.normals.col(i).dot(up)) < kMaxNormalSlope;
  if (floor)
    leaveOut(*floor, scene.points, wanted);
  std::vector<Plane> planes;
  for (int attempt = 0; attempt < kMaxPlanes; ++attempt) {
    const Cloud::Ptr cloud = cloudOf(scene.points, wanted);
    if (cloud->size() < 100)
      break;
    auto model = std::make_shared<pcl::SampleConsensusModelParallelPlane<pcl::PointXYZ>>(cloud);
    model->setAxis(up);
    model->setEpsAngle(kMaxTilt);
    const auto found = ransac(model);
    if (!found)
      break;
    const Plane plane = refined(*found, scene.points);
    leaveOut(*found, scene.points, wanted);
    leaveOut(plane, scene.points, wanted);
    const bool upright = std::abs(plane.normal.dot(up)) < 2.0F * static_cast<float>(kMaxTilt);
    if (upright && supportOf(plane, scene).area >= kMinArea)
      planes.push_back(plane);
  }
  return planes;
}

}  // namespace simulcap
