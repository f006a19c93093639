#pragma once

#include "avatar/body_model.h"
#include "avatar/garment.h"
#include "avatar/skinning.h"
#include "avatar/wardrobe/body_regions.h"

#include <Eigen/Core>

#include <vector>

namespace avatar {

/// A body of one shape standing in a pose that garments are made in, with what patterns refer to.
struct DressingBody {
  const BodyModel* model = nullptr;  ///< must outlive this
  BodyPose pose;                     ///< upright
  Eigen::Matrix3Xd vertices;         ///< posed, 3 × V [m]
  Eigen::Matrix3Xd joints;           ///< posed, 3 × J [m]
  std::vector<BodyRegion> jointRegions;
  RegionFaces regionFaces;
  double crotchHeight = 0.0;  ///< y of the lowest point of the trunk between the legs [m]

  MeshView mesh() const { return {vertices, model->faces}; }
};

/// Throws std::invalid_argument when the model isn't of the SMPL family or doesn't stand upright.
DressingBody standForDressing(
    const BodyModel& model, const Eigen::VectorXd& betas, const BodyPose& pose = aPose());

/// Where waistbands sit [m]: at the lowest spine joint, about the crests of the hip bones.
double waistHeight(const DressingBody& body);

}  // namespace avatar
