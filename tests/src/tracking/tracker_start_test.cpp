#include "avatar/axis_angle.h"
#include "avatar/default_body/embedded_body.h"
#include "avatar/skinning.h"
#include "src/tracking/body_tracker.h"
#include "tests/src/tracking/rendered_body.h"

#include <gtest/gtest.h>

#include <numbers>

namespace simulcap {
namespace {

/// How much a body in A-pose, turned by `yaw`, faces the camera as it is found in one frame: 1
/// towards it, −1 away from it.
double foundFacing(double yaw, const avatar::Camera& camera) {
  const avatar::BodyModel& model = avatar::defaultBody();
  const Eigen::VectorXd betas = Eigen::VectorXd::Zero(model.numBetas());
  avatar::BodyPose pose = avatar::aPose();
  pose.jointRotations[1] = yaw;
  BodyTracker tracker(model, camera, {.numSamples = 800, .numDepthSamples = 600});
  tracker.setBetas(betas);
  const TrackedBody found = tracker.track(test::renderedCloud(model, betas, pose, camera), 0.0);
  EXPECT_EQ(found.status, TrackingStatus::kTracked);
  return avatar::quaternionFromAxisAngle(found.pose.jointRotations.head<3>())
      .toRotationMatrix()(2, 2);
}

/// From the chest to the knees.
avatar::Camera closeCamera() {
  avatar::Camera camera = test::smallCamera();
  camera.fx *= 2.2;
  camera.fy *= 2.2;
  return camera;
}

TEST(TrackerStart, SomebodyWithoutHeadAndFeetFacesTheCamera) {
  EXPECT_GT(foundFacing(0.0, closeCamera()), 0.8);
}

TEST(TrackerStart, SomebodySeenWholeIsFoundFromBehind) {
  EXPECT_LT(foundFacing(std::numbers::pi, test::smallCamera()), -0.8);
  EXPECT_LT(foundFacing(0.8 * std::numbers::pi, test::smallCamera()), -0.6);
  EXPECT_GT(foundFacing(0.0, test::smallCamera()), 0.8);
}

}  // namespace
}  // namespace simulcap
