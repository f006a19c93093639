#include "src/tracking/depth_matches.h"

#include "avatar/default_body/embedded_body.h"
#include "src/tracking/surface_visibility.h"
#include "tests/src/tracking/rendered_body.h"

#include <Eigen/LU>
#include <gtest/gtest.h>

namespace simulcap {
namespace {

TEST(DepthMatches, LeaveABodyThatIsRightWhereItIs) {
  const avatar::BodyModel& model = avatar::defaultBody();
  const avatar::Camera camera = test::smallCamera();
  const TrackedSurface surface(model, 300);
  const BodyParameters truth{avatar::aPose(), Eigen::VectorXd::Zero(surface.numBetas())};
  const DepthCloud cloud = test::renderedCloud(model, truth.betas, truth.pose, camera);
  const DepthView view(cloud, camera, 1000);
  const auto constraints = depthMatches(
      surface, surface.pose(truth, false), visibleSamples(surface, truth, camera), view, {});
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (const SurfaceConstraint& constraint : constraints) {
    const Eigen::Vector3d direction = constraint.direction;
    matrix += constraint.weight * direction * direction.transpose();
    gradient += constraint.weight * constraint.residual * direction;
  }
  const Eigen::Vector3d towardsCamera = camera.cameraFromWorld.linear().row(2).transpose() * -1.0;
  const double step = towardsCamera.dot(-matrix.inverse() * gradient);
  // 300 samples are 8 cm apart. Beside a pixel by some 3 cm, they are behind its tangent plane by
  // 3 mm on a trunk and more on limbs; what is left is where curvature changes.
  EXPECT_LT(std::abs(step), 0.001) << step;
}

}  // namespace
}  // namespace simulcap
