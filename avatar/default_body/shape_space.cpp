#include "avatar/default_body/shape_space.h"

#include "avatar/default_body/surface_diffusion.h"
#include "avatar/geometry/measures.h"

#include <algorithm>
#include <cmath>

namespace avatar {
namespace {

enum Shape { kStature, kMass, kShoulder, kChest, kWaist, kHipGirth, kLeg, kArm, kMuscle, kBelly };

using BoneScales = std::array<Eigen::Vector3d, kNumSmplJoints>;

void scaleSides(BoneScales& scales, int leftBone, const Eigen::Vector3d& factor) {
  for (const int bone : {leftBone, mirroredJoint(leftBone)}) {
    scales[bone] = scales[bone].cwiseProduct(factor);
  }
}

// Girths grow with stature, but less than lengths (allometry of adults: exponent about 0.6).
void scaleByStature(BoneScales& scales, double beta) {
  const double length = 1.0 + 0.070 / 1.70 * beta;
  const double girth = 1.0 + 0.6 * (length - 1.0);
  const double head = 1.0 + 0.35 * (length - 1.0);
  for (const int bone : {kPelvis, kSpine1, kSpine2, kSpine3, kNeck}) {
    scales[bone] = scales[bone].cwiseProduct(Eigen::Vector3d(girth, length, girth));
  }
  scales[kHead] *= head;
  scaleSides(scales, kLeftCollar, {length, girth, girth});
  for (const int bone : {kLeftShoulder, kLeftElbow})
    scaleSides(scales, bone, {length, girth, girth});
  for (const int bone : {kLeftHip, kLeftKnee})
    scaleSides(scales, bone, {girth, length, girth});
  for (const int bone : {kLeftWrist, kLeftHand, kLeftAnkle, kLeftFoot}) {
    scaleSides(scales, bone, Eigen::Vector3d::Constant(0.5 * (length + girth)));
  }
}

BoneScales boneScales(const Eigen::VectorXd& betas) {
  BoneScales scales;
  scales.fill(Eigen::Vector3d::Ones());
  scaleByStature(scales, betas[kStature]);
  const double shoulder = betas[kShoulder];
  scaleSides(scales, kLeftCollar, {1.0 + 0.065 * shoulder, 1.0, 1.0 + 0.010 * shoulder});
  scales[kSpine3].x() *= 1.0 + 0.030 * shoulder;
  scales[kSpine2].x() *= 1.0 + 0.012 * shoulder;
  const double chest = betas[kChest];
  scales[kSpine3] =
      scales[kSpine3].cwiseProduct(Eigen::Vector3d(1.0 + 0.022 * chest, 1.0, 1.0 + 0.030 * chest));
  scales[kSpine2] =
      scales[kSpine2].cwiseProduct(Eigen::Vector3d(1.0 + 0.022 * chest, 1.0, 1.0 + 0.030 * chest));
  const double hip = betas[kHipGirth];
  scales[kPelvis].x() *= 1.0 + 0.035 * hip;
  // Longer legs at the same stature: the trunk gives way.
  const double leg = betas[kLeg];
  for (const int bone : {kLeftHip, kLeftKnee})
    scaleSides(scales, bone, {1.0, 1.0 + 0.032 * leg, 1.0});
  for (const int bone : {kPelvis, kSpine1, kSpine2, kSpine3})
    scales[bone].y() *= 1.0 - 0.045 * leg;
  const double arm = betas[kArm];
  for (const int bone : {kLeftShoulder, kLeftElbow})
    scaleSides(scales, bone, {1.0 + 0.038 * arm, 1.0, 1.0});
  for (const int bone : {kLeftWrist, kLeftHand})
    scaleSides(scales, bone, {1.0 + 0.025 * arm, 1.0, 1.0});
  return scales;
}

// A bone's vector scales with the bone that carries it: the parent.
JointPositions scaledJoints(const JointPositions& rest, const BoneScales& scales) {
  JointPositions result;
  result[kPelvis] = rest[kPelvis];
  for (int joint = 1; joint < kNumSmplJoints; ++joint) {
    const int parent = kSmplParents[joint];
    result[joint] = result[parent] + scales[parent].cwiseProduct(rest[joint] - rest[parent]);
  }
  return result;
}

// Thickness of subcutaneous fat and of muscle that one unit adds over each bone [m].
struct SoftLayer {
  double fat, muscle;
};

SoftLayer softLayer(int bone) {
  switch (std::min(bone, mirroredJoint(bone))) {
    case kPelvis:
      return {0.0085, 0.0010};
    case kLeftHip:
      return {0.0055, 0.0040};
    case kSpine1:
      return {0.0106, -0.0005};
    case kSpine2:
      return {0.0089, 0.0020};
    case kSpine3:
      return {0.0064, 0.0045};
    case kLeftCollar:
      return {0.0047, 0.0050};
    case kNeck:
      return {0.0034, 0.0030};
    case kHead:
      return {0.0014, 0.0000};
    case kLeftShoulder:
      return {0.0044, 0.0048};
    case kLeftElbow:
      return {0.0022, 0.0026};
    case kLeftKnee:
      return {0.0029, 0.0028};
    case kLeftWrist:
      return {0.0007, 0.0003};
    case kLeftHand:
      return {0.0003, 0.0000};
    case kLeftAnkle:
      return {0.0007, 0.0000};
    default:
      return {0.0002, 0.0000};
  }
}

// A smooth hill on the skin: 1 at the centre, falling off as a Gaussian; mirrored.
double hill(
    const Eigen::Vector3d& point, const Eigen::Vector3d& center, const Eigen::Vector3d& width) {
  const Eigen::Vector3d q(std::abs(point.x()), point.y(), point.z());
  return std::exp(-0.5 * (q - center).cwiseQuotient(width).squaredNorm());
}

double smoothStep(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

// Between the thighs the skin has little room to grow: none at the midline, all of it 6 cm away.
double freedom(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  const double isBelowCrotch = smoothStep(-0.04, -0.12, point.y());
  const double facesMidline = smoothStep(0.0, 0.5, point.x() > 0.0 ? -normal.x() : normal.x());
  return 1.0 - isBelowCrotch * facesMidline * (1.0 - smoothStep(0.0, 0.06, std::abs(point.x())));
}

Eigen::RowVectorXd skinOffsets(const Eigen::Vector3d& point, const SoftLayer& layer) {
  Eigen::RowVectorXd result = Eigen::RowVectorXd::Zero(kNumShapes);
  const double belly = hill(point, {0.0, 0.070, 0.115}, {0.085, 0.085, 0.070});
  const double bust = hill(point, {0.078, 0.348, 0.115}, {0.046, 0.044, 0.060});
  const double waist = std::exp(-0.5 * std::pow((point.y() - 0.165) / 0.075, 2)) *
                       (std::abs(point.x()) < 0.25 ? 1.0 : 0.0);
  const double hipBand = hill(point, {0.165, -0.050, -0.010}, {0.060, 0.090, 0.120});
  const double buttock = hill(point, {0.075, -0.045, -0.115}, {0.060, 0.060, 0.050});
  const double breastMuscle = hill(point, {0.075, 0.375, 0.110}, {0.060, 0.040, 0.050});
  const double lat = hill(point, {0.150, 0.330, -0.040}, {0.050, 0.080, 0.060});
  result[kMass] = layer.fat + 0.0060 * belly + 0.0040 * buttock + 0.0035 * bust;
  result[kChest] = 0.0130 * bust;
  result[kWaist] = 0.0110 * waist;
  result[kHipGirth] = 0.0070 * hipBand + 0.0080 * buttock;
  result[kMuscle] = layer.muscle + 0.0035 * breastMuscle + 0.0040 * lat - 0.0040 * belly;
  result[kBelly] = 0.0220 * belly;
  return result;
}

// Normals averaged over about the thickness of a finger, so that offset skin doesn't fold.
Eigen::Matrix3Xd smoothNormals(const SymmetricMesh& body) {
  constexpr double kReach = 0.015;  // [m]
  const SurfaceDiffusion smooth(
      body.mesh, Eigen::VectorXd::Constant(body.mesh.numVertices(), kReach));
  Eigen::Matrix3Xd result = smooth(vertexNormals(body.mesh).transpose()).transpose();
  result.colwise().normalize();
  for (Eigen::Index v = 0; v < result.cols(); ++v) {
    const int other = body.mirrorVertex[v];
    if (other < v)
      continue;
    const Eigen::Vector3d flipped(-result(0, other), result(1, other), result(2, other));
    const Eigen::Vector3d mean = (result.col(v) + flipped).normalized();
    result.col(v) = mean;
    result.col(other) << -mean.x(), mean.y(), mean.z();
    if (other == v)
      result(0, v) = 0.0;
  }
  return result;
}

}  // namespace

ShapeSpace::ShapeSpace(
    const SymmetricMesh& body, const SparseRowMatrix& weights, const JointPositions& joints)
    : body_(body), weights_(weights), joints_(joints), normals_(smoothNormals(body)) {
  offsets_.resize(body.mesh.numVertices(), kNumShapes);
  for (Eigen::Index v = 0; v < offsets_.rows(); ++v) {
    SoftLayer layer{0.0, 0.0};
    for (SparseRowMatrix::InnerIterator it(weights, v); it; ++it) {
      const SoftLayer ofBone = softLayer(static_cast<int>(it.col()));
      layer.fat += it.value() * ofBone.fat;
      layer.muscle += it.value() * ofBone.muscle;
    }
    const Eigen::Vector3d point = body.mesh.vertices.col(v);
    offsets_.row(v) = freedom(point, normals_.col(v)) * skinOffsets(point, layer);
  }
}

ShapedAnatomy ShapeSpace::shape(const Eigen::VectorXd& betas) const {
  const BoneScales scales = boneScales(betas);
  ShapedAnatomy result;
  result.joints = scaledJoints(joints_, scales);
  result.vertices = normals_ * (offsets_ * betas).asDiagonal();
  for (Eigen::Index v = 0; v < result.vertices.cols(); ++v) {
    const Eigen::Vector3d point = body_.mesh.vertices.col(v);
    for (SparseRowMatrix::InnerIterator it(weights_, v); it; ++it) {
      const int bone = static_cast<int>(it.col());
      result.vertices.col(v) +=
          it.value() * (result.joints[bone] + scales[bone].cwiseProduct(point - joints_[bone]));
    }
  }
  return result;
}

Eigen::MatrixXd ShapeSpace::directions() const {
  Eigen::MatrixXd result(3 * body_.mesh.numVertices(), kNumShapes);
  for (int k = 0; k < kNumShapes; ++k) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(kNumShapes, k);
    result.col(k) = 0.5 * (shape(unit).vertices - shape(-unit).vertices).reshaped();
  }
  return result;
}

Eigen::MatrixXd ShapeSpace::jointDirections() const {
  Eigen::MatrixXd result(3 * kNumSmplJoints, kNumShapes);
  for (int k = 0; k < kNumShapes; ++k) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(kNumShapes, k);
    const JointPositions plus = shape(unit).joints;
    const JointPositions minus = shape(-unit).joints;
    for (int joint = 0; joint < kNumSmplJoints; ++joint) {
      result.col(k).segment<3>(3 * joint) = 0.5 * (plus[joint] - minus[joint]);
    }
  }
  return result;
}

}  // namespace avatar
