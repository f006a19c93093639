#include "avatar/skinning.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d result;
  result << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return result;
}

std::vector<Eigen::Matrix3d> localRotations(const BodyModel& model, const BodyPose& pose) {
  const Eigen::Index given = pose.jointRotations.size();
  const Eigen::Index needed = 3 * model.numJoints();
  if (given != needed && (given != 3 * kNumSmplJoints || given > needed)) {
    throw std::invalid_argument(
        "a pose of " + std::to_string(given) + " angles for a body of " +
        std::to_string(model.numJoints()) + " joints");
  }
  std::vector<Eigen::Matrix3d> result(
      static_cast<std::size_t>(model.numJoints()), Eigen::Matrix3d::Identity());
  for (Eigen::Index joint = 0; 3 * joint < given; ++joint) {
    result[static_cast<std::size_t>(joint)] =
        rotationMatrix(pose.jointRotations.segment<3>(3 * joint));
  }
  return result;
}

bool isAncestorOrSelf(const std::vector<int>& parents, int ancestor, int joint) {
  while (joint > ancestor)
    joint = parents[static_cast<std::size_t>(joint)];
  return joint == ancestor;
}

}  // namespace

Eigen::Matrix3d rotationMatrix(const Eigen::Vector3d& axisAngle) {
  const double angle = axisAngle.norm();
  if (angle < 1e-12)
    return Eigen::Matrix3d::Identity() + crossMatrix(axisAngle);
  return Eigen::AngleAxisd(angle, axisAngle / angle).toRotationMatrix();
}

Eigen::Matrix3d leftJacobian(const Eigen::Vector3d& axisAngle) {
  const double angle = axisAngle.norm();
  const Eigen::Matrix3d K = crossMatrix(axisAngle);
  // (1 − cos a)/a² and (a − sin a)/a³, by their series where the difference would cancel.
  const double square = angle * angle;
  const bool isSmall = angle < 1e-3;
  const double first = isSmall ? 0.5 - square / 24.0 : (1.0 - std::cos(angle)) / square;
  const double second =
      isSmall ? 1.0 / 6.0 - square / 120.0 : (angle - std::sin(angle)) / (square * angle);
  return Eigen::Matrix3d::Identity() + first * K + second * K * K;
}

Skinning::Skinning(const BodyModel& model) : model_(model) {
  const auto& weights = model.skinningWeights;
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    int count = 0;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(weights, v); it; ++it) {
      count += it.value() != 0.0 ? 1 : 0;
    }
    maxInfluences_ = std::max(maxInfluences_, count);
  }
  const std::size_t total =
      static_cast<std::size_t>(weights.rows()) * static_cast<std::size_t>(maxInfluences_);
  influenceJoints_.assign(total, 0);
  influenceWeights_.assign(total, 0.0);
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    std::size_t slot = static_cast<std::size_t>(v) * static_cast<std::size_t>(maxInfluences_);
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(weights, v); it; ++it) {
      if (it.value() == 0.0)
        continue;
      influenceJoints_[slot] = static_cast<int>(it.col());
      influenceWeights_[slot++] = it.value();
    }
  }
  for (const Eigen::MatrixXf& block : model.poseDirections) {
    PackedPoseBlock packed;
    for (Eigen::Index v = 0; 3 * v < block.rows(); ++v) {
      if (!block.middleRows<3>(3 * v).isZero(0.0F))
        packed.vertices.push_back(static_cast<int>(v));
    }
    packed.directions.resize(3 * static_cast<Eigen::Index>(packed.vertices.size()), 9);
    for (std::size_t i = 0; i < packed.vertices.size(); ++i) {
      packed.directions.middleRows<3>(3 * static_cast<Eigen::Index>(i)) =
          block.middleRows<3>(3 * packed.vertices[i]);
    }
    poseBlocks_.push_back(std::move(packed));
  }
}

ShapedBody Skinning::shape(const Eigen::VectorXd& betas) const {
  if (betas.size() > model_.numBetas() || !betas.allFinite()) {
    throw std::invalid_argument(
        "betas must be at most " + std::to_string(model_.numBetas()) + " finite numbers");
  }
  ShapedBody result;
  result.vertices = model_.templateVertices;
  result.vertices.reshaped() += model_.shapeDirections.leftCols(betas.size()) * betas;
  result.joints = (model_.jointRegressor * result.vertices.transpose()).transpose();
  return result;
}

