#include "avatar/digitization/inner_body.h"

#include "avatar/axis_angle.h"
#include "avatar/digitization/point_grid.h"
#include "avatar/geometry/measures.h"
#include "avatar/skinning_jacobian.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace avatar {
namespace {

double medianOf(std::vector<double> values) {
  if (values.empty())
    return 0.0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// What is on the outside here, if anybody saw it.
SurfaceLabel labelOf(const LabelCounts& counts) {
  const auto most = std::max_element(counts.begin(), counts.end());
  return *most == 0 ? kNoLabel : static_cast<SurfaceLabel>(1 + (most - counts.begin()));
}

/// A vertex of the body and the fused surface outside of it.
struct SurfaceMatch {
  int vertex = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0.0;    // the surface is normal · x = offset [m]
  double distance = 0.0;  // of the vertex to the surface, positive outside [m]
  bool bare = false;
};

class InnerBodyFitter {
 public:
  InnerBodyFitter(
      const Skinning& skinning, const FusedPoints& surface, const InnerBodyOptions& options)
      : skinning_(skinning),
        jacobian_(skinning),
        surface_(surface),
        grid_(surface.points, options.gate),
        options_(options),
        layout_(jacobian_.layout()) {}

  InnerBody run(const Eigen::VectorXd& betas, const BodyPose& pose) {
    start_ = Eigen::VectorXd::Zero(layout_.size());
    start_.head(pose.jointRotations.size()) = pose.jointRotations;
    start_.segment<3>(layout_.translation()) = pose.translation;
    start_.segment(layout_.betas(), betas.size()) = betas;
    x_ = start_;
    for (int i = 0; i < options_.iterations; ++i)
      step();
    return result();
  }

 private:
  BodyPose pose() const {
    return {x_.head(3 * layout_.numJoints), x_.segment<3>(layout_.translation())};
  }

  Eigen::VectorXd betas() const { return x_.tail(layout_.numBetas); }

  std::vector<SurfaceMatch> matches(const Eigen::Matrix3Xd& vertices) const {
    constexpr double kMinCosine = 0.5;
    const Eigen::Matrix3Xd normals = vertexNormals({vertices, skinning_.model().faces});
    const Eigen::Index count = std::min<Eigen::Index>(options_.samples, vertices.cols());
    std::vector<SurfaceMatch> result;
    result.reserve(static_cast<std::size_t>(count));
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto vertex = static_cast<int>(i * vertices.cols() / count);
      const int point = grid_.nearest(vertices.col(vertex));
      if (point < 0 || surface_.normals.col(point).dot(normals.col(vertex)) < kMinCosine)
        continue;
      const Eigen::Vector3d normal = surface_.normals.col(point);
      const double offset = normal.dot(surface_.points.col(point));
      result.push_back(
          {vertex,
           normal,
           offset,
           normal.dot(vertices.col(vertex)) - offset,
           labelOf(surface_.labels[static_cast<std::size_t>(point)]) == kSkinLabel});
    }
    return result;
  }

  double weightOf(const SurfaceMatch& match) const {
    const double off = match.distance + (match.bare ? 0.0 : options_.clothOffset);
    const double s2 = options_.robustScale * options_.robustScale;
    const double robust = s2 / (s2 + off * off);
    const bool slack = !match.bare && off < 0.0;
    // Skin that stands out of cloth is wrong for certain, however far.
    if (!match.bare && off > 0.0)
      return 1.0;
    return (slack ? options_.slackWeight : 1.0) * robust * robust;
  }

  void step() {
    const BodyLinearization at = jacobian_.linearize(skinning_.shape(betas()), pose());
    const std::vector<SurfaceMatch> found = matches(at.body.vertices);
    if (found.empty())
      return;
    NormalEquations equations(layout_.size());
    const double share = 1.0 / static_cast<double>(found.size());
    for (const SurfaceMatch& match : found) {
      const double offset = match.offset - (match.bare ? 0.0 : options_.clothOffset);
      addPlaneConstraint(
          jacobian_,
          at,
          {{match.vertex, match.vertex, match.vertex},
           Eigen::Vector3d::UnitX(),
           match.normal,
           offset,
           share * weightOf(match)},
          equations);
    }
    Eigen::VectorXd prior = Eigen::VectorXd::Zero(layout_.size());
    prior.head(layout_.translation()).setConstant(std::pow(options_.posePrior, 2));
    prior.tail(layout_.numBetas).setConstant(std::pow(options_.betaPrior, 2));
    Eigen::MatrixXd matrix = equations.matrix.selfadjointView<Eigen::Lower>();
    // So that a shape without any match (no beta moves it) leaves the matrix regular.
    matrix.diagonal() += prior + Eigen::VectorXd::Constant(layout_.size(), 1e-9);
    const Eigen::VectorXd gradient = equations.gradient + prior.cwiseProduct(x_ - start_);
    // The betas are the last.
    const Eigen::Index free = options_.fitShape ? layout_.size() : layout_.betas();
    x_.head(free) -= matrix.topLeftCorner(free, free).ldlt().solve(gradient.head(free));
  }

  InnerBody result() const {
    InnerBody body{.betas = betas(), .pose = pose()};
    std::vector<double> bare, covered;
    double outside = 0.0;
    for (const SurfaceMatch& match :
         matches(skinning_.pose(skinning_.shape(body.betas), body.pose).vertices)) {
      if (match.bare)
        bare.push_back(std::abs(match.distance));
      else
        covered.push_back(-match.distance);
      outside += !match.bare && match.distance > 0.0 ? 1.0 : 0.0;
    }
    body.skinDistance = medianOf(bare);
    body.underCloth = medianOf(covered);
    body.insideOut = covered.empty() ? 0.0 : outside / static_cast<double>(covered.size());
    return body;
  }

  const Skinning& skinning_;
  SkinningJacobian jacobian_;
  const FusedPoints& surface_;
  PointGrid grid_;
  InnerBodyOptions options_;
  BodyParameterLayout layout_;
  Eigen::VectorXd start_, x_;
};

/// Of each of SMPL's joints, in the world.
std::array<Eigen::Quaterniond, kNumSmplJoints> worldRotations(const BodyPose& pose) {
  std::array<Eigen::Quaterniond, kNumSmplJoints> rotations;
  for (int joint = 0; joint < kNumSmplJoints; ++joint) {
    const auto j = static_cast<std::size_t>(joint);
    rotations[j] = quaternionFromAxisAngle(pose.jointRotations.segment<3>(3 * joint));
    if (joint > 0)
      rotations[j] = rotations[static_cast<std::size_t>(kSmplParents[j])] * rotations[j];
  }
  return rotations;
}

}  // namespace

void InnerBodyOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("InnerBodyOptions: ") + what);
  };
  demand(iterations >= 1 && iterations <= 100, "iterations is expected in 1 ... 100");
  demand(samples >= 100 && samples <= 100000, "samples is expected in 100 ... 100000");
  demand(gate > 0.0, "gate is expected above 0");
  demand(robustScale > 0.0, "robustScale is expected above 0");
  demand(clothOffset >= 0.0, "clothOffset is expected at 0 or above");
  demand(slackWeight >= 0.0 && slackWeight <= 1.0, "slackWeight is expected in 0 ... 1");
  demand(betaPrior >= 0.0 && posePrior >= 0.0, "the priors are expected at 0 or above");
}

InnerBody fitInnerBody(
    const Skinning& skinning,
    const Eigen::VectorXd& betas,
    const BodyPose& pose,
    const FusedPoints& surface,
    const InnerBodyOptions& options) {
  options.validate();
  return InnerBodyFitter(skinning, surface, options).run(betas, pose);
}

BodyPose carriedOver(
    const BodyPose& frame,
    const ShapedBody& tracked,
    const BodyPose& canonical,
    const ShapedBody& refined,
    const BodyPose& refinedCanonical) {
  const auto inFrame = worldRotations(frame);
  const auto inCanonical = worldRotations(canonical);
  const auto inRefined = worldRotations(refinedCanonical);
  BodyPose result = frame;
  std::array<Eigen::Quaterniond, kNumSmplJoints> world;
  for (int joint = 0; joint < kNumSmplJoints; ++joint) {
    const auto j = static_cast<std::size_t>(joint);
    world[j] = inFrame[j] * inCanonical[j].conjugate() * inRefined[j];
    const Eigen::Quaterniond local =
        joint == 0 ? world[j]
                   : world[static_cast<std::size_t>(kSmplParents[j])].conjugate() * world[j];
    result.jointRotations.segment<3>(3 * joint) = axisAngleFromQuaternion(local);
  }
  const auto pelvis = [](const ShapedBody& body, const BodyPose& pose) -> Eigen::Vector3d {
    return body.joints.col(kPelvis) + pose.translation;
  };
  const Eigen::Quaterniond turn = inFrame[kPelvis] * inCanonical[kPelvis].conjugate();
  result.translation = pelvis(tracked, frame) +
                       turn * (pelvis(refined, refinedCanonical) - pelvis(tracked, canonical)) -
                       refined.joints.col(kPelvis);
  return result;
}

}  // namespace avatar
