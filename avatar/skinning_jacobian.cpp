#include "avatar/skinning_jacobian.h"

#include "avatar/axis_angle.h"

#include <algorithm>

namespace avatar {
namespace {

Eigen::Vector3d rotationOf(const BodyPose& pose, int joint) {
  return 3 * joint < pose.jointRotations.size()
             ? Eigen::Vector3d(pose.jointRotations.segment<3>(3 * joint))
             : Eigen::Vector3d::Zero();
}

/// Column c: the entries of ∂R/∂θ_c = [J e_c] R, rows first.
Eigen::Matrix<double, 9, 3> rotationDerivative(
    const Eigen::Matrix3d& jacobian, const Eigen::Matrix3d& rotation) {
  Eigen::Matrix<double, 9, 3> derivative;
  for (int c = 0; c < 3; ++c) {
    const Eigen::Matrix3d transposed = (crossMatrix(jacobian.col(c)) * rotation).transpose();
    derivative.col(c) = transposed.reshaped();
  }
  return derivative;
}

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// ∂J_k/∂β at rest, 3 × B: the regressor's blend of the vertices' shape directions.
Eigen::Matrix3Xd jointShapeDerivative(const BodyModel& model, int joint) {
  Eigen::Matrix3Xd derivative = Eigen::Matrix3Xd::Zero(3, model.numBetas());
  for (SparseRows::InnerIterator it(model.jointRegressor, joint); it; ++it) {
    derivative += it.value() * model.shapeDirections.middleRows<3>(3 * it.col());
  }
  return derivative;
}

}  // namespace

void NormalEquations::add(
    const std::vector<int>& active, const Eigen::VectorXd& row, double residual, double weight) {
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double scaled = weight * row[active[i]];
    gradient[active[i]] += scaled * residual;
    double* column = &matrix(0, active[i]);
    for (std::size_t k = i; k < active.size(); ++k) {
      column[active[k]] += scaled * row[active[k]];
    }
  }
  weightedSquares += weight * residual * residual;
}

SkinningJacobian::SkinningJacobian(const Skinning& skinning) : skinning_(skinning) {
  const BodyModel& model = skinning.model();
  layout_ = {model.numJoints(), model.numBetas()};
  const auto numVertices = static_cast<std::size_t>(model.numVertices());

  restJointShapeDerivatives_.reserve(model.parents.size());
  for (int joint = 0; joint < model.numJoints(); ++joint) {
    restJointShapeDerivatives_.push_back(jointShapeDerivative(model, joint));
  }

  blendRows_.resize(numVertices);
  activeJoints_.resize(numVertices);
  const auto& shapes = skinning.poseBlendShapes();
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    for (std::size_t i = 0; i < shapes[s].vertices.size(); ++i) {
      const auto vertex = static_cast<std::size_t>(shapes[s].vertices[i]);
      blendRows_[vertex].push_back({static_cast<int>(s), 3 * static_cast<int>(i)});
      activeJoints_[vertex].push_back(shapes[s].joint);
    }
  }
  const auto addWithAncestors = [&](int joint, std::vector<int>& list) {
    for (; joint >= 0; joint = model.parents[static_cast<std::size_t>(joint)]) {
      list.push_back(joint);
    }
  };
  for (std::size_t v = 0; v < numVertices; ++v) {
    std::vector<int>& active = activeJoints_[v];
    for (SparseRows::InnerIterator it(model.skinningWeights, static_cast<Eigen::Index>(v)); it;
         ++it) {
      addWithAncestors(static_cast<int>(it.col()), active);
    }
    std::sort(active.begin(), active.end());
    active.erase(std::unique(active.begin(), active.end()), active.end());
  }
}

