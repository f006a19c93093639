#pragma once

#include "avatar/body_pose.h"
#include "avatar/garment.h"
#include "avatar/geometry/mesh.h"

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include <string>
#include <vector>

namespace avatar {

/// A ball swept along a line, moving with a joint: the body for engines without mesh collision.
struct BodyCapsule {
  int joint = 0;
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< in the joint's own frame [m]: origin at the
  Eigen::Vector3d end = Eigen::Vector3d::Zero();    ///< joint, axes of the rest pose
  double radius = 0.0;                              ///< [m], > 0
};

/// The person under the clothes, one shape, as every glTF viewer understands it: linear blend
/// skinning without pose blend shapes. `model` and `betas` lead back to the full body model.
struct AvatarBody {
  std::string model = "default";  ///< "default" or the body model's file name
  Eigen::VectorXd betas;
  TriangleMesh mesh;         ///< T-pose, template frame, personal details included
  Eigen::Matrix3Xd joints;   ///< at rest, 3 × J [m]
  std::vector<int> parents;  ///< J entries; parents[0] = −1, parents[j] < j
  /// V × J, at most four per row, rows sum to 1.
  Eigen::SparseMatrix<double, Eigen::RowMajor> skinningWeights;
  std::vector<BodyCapsule> capsules;
  Eigen::Vector3d color = {0.95, 0.80, 0.71};  ///< display values in [0, 1]
  Eigen::Matrix3Xd vertexColors;  ///< 3 × V display values, replaces `color`; or empty
};

/// A dressed person: the body and, apart from it, what it wears.
struct LayeredAvatar {
  AvatarBody body;
  std::vector<Garment> garments;  ///< inner layers first
};

}  // namespace avatar
