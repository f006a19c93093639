#include "avatar/default_body/skinning_weights.h"

#include "avatar/default_body/surface_diffusion.h"

#include <algorithm>
#include <array>

namespace avatar {
namespace {

// How far a joint's influence reaches over the skin, one standard deviation [m]: about half the
// limb's thickness there. Given for the midline and the left side; a vertex takes the value of the
// bone it belongs to.
constexpr std::array<double, kNumSmplJoints> kReach = [] {
  std::array<double, kNumSmplJoints> reach{};
  reach[kPelvis] = 0.050;
  reach[kSpine1] = reach[kSpine2] = reach[kSpine3] = 0.055;
  reach[kNeck] = 0.028;
  reach[kHead] = 0.024;
  reach[kLeftCollar] = 0.045;
  reach[kLeftShoulder] = 0.042;
  reach[kLeftElbow] = 0.030;
  reach[kLeftWrist] = 0.020;
  reach[kLeftHand] = 0.010;
  reach[kLeftHip] = 0.048;
  reach[kLeftKnee] = 0.034;
  reach[kLeftAnkle] = 0.020;
  reach[kLeftFoot] = 0.013;
  return reach;
}();

int trunkBone(const Eigen::Vector3d& point, const JointPositions& joints) {
  if (point.y() < joints[kSpine1].y())
    return kPelvis;
  if (point.y() < joints[kSpine2].y())
    return kSpine1;
  if (point.y() < joints[kSpine3].y())
    return kSpine2;
  if (point.y() < joints[kNeck].y() + 0.01)
    return kSpine3;
  return kNeck;
}

bool isTrunk(int bone) {
  return bone == kPelvis || bone == kSpine1 || bone == kSpine2 || bone == kSpine3;
}

int boneOf(const Eigen::Vector3d& point, const BodyField& field) {
  const int bone = field.dominantBone(point);
  if (!isTrunk(bone))
    return bone;
  // Shoulder girdle: the part of the upper trunk that the collar bone carries.
  const bool isGirdle = point.y() > 0.40 && point.x() > 0.075;
  return isGirdle ? static_cast<int>(kLeftCollar) : trunkBone(point, field.joints());
}

SparseRowMatrix keepLargest(const Eigen::MatrixXd& dense) {
  constexpr int kMaxInfluences = 4;
  constexpr double kNegligible = 0.004;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index v = 0; v < dense.rows(); ++v) {
    std::array<int, kNumSmplJoints> order{};
    for (int joint = 0; joint < kNumSmplJoints; ++joint)
      order[joint] = joint;
    std::stable_sort(
        order.begin(), order.end(), [&](int a, int b) { return dense(v, a) > dense(v, b); });
    // Whatever equals the first one left out goes with it, or a vertex on the midline would keep
    // one of two mirrored joints.
    const double cut = std::max(kNegligible, (1.0 + 1e-9) * dense(v, order[kMaxInfluences]));
    int count = 0;
    double sum = 0.0;
    while (count < kMaxInfluences && dense(v, order[count]) > cut) {
      sum += dense(v, order[count++]);
    }
    for (int i = 0; i < count; ++i) {
      entries.emplace_back(static_cast<int>(v), order[i], dense(v, order[i]) / sum);
    }
  }
  SparseRowMatrix result(dense.rows(), dense.cols());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

// Exactly symmetric: every row is averaged with its mirror image.
Eigen::MatrixXd symmetrised(const SymmetricMesh& body, const Eigen::MatrixXd& weights) {
  Eigen::MatrixXd result(weights.rows(), weights.cols());
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    const int other = body.mirrorVertex[v];
    for (int joint = 0; joint < kNumSmplJoints; ++joint) {
      result(v, joint) = 0.5 * (weights(v, joint) + weights(other, mirroredJoint(joint)));
    }
  }
  return result;
}

// The bone each vertex belongs to before smoothing: that of the primitive which shapes it, the
// trunk cut at the spine joints.
std::vector<int> segmentByBone(const SymmetricMesh& body, const BodyField& field) {
  std::vector<int> bones(body.mirrorVertex.size());
  for (std::size_t v = 0; v < bones.size(); ++v) {
    Eigen::Vector3d point = body.mesh.vertices.col(static_cast<Eigen::Index>(v));
    const bool isLeft = point.x() >= 0.0;
    point.x() = std::abs(point.x());
    const int bone = boneOf(point, field);
    bones[v] = isLeft ? bone : mirroredJoint(bone);
  }
  return bones;
}

}  // namespace

SparseRowMatrix makeSkinningWeights(const SymmetricMesh& body, const BodyField& field) {
  const std::vector<int> bones = segmentByBone(body, field);
  const Eigen::Index numVertices = body.mesh.numVertices();
  Eigen::MatrixXd indicator = Eigen::MatrixXd::Zero(numVertices, kNumSmplJoints);
  Eigen::VectorXd reach(numVertices);
  for (Eigen::Index v = 0; v < numVertices; ++v) {
    indicator(v, bones[v]) = 1.0;
    reach[v] = std::max(kReach[bones[v]], kReach[mirroredJoint(bones[v])]);
  }
  constexpr int kNumSteps = 3;  // one alone would leave a kink at the segments' borders
  return keepLargest(symmetrised(body, SurfaceDiffusion(body.mesh, reach, kNumSteps)(indicator)));
}

}  // namespace avatar
