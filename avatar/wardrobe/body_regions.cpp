#include "avatar/wardrobe/body_regions.h"

#include "avatar/body_pose.h"

#include <stdexcept>

namespace avatar {
namespace {

BodyRegion smplJointRegion(int joint) {
  switch (joint) {
    case kLeftHip:
    case kLeftKnee:
    case kLeftAnkle:
    case kLeftFoot:
      return BodyRegion::kLeftLeg;
    case kRightHip:
    case kRightKnee:
    case kRightAnkle:
    case kRightFoot:
      return BodyRegion::kRightLeg;
    case kLeftShoulder:
    case kLeftElbow:
    case kLeftWrist:
      return BodyRegion::kLeftArm;
    case kRightShoulder:
    case kRightElbow:
    case kRightWrist:
      return BodyRegion::kRightArm;
    case kHead:
      return BodyRegion::kHead;
    default:
      return BodyRegion::kTrunk;
  }
}

}  // namespace

std::vector<BodyRegion> jointRegions(const std::vector<int>& parents) {
  constexpr int kNumBodyJoints = 22;  // SMPL+H and SMPL-X go on differently from here
  if (static_cast<int>(parents.size()) < kNumBodyJoints)
    throw std::invalid_argument("body regions: a body of the SMPL family has 22 joints or more");
  std::vector<BodyRegion> regions(parents.size());
  for (std::size_t joint = 0; joint < parents.size(); ++joint) {
    regions[joint] = static_cast<int>(joint) < kNumBodyJoints
                         ? smplJointRegion(static_cast<int>(joint))
                         : regions[static_cast<std::size_t>(parents[joint])];
  }
  return regions;
}

RegionFaces facesByRegion(
    const Eigen::Matrix3Xi& faces,
    const Eigen::SparseMatrix<double, Eigen::RowMajor>& skinningWeights,
    const std::vector<BodyRegion>& regions) {
  using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  RegionFaces result;
  for (Eigen::Index face = 0; face < faces.cols(); ++face) {
    Eigen::Matrix<double, kNumBodyRegions, 1> shares;
    shares.setZero();
    for (int k = 0; k < 3; ++k) {
      for (Weights::InnerIterator weight(skinningWeights, faces(k, face)); weight; ++weight)
        shares[static_cast<int>(regions[static_cast<std::size_t>(weight.col())])] += weight.value();
    }
    Eigen::Index region = 0;
    shares.maxCoeff(&region);
    result[static_cast<std::size_t>(region)].push_back(static_cast<int>(face));
  }
  return result;
}

}  // namespace avatar
