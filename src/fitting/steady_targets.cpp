#include "src/fitting/steady_targets.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace simulcap {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

}  // namespace

void SteadyTargetOptions::validate() const {
  if (!(gain >= 0.01 && gain <= 1.0))
    throw std::invalid_argument("SteadyTargetOptions: gain must be within [0.01, 1]");
  if (!(noise >= 0.0 && noise <= 0.1))
    throw std::invalid_argument("SteadyTargetOptions: noise must be within [0, 0.1] 1/m");
}

SteadyTargets::SteadyTargets(Eigen::Index numVertices, const SteadyTargetOptions& options)
    : options_(options), before_(Eigen::VectorXf::Constant(numVertices, kUnknown)), now_(before_) {
  options.validate();
}

void SteadyTargets::steady(
    GarmentTargets& targets, const Eigen::Matrix3Xd& reference, const avatar::Camera& camera) {
  const Eigen::Isometry3d worldFromCamera = camera.cameraFromWorld.inverse();
  now_.setConstant(kUnknown);
  for (std::size_t i = 0; i < targets.targets.size(); ++i) {
    bullet_ext::DepthTarget& target = targets.targets[i];
    const Eigen::Vector3f mean = target.points * target.weights;
    const Eigen::Vector3d measured = camera.cameraFromWorld * mean.cast<double>();
    const double referenceDepth =
        (camera.cameraFromWorld * reference.col(target.vertex).eval()).z();
    const double offset = measured.z() - referenceDepth;
    const double before = static_cast<double>(before_[target.vertex]);
    double believed = offset;
    if (!std::isnan(before)) {
      const double sigma = options_.noise * measured.z() * measured.z();
      const double change = std::abs(offset - before);
      const double u = std::clamp((change - 2.0 * sigma) / (4.0 * sigma + 1e-12), 0.0, 1.0);
      const double gain = options_.gain + (1.0 - options_.gain) * u * u * (3.0 - 2.0 * u);
      believed = before + gain * (offset - before);
    }
    now_[target.vertex] = static_cast<float>(believed);
    const double shift = believed - offset;
    const Eigen::Vector3d along = worldFromCamera.linear() * (measured / measured.z());
    target.points.leftCols(target.numPoints).colwise() += (shift * along).cast<float>();
    targets.residuals[i] += static_cast<float>(shift);
  }
}

void SteadyTargets::endFrame() {
  before_ = now_;
}

void SteadyTargets::restore(const Eigen::VectorXf& state) {
  if (state.size() != before_.size())
    throw std::invalid_argument("SteadyTargets: the state is of another garment");
  before_ = state;
}

}  // namespace simulcap