BodyLinearization SkinningJacobian::linearize(
    const ShapedBody& shaped, const BodyPose& pose) const {
  BodyLinearization at;
  at.body = skinning_.pose(shaped, pose);
  at.restJoints = shaped.joints;
  const std::vector<int>& parents = skinning_.model().parents;
  at.angularVelocities.resize(parents.size());
  at.rotationDerivatives.resize(parents.size());
  at.jointShapeDerivatives = restJointShapeDerivatives_;
  at.shapeOffsets = restJointShapeDerivatives_;
  for (std::size_t j = 0; j < parents.size(); ++j) {
    const Eigen::Vector3d axisAngle = rotationOf(pose, static_cast<int>(j));
    const Eigen::Matrix3d jacobian = leftJacobian(axisAngle);
    at.angularVelocities[j] = jacobian;
    at.rotationDerivatives[j] = rotationDerivative(jacobian, rotationMatrix(axisAngle));
    if (parents[j] >= 0) {
      const auto parent = static_cast<std::size_t>(parents[j]);
      const Eigen::Matrix3d above = at.body.worldFromJoint[parent].linear();
      at.angularVelocities[j] = above * jacobian;
      // The bone's change with shape, turned with its parent and added to the parent joint's.
      at.jointShapeDerivatives[j] -= restJointShapeDerivatives_[parent];
      at.jointShapeDerivatives[j] = above * at.jointShapeDerivatives[j];
      at.jointShapeDerivatives[j] += at.jointShapeDerivatives[parent];
    }
    const Eigen::Matrix3d rotation = at.body.worldFromJoint[j].linear();
    at.shapeOffsets[j] = at.jointShapeDerivatives[j] - rotation * restJointShapeDerivatives_[j];
  }
  return at;
}

void SkinningJacobian::addPoseBlendShapes(
    const BodyLinearization& at,
    int vertex,
    const Eigen::Vector3d& restDirection,
    Eigen::VectorXd& row) const {
  for (const BlendRow& blend : blendRows_[static_cast<std::size_t>(vertex)]) {
    const auto& shape = skinning_.poseBlendShapes()[static_cast<std::size_t>(blend.shape)];
    const Eigen::Matrix<double, 9, 1> perFeature =
        shape.directions.middleRows<3>(blend.row).cast<double>().transpose() * restDirection;
    row.segment<3>(BodyParameterLayout::joint(shape.joint)) +=
        at.rotationDerivatives[static_cast<std::size_t>(shape.joint)].transpose() * perFeature;
  }
}

// Turning joint j by ω moves what hangs on it: with x_k = G_k(T − J_k) and sums over j's subtree,
// v̇ = Σ w_k ω × (x_k − g_j) = ω × (s_j − W_j g_j), s_j = Σ w_k x_k, W_j = Σ w_k,
// and nᵀ(ω × a) = ωᵀ(a × n). The sums run up the tree from children to parents.
void SkinningJacobian::addVertexRow(
    const BodyLinearization& at,
    int vertex,
    const Eigen::Vector3d& direction,
    Eigen::VectorXd& row) const {
  const BodyModel& model = skinning_.model();
  const Eigen::Vector3d rest = at.body.restVertices.col(vertex);
  Eigen::Matrix4Xd sums = Eigen::Matrix4Xd::Zero(4, layout_.numJoints);
  Eigen::Vector3d restDirection = Eigen::Vector3d::Zero();
  auto betaRow = row.segment(layout_.betas(), layout_.numBetas);
  for (SparseRows::InnerIterator it(model.skinningWeights, vertex); it; ++it) {
    const auto k = static_cast<std::size_t>(it.col());
    const Eigen::Vector3d carried =
        at.body.worldFromJoint[k] * Eigen::Vector3d(rest - at.restJoints.col(it.col()));
    sums.col(it.col()) << it.value() * carried, it.value();
    restDirection += it.value() * (at.body.worldFromJoint[k].linear().transpose() * direction);
    betaRow += it.value() * (at.shapeOffsets[k].transpose() * direction);
  }
  betaRow += model.shapeDirections.middleRows<3>(3 * vertex).transpose() * restDirection;

  const std::vector<int>& active = activeJoints_[static_cast<std::size_t>(vertex)];
  for (auto joint = active.rbegin(); joint != active.rend(); ++joint) {
    const auto j = static_cast<std::size_t>(*joint);
    const Eigen::Vector4d sum = sums.col(*joint);
    const Eigen::Vector3d lever = sum.head<3>() - sum[3] * at.body.joints.col(*joint);
    row.segment<3>(BodyParameterLayout::joint(*joint)) +=
        at.angularVelocities[j].transpose() * lever.cross(direction);
    if (model.parents[j] >= 0) {
      sums.col(model.parents[j]) += sum;
    }
  }
  addPoseBlendShapes(at, vertex, restDirection, row);
  row.segment<3>(layout_.translation()) += direction;
}