int Skinning::poseRow(int joint, int vertex) const {
  if (joint == 0)
    return -1;
  const std::vector<int>& vertices = poseBlocks_[static_cast<std::size_t>(joint - 1)].vertices;
  const auto found = std::lower_bound(vertices.begin(), vertices.end(), vertex);
  if (found == vertices.end() || *found != vertex)
    return -1;
  return 3 * static_cast<int>(found - vertices.begin());
}

Eigen::Matrix3Xf Skinning::poseOffsets(const std::vector<Eigen::Matrix3d>& localRotations) const {
  Eigen::Matrix3Xf offsets = Eigen::Matrix3Xf::Zero(3, model_.numVertices());
  for (std::size_t i = 0; i < poseBlocks_.size(); ++i) {
    const PackedPoseBlock& block = poseBlocks_[i];
    const Eigen::Matrix3d change = localRotations[i + 1] - Eigen::Matrix3d::Identity();
    if (block.vertices.empty() || change.isZero(0.0))
      continue;
    const Eigen::Matrix<float, 9, 1> features = change.reshaped<Eigen::RowMajor>().cast<float>();
    const Eigen::VectorXf moved = block.directions * features;
    for (std::size_t k = 0; k < block.vertices.size(); ++k) {
      offsets.col(block.vertices[k]) += moved.segment<3>(3 * static_cast<Eigen::Index>(k));
    }
  }
  return offsets;
}

PosedBody Skinning::pose(const ShapedBody& shaped, const BodyPose& bodyPose) const {
  const std::vector<Eigen::Matrix3d> local = localRotations(model_, bodyPose);
  const int numJoints = model_.numJoints();
  PosedBody result;
  result.joints.resize(3, numJoints);
  result.rotations.resize(static_cast<std::size_t>(numJoints));
  result.rotations[0] = local[0];
  result.joints.col(0) = shaped.joints.col(0) + bodyPose.translation;
  for (int joint = 1; joint < numJoints; ++joint) {
    const int parent = model_.parents[static_cast<std::size_t>(joint)];
    const Eigen::Matrix3d& carrier = result.rotations[static_cast<std::size_t>(parent)];
    result.rotations[static_cast<std::size_t>(joint)] =
        carrier * local[static_cast<std::size_t>(joint)];
    result.joints.col(joint) = result.joints.col(parent) +
                               carrier * (shaped.joints.col(joint) - shaped.joints.col(parent));
  }
  std::vector<Eigen::Matrix<double, 3, 4>> bones(static_cast<std::size_t>(numJoints));
  for (int joint = 0; joint < numJoints; ++joint) {
    const Eigen::Matrix3d& R = result.rotations[static_cast<std::size_t>(joint)];
    bones[static_cast<std::size_t>(joint)] << R,
        result.joints.col(joint) - R * shaped.joints.col(joint);
  }
  const Eigen::Matrix3Xf offsets = poseOffsets(local);
  result.vertices.resize(3, model_.numVertices());
  for (Eigen::Index v = 0; v < model_.numVertices(); ++v) {
    const std::size_t first =
        static_cast<std::size_t>(v) * static_cast<std::size_t>(maxInfluences_);
    Eigen::Matrix<double, 3, 4> blend = Eigen::Matrix<double, 3, 4>::Zero();
    for (std::size_t k = first; k < first + static_cast<std::size_t>(maxInfluences_); ++k) {
      blend += influenceWeights_[k] * bones[static_cast<std::size_t>(influenceJoints_[k])];
    }
    const Eigen::Vector3d rest = shaped.vertices.col(v) + offsets.col(v).cast<double>();
    result.vertices.col(v) = blend.leftCols<3>() * rest + blend.col(3);
  }
  return result;
}

