#include "src/tracking/coarse_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace simulcap {
namespace {

/// The person's points in the world, told by robust numbers.
struct Extent {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< medians [m]
  double top = 0.0, bottom = 0.0;                    ///< heights [m]
  bool wholeBody = false;                            ///< neither head nor feet cut off
};

double quantile(std::vector<double> values, double share) {
  const auto nth =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

Extent extentOf(const DepthView& view) {
  const Eigen::Isometry3d worldFromCamera = view.camera().cameraFromWorld.inverse();
  std::array<std::vector<double>, 3> axes;
  for (const DepthView::PixelSample& pixel : view.pixels()) {
    const Eigen::Vector3d point = worldFromCamera * pixel.point;
    for (int axis = 0; axis < 3; ++axis) {
      axes[static_cast<std::size_t>(axis)].push_back(point[axis]);
    }
  }
  Extent extent;
  for (int axis = 0; axis < 3; ++axis) {
    extent.centre[axis] = quantile(axes[static_cast<std::size_t>(axis)], 0.5);
  }
  extent.top = quantile(axes[1], 0.998);
  extent.bottom = quantile(axes[1], 0.002);
  constexpr double kUprightShare = 0.02;  // of the image's height, left free at both ends
  const double margin = kUprightShare * view.cloud().height;
  constexpr double kPersonHeight = 1.2;  // [m]: less is a part of a person
  extent.wholeBody = view.box().min().y() > margin &&
                     view.box().max().y() < view.cloud().height - 1 - margin &&
                     extent.top - extent.bottom > kPersonHeight;
  return extent;
}

/// Change of betas, smallest in norm, that makes the template's stature `height`.
Eigen::VectorXd betasForHeight(
    const TrackedSurface& surface, const Eigen::VectorXd& betas, double height) {
  const auto& model = surface.model();
  const Eigen::Matrix3Xd shaped = avatar::shapedVertices(model, betas);
  Eigen::Index top = 0;
  Eigen::Index bottom = 0;
  const auto heights = shaped.row(1).head(surface.numBodyVertices());
  const double stature = heights.maxCoeff(&top) - heights.minCoeff(&bottom);
  const Eigen::VectorXd slope =
      (model.shapeDirections.row(3 * top + 1) - model.shapeDirections.row(3 * bottom + 1))
          .transpose();
  if (slope.squaredNorm() < 1e-8) {
    return betas;
  }
  constexpr double kMost = 2.5;
  const Eigen::VectorXd change = (height - stature) / slope.squaredNorm() * slope;
  return betas + change * std::min(1.0, kMost / std::max(1e-9, change.norm()));
}

avatar::BodyPose standing(double yaw, double armsDown) {
  avatar::BodyPose pose = avatar::aPose();
  pose.jointRotations[1] = yaw;
  pose.jointRotations[3 * avatar::kLeftShoulder + 2] = -armsDown;
  pose.jointRotations[3 * avatar::kRightShoulder + 2] = armsDown;
  return pose;
}

/// Highest sample of the head [m].
double topOfHead(const TrackedSurface& surface, const PosedSamples& posed) {
  double top = -1e9;
  for (std::size_t s = 0; s < surface.samples().size(); ++s)
    if (surface.samples()[s].joint == avatar::kHead)
      top = std::max(top, posed.positions(1, static_cast<Eigen::Index>(s)));
  return top;
}

}  // namespace

std::vector<BodyParameters> coarseAlignments(
    const TrackedSurface& surface,
    const DepthView& view,
    const Eigen::VectorXd& betas,
    bool fitHeight) {
  const Extent extent = extentOf(view);
  BodyParameters start;
  start.betas = fitHeight && extent.wholeBody
                    ? betasForHeight(surface, betas, extent.top - extent.bottom)
                    : betas;
  const Eigen::Vector3d eye = avatar::centre(view.camera());
  Eigen::Vector3d away = extent.centre - eye;
  away.y() = 0.0;
  away.normalize();
  constexpr double kHalfThickness = 0.10;  // [m] from the seen skin to the body's axis
  constexpr int kNumYaws = 12;
  std::vector<BodyParameters> starts;
  for (const double armsDown : {1.25, 0.8, 0.1}) {
    for (int i = 0; i < kNumYaws; ++i) {
      // 0 faces the camera.
      const double yaw = std::atan2(-away.x(), -away.z()) + 2.0 * std::numbers::pi * i / kNumYaws;
      BodyParameters candidate = start;
      candidate.pose = standing(std::remainder(yaw, 2.0 * std::numbers::pi), armsDown);
      const PosedSamples posed = surface.pose(candidate, false);
      const Eigen::Vector3d axis = posed.worldFromJoint[avatar::kSpine2].translation();
      candidate.pose.translation = extent.centre + kHalfThickness * away - axis;
      candidate.pose.translation.y() = extent.top - topOfHead(surface, posed);
      starts.push_back(candidate);
    }
  }
  return starts;
}

}  // namespace simulcap
