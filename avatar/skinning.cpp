#include "avatar/skinning.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

void require(bool holds, const std::string& what) {
  if (!holds) {
    throw std::invalid_argument("BodyModel: " + what);
  }
}

using Features = Eigen::Matrix<float, 9, 1>;

/// R − I, rows first: what a joint's nine pose blend shapes are multiplied with.
Features poseFeatures(const Eigen::Matrix3d& rotation) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = rotation - Eigen::Matrix3d::Identity();
  return Eigen::Map<const Eigen::Matrix<double, 9, 1>>(rows.data()).cast<float>();
}

Skinning::PoseBlendShape compressed(const Eigen::MatrixXf& block, int joint) {
  Skinning::PoseBlendShape shape;
  shape.joint = joint;
  for (Eigen::Index v = 0; 3 * v < block.rows(); ++v) {
    if (!block.middleRows<3>(3 * v).isZero(0.0F)) {
      shape.vertices.push_back(static_cast<int>(v));
    }
  }
  shape.directions.resize(3 * static_cast<Eigen::Index>(shape.vertices.size()), 9);
  for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
    shape.directions.middleRows<3>(3 * static_cast<Eigen::Index>(i)) =
        block.middleRows<3>(3 * shape.vertices[i]);
  }
  return shape;
}

/// Rotations of all joints of a model; those without values are at rest.
std::vector<Eigen::Matrix3d> localRotations(const BodyPose& pose, int numJoints) {
  const Eigen::VectorXd& values = pose.jointRotations;
  const Eigen::Index used = std::min<Eigen::Index>(values.size(), 3 * numJoints);
  if (values.size() % 3 != 0 || !values.allFinite() || !pose.translation.allFinite()) {
    throw std::invalid_argument("BodyPose: expected finite numbers, three per joint");
  }
  if (!values.tail(values.size() - used).isZero(0.0)) {
    throw std::invalid_argument(
        "BodyPose: moves joints beyond the model's " + std::to_string(numJoints));
  }
  std::vector<Eigen::Matrix3d> rotations(
      static_cast<std::size_t>(numJoints), Eigen::Matrix3d::Identity());
  for (Eigen::Index joint = 0; 3 * joint < used; ++joint) {
    rotations[static_cast<std::size_t>(joint)] = rotationMatrix(values.segment<3>(3 * joint));
  }
  return rotations;
}

void addPoseBlendShape(
    const Skinning::PoseBlendShape& shape,
    const Eigen::Matrix3d& rotation,
    Eigen::Matrix3Xd& vertices) {
  const Features features = poseFeatures(rotation);
  if (features.isZero(0.0F)) {
    return;
  }
  const Eigen::VectorXf offsets = shape.directions * features;
  for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
    vertices.col(shape.vertices[i]) +=
        offsets.segment<3>(3 * static_cast<Eigen::Index>(i)).cast<double>();
  }
}

std::vector<Eigen::Isometry3d> jointChain(
    const BodyModel& model,
    const Eigen::Matrix3Xd& restJoints,
    const std::vector<Eigen::Matrix3d>& rotations,
    const Eigen::Vector3d& translation) {
  std::vector<Eigen::Isometry3d> worldFromJoint(rotations.size());
  for (int joint = 0; joint < model.numJoints(); ++joint) {
    Eigen::Isometry3d& frame = worldFromJoint[static_cast<std::size_t>(joint)];
    const Eigen::Matrix3d& rotation = rotations[static_cast<std::size_t>(joint)];
    const int parent = model.parents[static_cast<std::size_t>(joint)];
    frame.setIdentity();
    if (parent < 0) {
      frame.linear() = rotation;
      frame.translation() = restJoints.col(joint) + translation;
    } else {
      const Eigen::Isometry3d& above = worldFromJoint[static_cast<std::size_t>(parent)];
      frame.linear() = above.linear() * rotation;
      frame.translation() = above * (restJoints.col(joint) - restJoints.col(parent));
    }
  }
  return worldFromJoint;
}

/// v = Σ_k w_k [R_k | g_k − R_k J_k] (T, 1). Four rows, so that columns fill vector registers.
Eigen::Matrix3Xd blended(
    const BodyModel& model,
    const Eigen::Matrix3Xd& restVertices,
    const Eigen::Matrix3Xd& restJoints,
    const std::vector<Eigen::Isometry3d>& worldFromJoint) {
  std::vector<Eigen::Matrix4d> worldFromRest(worldFromJoint.size());
  for (std::size_t k = 0; k < worldFromJoint.size(); ++k) {
    const Eigen::Vector3d restJoint = restJoints.col(static_cast<Eigen::Index>(k));
    worldFromRest[k] = worldFromJoint[k].matrix();
    worldFromRest[k].topRightCorner<3, 1>() -= worldFromJoint[k].linear() * restJoint;
  }
  const auto& weights = model.skinningWeights;
  const int* starts = weights.outerIndexPtr();
  Eigen::Matrix3Xd vertices(3, restVertices.cols());
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    Eigen::Matrix4d transform = Eigen::Matrix4d::Zero();
    for (int entry = starts[v]; entry < starts[v + 1]; ++entry) {
      const auto joint = static_cast<std::size_t>(weights.innerIndexPtr()[entry]);
      transform += weights.valuePtr()[entry] * worldFromRest[joint];
    }
    const Eigen::Vector4d moved = transform.col(0) * restVertices(0, v) +
                                  transform.col(1) * restVertices(1, v) +
                                  transform.col(2) * restVertices(2, v) + transform.col(3);
    vertices.col(v) = moved.head<3>();
  }
  return vertices;
}

}  // namespace