std::vector<int> SkinningJacobian::activeParameters(const std::vector<int>& vertices) const {
  std::vector<int> joints;
  for (const int vertex : vertices) {
    const std::vector<int>& active = activeJoints_[static_cast<std::size_t>(vertex)];
    joints.insert(joints.end(), active.begin(), active.end());
  }
  std::sort(joints.begin(), joints.end());
  joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
  std::vector<int> parameters;
  parameters.reserve(3 * joints.size() + 3 + static_cast<std::size_t>(layout_.numBetas));
  for (const int joint : joints) {
    const int first = BodyParameterLayout::joint(joint);
    parameters.insert(parameters.end(), {first, first + 1, first + 2});
  }
  for (int parameter = layout_.translation(); parameter < layout_.size(); ++parameter) {
    parameters.push_back(parameter);
  }
  return parameters;
}

Eigen::MatrixXd SkinningJacobian::vertices(
    const BodyLinearization& at, const std::vector<int>& chosen) const {
  Eigen::MatrixXd jacobian(3 * static_cast<Eigen::Index>(chosen.size()), layout_.size());
  Eigen::VectorXd row(layout_.size());
  for (Eigen::Index i = 0; i < jacobian.rows(); ++i) {
    row.setZero();
    const int vertex = chosen[static_cast<std::size_t>(i / 3)];
    addVertexRow(at, vertex, Eigen::Vector3d::Unit(i % 3), row);
    jacobian.row(i) = row;
  }
  return jacobian;
}

Eigen::MatrixXd SkinningJacobian::allVertices(const BodyLinearization& at) const {
  std::vector<int> all(static_cast<std::size_t>(at.body.vertices.cols()));
  for (std::size_t v = 0; v < all.size(); ++v) {
    all[v] = static_cast<int>(v);
  }
  return vertices(at, all);
}

Eigen::MatrixXd SkinningJacobian::joints(const BodyLinearization& at) const {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3 * layout_.numJoints, layout_.size());
  const std::vector<int>& parents = skinning_.model().parents;
  for (int joint = 0; joint < layout_.numJoints; ++joint) {
    auto rows = jacobian.middleRows<3>(3 * joint);
    rows.middleCols<3>(layout_.translation()).setIdentity();
    rows.rightCols(layout_.numBetas) = at.jointShapeDerivatives[static_cast<std::size_t>(joint)];
    for (int a = parents[static_cast<std::size_t>(joint)]; a >= 0;
         a = parents[static_cast<std::size_t>(a)]) {
      const Eigen::Vector3d lever = at.body.joints.col(joint) - at.body.joints.col(a);
      rows.middleCols<3>(BodyParameterLayout::joint(a)) =
          -crossMatrix(lever) * at.angularVelocities[static_cast<std::size_t>(a)];
    }
  }
  return jacobian;
}

double addPlaneConstraint(
    const SkinningJacobian& jacobian,
    const BodyLinearization& at,
    const PlaneConstraint& constraint,
    NormalEquations& equations) {
  Eigen::VectorXd row = Eigen::VectorXd::Zero(jacobian.layout().size());
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  std::vector<int> corners;
  for (int i = 0; i < 3; ++i) {
    if (constraint.weights[i] == 0.0) {
      continue;
    }
    const int vertex = constraint.vertices[i];
    corners.push_back(vertex);
    point += constraint.weights[i] * at.body.vertices.col(vertex);
    jacobian.addVertexRow(at, vertex, constraint.weights[i] * constraint.normal, row);
  }
  const double residual = constraint.normal.dot(point) - constraint.offset;
  equations.add(jacobian.activeParameters(corners), row, residual, constraint.weight);
  return residual;
}

}  // namespace avatar
