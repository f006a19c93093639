#include "avatar/default_body/pose_correctives.h"

#include "avatar/default_body/surface_diffusion.h"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <numbers>

namespace avatar {
namespace {

using Features = Eigen::Matrix<double, 1, 9>;  // vec(R − I), row-major

struct TrainingAxis {
  Eigen::Vector3d axis;
  std::vector<double> degrees;
};

struct TrainedJoint {
  int joint;              // on the left side
  double smoothingReach;  // of the displacement over the skin [m]
  std::vector<TrainingAxis> axes;
};

// Through the ranges of motion that people use. Left side: −y flexes the elbow, +x the knee, −x the
// hip; −z lowers the arm.
std::vector<TrainedJoint> trainedJoints() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  return {
      {kLeftElbow, 0.008, {{y, {-30, -60, -90, -120, -140}}}},
      {kLeftKnee, 0.010, {{x, {30, 60, 90, 120, 140}}}},
      {kLeftWrist,
       0.004,
       {{x, {-120, -120, -90, -60, -30, 30, 60, 90, 120, 120}},
        {z, {-60, -30, 30, 60}},
        {y, {-25, 25}}}},
      {kLeftShoulder, 0.014, {{z, {-60, -40, -20, 30, 60}}, {y, {-80, -40, 30}}, {x, {-60, 60}}}},
      {kLeftHip, 0.014, {{x, {-110, -80, -50, -25, 25}}, {z, {20, 40}}, {y, {-35, 35}}}},
      {kLeftAnkle, 0.008, {{x, {-30, 30}}}},
  };
}

bool isInSubtree(int joint, int root) {
  while (joint >= 0 && joint != root)
    joint = kSmplParents[joint];
  return joint == root;
}

// The vertices that a joint bends, and how much each of them takes part.
struct Neighbourhood {
  std::vector<int> vertices;
  Eigen::VectorXd moving;  // weight that moves with the joint, per vertex in `vertices`
  Eigen::VectorXd mask;    // 1 in the bend, 0 where the skin is rigid
};

Neighbourhood neighbourhoodOf(int joint, const SparseRowMatrix& weights) {
  Neighbourhood result;
  std::vector<double> moving;
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    double sum = 0.0;
    for (SparseRowMatrix::InnerIterator it(weights, v); it; ++it) {
      if (isInSubtree(static_cast<int>(it.col()), joint))
        sum += it.value();
    }
    if (sum < 0.005 || sum > 0.995)
      continue;
    result.vertices.push_back(static_cast<int>(v));
    moving.push_back(sum);
  }
  result.moving =
      Eigen::Map<Eigen::VectorXd>(moving.data(), static_cast<Eigen::Index>(moving.size()));
  // 4w(1−w) is 1 in the middle of the bend; full correction from a tenth of it on.
  result.mask = (40.0 * result.moving.array() * (1.0 - result.moving.array())).min(1.0);
  return result;
}

BoneTransforms bent(int joint, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& pivot) {
  BoneTransforms restFromPosed;
  restFromPosed.fill(Eigen::Isometry3d::Identity());
  const Eigen::Isometry3d inverse = Eigen::Translation3d(pivot) *
                                    Eigen::Quaterniond(rotation).inverse() *
                                    Eigen::Translation3d(-pivot);
  for (int bone = 0; bone < kNumSmplJoints; ++bone) {
    if (isInSubtree(bone, joint))
      restFromPosed[bone] = inverse;
  }
  return restFromPosed;
}

class CorrectiveTrainer {
 public:
  CorrectiveTrainer(
      const SymmetricMesh& body, const SparseRowMatrix& weights, const BodyField& field)
      : body_(body), weights_(weights), field_(field) {}