Skinning::Derivatives Skinning::derivatives(
    const ShapedBody& shaped, const BodyPose& bodyPose, const PosedBody& posed) const {
  Derivatives result(*this, shaped, posed);
  const std::vector<Eigen::Matrix3d> local = localRotations(model_, bodyPose);
  const auto numJoints = static_cast<std::size_t>(model_.numJoints());
  result.offsets_ = poseOffsets(local);
  result.angularVelocity_.assign(numJoints, Eigen::Matrix3d::Zero());
  result.localRates_.assign(numJoints, Eigen::Matrix<double, 9, 3>::Zero());
  for (std::size_t joint = 0; joint < numJoints; ++joint) {
    const auto first = 3 * static_cast<Eigen::Index>(joint);
    Eigen::Vector3d r = Eigen::Vector3d::Zero();
    if (first < bodyPose.jointRotations.size())
      r = bodyPose.jointRotations.segment<3>(first);
    const Eigen::Matrix3d J = leftJacobian(r);
    const Eigen::Matrix3d carrier =
        joint == 0 ? Eigen::Matrix3d::Identity()
                   : posed.rotations[static_cast<std::size_t>(model_.parents[joint])];
    result.angularVelocity_[joint] = carrier * J;
    for (int axis = 0; axis < 3; ++axis) {
      result.localRates_[joint].col(axis) =
          (crossMatrix(J.col(axis)) * local[joint]).reshaped<Eigen::RowMajor>();
    }
  }
  return result;
}

Skinning::Derivatives::Derivatives(
    const Skinning& skinning, const ShapedBody& shaped, const PosedBody& posed)
    : skinning_(skinning), shaped_(shaped), posed_(posed) {
  const BodyModel& model = skinning.model_;
  const Eigen::Index numBetas = model.numBetas();
  const int numJoints = model.numJoints();
  restJointsByShape_.resize(3 * numJoints, numBetas);
  for (Eigen::Index b = 0; b < numBetas; ++b) {
    const Eigen::Map<const Eigen::Matrix3Xd> direction(
        model.shapeDirections.col(b).data(), 3, model.numVertices());
    const Eigen::Matrix3Xd joints = (model.jointRegressor * direction.transpose()).transpose();
    restJointsByShape_.col(b) = joints.reshaped();
  }
  jointsByShape_.resize(3 * numJoints, numBetas);
  jointsByShape_.topRows<3>() = restJointsByShape_.topRows<3>();
  for (int joint = 1; joint < numJoints; ++joint) {
    const int parent = model.parents[static_cast<std::size_t>(joint)];
    jointsByShape_.middleRows<3>(3 * joint) = jointsByShape_.middleRows<3>(3 * parent) +
                                              posed.rotations[static_cast<std::size_t>(parent)] *
                                                  (restJointsByShape_.middleRows<3>(3 * joint) -
                                                   restJointsByShape_.middleRows<3>(3 * parent));
  }
}

// The part of a bone's motion that a vertex follows.
struct Skinning::Derivatives::Influence {
  int joint;
  double weight;
  Eigen::Vector3d point;  // where this bone alone would carry the vertex, world
};

std::vector<Skinning::Derivatives::Influence> Skinning::Derivatives::influences(int vertex) const {
  std::vector<Influence> result;
  const Eigen::Vector3d rest = shaped_.vertices.col(vertex) + offsets_.col(vertex).cast<double>();
  const auto count = static_cast<std::size_t>(skinning_.maxInfluences_);
  const std::size_t first = static_cast<std::size_t>(vertex) * count;
  for (std::size_t k = first; k < first + count; ++k) {
    const double weight = skinning_.influenceWeights_[k];
    if (weight == 0.0)
      continue;
    const int joint = skinning_.influenceJoints_[k];
    const Eigen::Matrix3d& R = posed_.rotations[static_cast<std::size_t>(joint)];
    result.push_back(
        {joint, weight, posed_.joints.col(joint) + R * (rest - shaped_.joints.col(joint))});
  }
  return result;
}

Eigen::Matrix3d Skinning::Derivatives::blendedRotation(const std::vector<Influence>& bones) const {
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for (const Influence& bone : bones) {
    result += bone.weight * posed_.rotations[static_cast<std::size_t>(bone.joint)];
  }
  return result;
}