void requireValid(const BodyModel& model) {
  const Eigen::Index numVertices = model.numVertices();
  const int numJoints = model.numJoints();
  require(numVertices > 0 && numJoints > 0, "has no vertices or no joints");
  require(model.shapeDirections.rows() == 3 * numVertices, "shapeDirections must have 3V rows");
  require(
      model.poseDirections.size() + 1 == model.parents.size(),
      "poseDirections must have J - 1 blocks");
  for (const Eigen::MatrixXf& block : model.poseDirections) {
    require(
        block.size() == 0 || (block.rows() == 3 * numVertices && block.cols() == 9),
        "a block of poseDirections must be 3V x 9 or empty");
  }
  require(
      model.jointRegressor.rows() == numJoints && model.jointRegressor.cols() == numVertices,
      "jointRegressor must be J x V");
  require(
      model.skinningWeights.rows() == numVertices && model.skinningWeights.cols() == numJoints,
      "skinningWeights must be V x J");
  require(model.skinningWeights.isCompressed(), "skinningWeights must be compressed");
  for (int joint = 0; joint < numJoints; ++joint) {
    const int parent = model.parents[static_cast<std::size_t>(joint)];
    require(
        joint == 0 ? parent == -1 : parent >= 0 && parent < joint,
        "parents must come before their children, joint 0 is the root");
  }
  require(
      model.faces.size() == 0 ||
          (model.faces.minCoeff() >= 0 && model.faces.maxCoeff() < numVertices),
      "a face names a vertex that is not there");
}

Eigen::Matrix3Xd shapedVertices(const BodyModel& model, const Eigen::VectorXd& betas) {
  if (betas.size() > model.numBetas() || !betas.allFinite()) {
    throw std::invalid_argument(
        "betas: expected at most " + std::to_string(model.numBetas()) + " finite numbers, found " +
        std::to_string(betas.size()));
  }
  Eigen::Matrix3Xd vertices = model.templateVertices;
  if (betas.size() > 0) {
    vertices.reshaped() += model.shapeDirections.leftCols(betas.size()) * betas;
  }
  return vertices;
}

Eigen::Matrix3d rotationMatrix(const Eigen::Vector3d& axisAngle) {
  const double angle = axisAngle.norm();
  // Eigen's AngleAxis needs a unit axis; below 1e-12 the first-order term is exact to rounding.
  if (angle < 1e-12) {
    Eigen::Matrix3d rotation;
    rotation << 1.0, -axisAngle.z(), axisAngle.y(),  //
        axisAngle.z(), 1.0, -axisAngle.x(),          //
        -axisAngle.y(), axisAngle.x(), 1.0;
    return rotation;
  }
  return Eigen::AngleAxisd(angle, axisAngle / angle).toRotationMatrix();
}

Skinning::Skinning(const BodyModel& model) : model_(model) {
  requireValid(model);
  for (int joint = 1; joint < model.numJoints(); ++joint) {
    const Eigen::MatrixXf& block = model.poseDirections[static_cast<std::size_t>(joint) - 1];
    if (block.size() > 0) {
      poseBlendShapes_.push_back(compressed(block, joint));
    }
  }
}

ShapedBody Skinning::shape(const Eigen::VectorXd& betas) const {
  ShapedBody shaped;
  shaped.vertices = shapedVertices(model_, betas);
  shaped.joints = (model_.jointRegressor * shaped.vertices.transpose()).transpose();
  return shaped;
}

SkinnedBody Skinning::pose(const ShapedBody& shaped, const BodyPose& pose) const {
  if (shaped.vertices.cols() != model_.numVertices() ||
      shaped.joints.cols() != model_.numJoints()) {
    throw std::invalid_argument("Skinning::pose: the shaped body is another model's");
  }
  const auto rotations = localRotations(pose, model_.numJoints());
  SkinnedBody body;
  body.restVertices = shaped.vertices;
  for (const PoseBlendShape& blendShape : poseBlendShapes_) {
    const auto joint = static_cast<std::size_t>(blendShape.joint);
    addPoseBlendShape(blendShape, rotations[joint], body.restVertices);
  }
  body.worldFromJoint = jointChain(model_, shaped.joints, rotations, pose.translation);
  body.joints.resize(3, model_.numJoints());
  for (int joint = 0; joint < model_.numJoints(); ++joint) {
    body.joints.col(joint) = body.worldFromJoint[static_cast<std::size_t>(joint)].translation();
  }
  body.vertices = blended(model_, body.restVertices, shaped.joints, body.worldFromJoint);
  return body;
}

SkinnedBody posedBody(const BodyModel& model, const Eigen::VectorXd& betas, const BodyPose& pose) {
  const Skinning skinning(model);
  return skinning.pose(skinning.shape(betas), pose);
}

Eigen::Matrix3Xd posedVertices(
    const BodyModel& model, const Eigen::VectorXd& betas, const BodyPose& pose) {
  return posedBody(model, betas, pose).vertices;
}

}  // namespace avatar
