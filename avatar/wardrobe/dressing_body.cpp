#include "avatar/wardrobe/dressing_body.h"

#include "avatar/geometry/closest_point.h"

#include <stdexcept>

namespace avatar {
namespace {

/// Straight down from the pelvis joint, which is inside the body, to the skin.
double crotchHeightOf(const DressingBody& body) {
  const Eigen::Vector3d pelvis = body.joints.col(kPelvis);
  const RayHit hit = TriangleBvh(body.mesh()).firstHit({pelvis, Eigen::Vector3d(0.0, -1.0, 0.0)});
  const double hipHeight = 0.5 * (body.joints(1, kLeftHip) + body.joints(1, kRightHip));
  const double kneeHeight = 0.5 * (body.joints(1, kLeftKnee) + body.joints(1, kRightKnee));
  const double crotch = pelvis.y() - hit.t;
  if (hit.face < 0 || !(kneeHeight < crotch && crotch < pelvis.y()) || !(kneeHeight < hipHeight))
    throw std::invalid_argument(
        "dressing: expected an upright body (Y up) with the pelvis joint inside and the crotch "
        "between hips and knees");
  return crotch;
}

}  // namespace

DressingBody standForDressing(
    const BodyModel& model, const Eigen::VectorXd& betas, const BodyPose& pose) {
  DressingBody body;
  body.model = &model;
  body.pose = pose;
  body.jointRegions = jointRegions(model.parents);
  SkinnedBody posed = posedBody(model, betas, pose);
  body.vertices = std::move(posed.vertices);
  body.joints = std::move(posed.joints);
  body.regionFaces = facesByRegion(model.faces, model.skinningWeights, body.jointRegions);
  body.crotchHeight = crotchHeightOf(body);
  return body;
}

double waistHeight(const DressingBody& body) {
  return body.joints(1, kSpine1);
}

}  // namespace avatar