  Eigen::MatrixXf train(const TrainedJoint& trained) const {
    const Neighbourhood near = neighbourhoodOf(trained.joint, weights_);
    const SurfaceDiffusion smooth(
        body_.mesh, Eigen::VectorXd::Constant(body_.mesh.numVertices(), trained.smoothingReach));
    Eigen::MatrixXd featureGram = Eigen::MatrixXd::Zero(9, 9);
    const auto count = static_cast<Eigen::Index>(near.vertices.size());
    Eigen::MatrixXd moment = Eigen::MatrixXd::Zero(9, 3 * count);
    int numPoses = 0;
    for (const TrainingAxis& axis : trained.axes) {
      for (const double degrees : axis.degrees) {
        const Eigen::Matrix3d rotation =
            Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis.axis).toRotationMatrix();
        Features features;
        features = (rotation - Eigen::Matrix3d::Identity()).reshaped<Eigen::RowMajor>().transpose();
        featureGram += features.transpose() * features;
        moment += features.transpose() *
                  restDisplacement(trained.joint, rotation, near, smooth).reshaped().transpose();
        ++numPoses;
      }
    }
    constexpr double kRidge = 2e-3;  // per pose: features are of order 1
    featureGram.diagonal().array() += kRidge * numPoses;
    const Eigen::MatrixXd solution = featureGram.ldlt().solve(moment);  // 9 × 3·count
    Eigen::MatrixXf block = Eigen::MatrixXf::Zero(3 * body_.mesh.numVertices(), 9);
    for (Eigen::Index i = 0; i < count; ++i) {
      block.middleRows<3>(3 * near.vertices[static_cast<std::size_t>(i)]) =
          solution.middleCols<3>(3 * i).transpose().cast<float>();
    }
    return block;
  }

 private:
  // 3 × count: what to add to the rest pose so that the blended skin lies on the bent anatomy [m].
  Eigen::Matrix3Xd restDisplacement(
      int joint,
      const Eigen::Matrix3d& rotation,
      const Neighbourhood& near,
      const SurfaceDiffusion& smooth) const {
    constexpr double kLargest = 0.030;  // [m]; more means the projection found another surface
    const Eigen::Vector3d pivot = field_.joints()[joint];
    const BoneTransforms restFromPosed = bent(joint, rotation, pivot);
    const auto distance = [&](const Eigen::Vector3d& p) {
      return field_.distance(p, restFromPosed);
    };
    Eigen::MatrixXd displacement = Eigen::MatrixXd::Zero(body_.mesh.numVertices(), 3);
    for (std::size_t i = 0; i < near.vertices.size(); ++i) {
      const int v = near.vertices[i];
      const double moving = near.moving[static_cast<Eigen::Index>(i)];
      const Eigen::Matrix3d blend =
          moving * rotation + (1.0 - moving) * Eigen::Matrix3d::Identity();
      const Eigen::Vector3d skinned = pivot + blend * (body_.mesh.vertices.col(v) - pivot);
      Eigen::Vector3d move = projectOntoZeroSet(distance, skinned) - skinned;
      if (move.norm() > kLargest)
        move *= kLargest / move.norm();
      displacement.row(v) = near.mask[static_cast<Eigen::Index>(i)] * move.transpose();
    }
    displacement = smooth(displacement);
    Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(near.vertices.size()));
    for (std::size_t i = 0; i < near.vertices.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      const double moving = near.moving[column];
      const Eigen::Matrix3d blend =
          moving * rotation + (1.0 - moving) * Eigen::Matrix3d::Identity();
      result.col(column) =
          blend.partialPivLu().solve(displacement.row(near.vertices[i]).transpose());
    }
    return result;
  }

  const SymmetricMesh& body_;
  const SparseRowMatrix& weights_;
  const BodyField& field_;
};

// With M = diag(−1, 1, 1): the other side turns by M R M and moves by M d.
Eigen::MatrixXf mirroredBlock(const SymmetricMesh& body, const Eigen::MatrixXf& block) {
  const Eigen::Vector3f mirror(-1.0F, 1.0F, 1.0F);
  const Eigen::Matrix3f featureSigns = mirror * mirror.transpose();
  const Eigen::Matrix<float, 3, 9> signs =
      mirror * featureSigns.reshaped<Eigen::RowMajor>().transpose();
  Eigen::MatrixXf result(block.rows(), block.cols());
  for (Eigen::Index v = 0; v < body.mesh.numVertices(); ++v) {
    const Eigen::Index other = body.mirrorVertex[static_cast<std::size_t>(v)];
    result.middleRows<3>(3 * v) = signs.cwiseProduct(block.middleRows<3>(3 * other));
  }
  return result;
}

}  // namespace

std::vector<Eigen::MatrixXf> makePoseCorrectives(
    const SymmetricMesh& body, const SparseRowMatrix& weights, const BodyField& field) {
  std::vector<Eigen::MatrixXf> blocks(kNumSmplJoints - 1);
  const CorrectiveTrainer trainer(body, weights, field);
  for (const TrainedJoint& trained : trainedJoints()) {
    const Eigen::MatrixXf block = trainer.train(trained);
    blocks[trained.joint - 1] = block;
    blocks[mirroredJoint(trained.joint) - 1] = mirroredBlock(body, block);
  }
  return blocks;
}

}  // namespace avatar