// The joints whose rotation moves a vertex: those above its bones, and those with pose directions
// for it.
std::vector<int> Skinning::Derivatives::activeJoints(
    int vertex, const std::vector<Influence>& bones) const {
  const std::vector<int>& parents = skinning_.model_.parents;
  std::vector<int> result;
  for (int joint = 0; joint < skinning_.model_.numJoints(); ++joint) {
    const bool carries = std::any_of(bones.begin(), bones.end(), [&](const Influence& bone) {
      return isAncestorOrSelf(parents, joint, bone.joint);
    });
    if (carries || skinning_.poseRow(joint, vertex) >= 0)
      result.push_back(joint);
  }
  return result;
}

VertexDerivative Skinning::Derivatives::ofVertex(int vertex) const {
  const std::vector<Influence> bones = influences(vertex);
  const Eigen::Matrix3d blend = blendedRotation(bones);
  VertexDerivative result;
  result.joints = activeJoints(vertex, bones);
  result.byRotation.resize(3, 3 * static_cast<Eigen::Index>(result.joints.size()));
  Eigen::Index column = 0;
  for (const int joint : result.joints) {
    const auto j = static_cast<std::size_t>(joint);
    // A rotation rate ω about the joint moves the subtree's share of the vertex by ω × lever.
    Eigen::Vector3d lever = Eigen::Vector3d::Zero();
    for (const Influence& bone : bones) {
      if (isAncestorOrSelf(skinning_.model_.parents, joint, bone.joint)) {
        lever += bone.weight * (bone.point - posed_.joints.col(joint));
      }
    }
    Eigen::Matrix3d block = -crossMatrix(lever) * angularVelocity_[j];
    const int row = skinning_.poseRow(joint, vertex);
    if (row >= 0) {
      block += blend * skinning_.poseBlocks_[j - 1].directions.middleRows<3>(row).cast<double>() *
               localRates_[j];
    }
    result.byRotation.middleCols<3>(column) = block;
    column += 3;
  }
  return result;
}

Eigen::Matrix3Xd Skinning::Derivatives::ofVertexByShape(int vertex) const {
  const auto direction = skinning_.model_.shapeDirections.middleRows<3>(3 * vertex);
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, skinning_.model_.numBetas());
  for (const Influence& bone : influences(vertex)) {
    const Eigen::Matrix3d& R = posed_.rotations[static_cast<std::size_t>(bone.joint)];
    result += bone.weight * (R * (direction - restJointsByShape_.middleRows<3>(3 * bone.joint)) +
                             jointsByShape_.middleRows<3>(3 * bone.joint));
  }
  return result;
}

Eigen::MatrixXd Skinning::Derivatives::ofVertices(const std::vector<int>& vertices) const {
  const Eigen::Index numAngles = 3 * skinning_.model_.numJoints();
  const Eigen::Index numBetas = skinning_.model_.numBetas();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(
      3 * static_cast<Eigen::Index>(vertices.size()), numAngles + 3 + numBetas);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    const VertexDerivative derivative = ofVertex(vertices[i]);
    for (std::size_t k = 0; k < derivative.joints.size(); ++k) {
      result.block<3, 3>(row, 3 * derivative.joints[k]) =
          derivative.byRotation.middleCols<3>(3 * static_cast<Eigen::Index>(k));
    }
    result.block<3, 3>(row, numAngles).setIdentity();
    result.block(row, numAngles + 3, 3, numBetas) = ofVertexByShape(vertices[i]);
  }
  return result;
}

Eigen::MatrixXd Skinning::Derivatives::ofJoints() const {
  const std::vector<int>& parents = skinning_.model_.parents;
  const int numJoints = skinning_.model_.numJoints();
  const Eigen::Index numBetas = skinning_.model_.numBetas();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * numJoints, 3 * numJoints + 3 + numBetas);
  for (int joint = 0; joint < numJoints; ++joint) {
    for (int turned = parents[static_cast<std::size_t>(joint)]; turned >= 0;
         turned = parents[static_cast<std::size_t>(turned)]) {
      const Eigen::Vector3d lever = posed_.joints.col(joint) - posed_.joints.col(turned);
      result.block<3, 3>(3 * joint, 3 * turned) =
          -crossMatrix(lever) * angularVelocity_[static_cast<std::size_t>(turned)];
    }
    result.block<3, 3>(3 * joint, 3 * numJoints).setIdentity();
  }
  result.rightCols(numBetas) = jointsByShape_;
  return result;
}

}  // namespace avatar
