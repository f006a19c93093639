#include "avatar/skinning_jacobian.h"
#include "tests/benchmarks/benchmark.h"
#include "tests/support/synthetic_body.h"

namespace {

using namespace avatar;  // NOLINT(google-build-using-namespace)

/// SMPL's size; every pose blend shape reaches `reach` of the vertices.
BodyModel smplSizedBody(double reach) {
  BodyModel model =
      test::randomBody(1, {.vertices = 6890, .joints = 24, .betas = 10, .weightsPerVertex = 4});
  for (Eigen::MatrixXf& block : model.poseDirections) {
    if (block.size() > 0) {
      block.bottomRows(3 * static_cast<int>((1.0 - reach) * 6890)).setZero();
    }
  }
  return model;
}

void posing(double reach) {
  const BodyModel model = smplSizedBody(reach);
  const Skinning skinning(model);
  const SkinningJacobian jacobian(skinning);
  const Eigen::VectorXd betas = Eigen::VectorXd::Ones(10);
  const ShapedBody shaped = skinning.shape(betas);
  BodyPose pose;
  pose.jointRotations.setLinSpaced(-0.5, 0.7);
  const std::string suffix = reach < 0.2 ? ", local pose shapes" : ", wide pose shapes";
  benchmark::report(
      "shape 6890 vertices",
      benchmark::measure(50, [&] { benchmark::keep(skinning.shape(betas)); }),
      6890.0);
  benchmark::report(
      "pose 6890 vertices" + suffix,
      benchmark::measure(100, [&] { benchmark::keep(skinning.pose(shaped, pose)); }),
      6890.0);
  const BodyLinearization at = jacobian.linearize(shaped, pose);
  NormalEquations equations(jacobian.layout().size());
  benchmark::report(
      "1000 plane rows" + suffix,
      benchmark::measure(
          20,
          [&] {
            for (int v = 0; v < 1000; ++v) {
              const PlaneConstraint plane{{v, v, v}, {1.0, 0.0, 0.0}, Eigen::Vector3d::UnitZ()};
              benchmark::keep(addPlaneConstraint(jacobian, at, plane, equations));
            }
          }),
      1000.0);
}

}  // namespace

int main() {
  benchmark::reportCalibration();
  posing(0.1);
  posing(0.5);
  benchmark::reportCalibration();
  return 0;
}
