#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/measures.h"
#include "avatar/skeleton.h"
#include "tests/support/primitive_meshes.h"

#include <Eigen/Geometry>

#include <vector>

/// A person of 23 capsules along the bones of the default skeleton: simple, but posed and shaped
/// like any body model, and with a surface that a fit can hold on to.
namespace avatar::test {

namespace capsule {

constexpr int kSegments = 12;  // around the axis
constexpr int kRings = 13;     // along the axis: 4 of each cap, 5 of the side
constexpr int kFirstRing = 4;  // the ring around the bone's start
constexpr int kLastRing = 8;   // the ring around its end
constexpr int kVertices = kSegments * kRings + 2;

inline double radiusOfBone(int joint) {
  switch (joint) {
    case kSpine1:
    case kSpine2:
    case kSpine3:
      return 0.12;
    case kNeck:
    case kLeftHip:
    case kRightHip:
    case kLeftCollar:
    case kRightCollar:
      return 0.07;
    case kHead:
      return 0.09;
    case kLeftKnee:
    case kRightKnee:
      return 0.065;
    default:
      return 0.045;
  }
}

/// Points of a capsule from a to b, ring by ring, then the two poles.
inline Eigen::Matrix3Xd points(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
  const Eigen::Vector3d axis = (b - a).normalized();
  const Eigen::Vector3d u = axis.unitOrthogonal();
  const Eigen::Vector3d v = axis.cross(u);
  Eigen::Matrix3Xd result(3, kVertices);
  for (int ring = 0; ring < kRings; ++ring) {
    const bool startCap = ring < kFirstRing;
    const double latitude = startCap           ? (ring - kFirstRing) * kPi / 10
                            : ring > kLastRing ? (ring - kLastRing) * kPi / 10
                                               : 0.0;
    const double share = std::clamp((ring - kFirstRing) / double(kLastRing - kFirstRing), 0.0, 1.0);
    const Eigen::Vector3d centre = a + share * (b - a) + radius * std::sin(latitude) * axis;
    for (int s = 0; s < kSegments; ++s) {
      const double angle = 2.0 * kPi * s / kSegments;
      result.col(kSegments * ring + s) =
          centre + radius * std::cos(latitude) * (std::cos(angle) * u + std::sin(angle) * v);
    }
  }
  result.col(kVertices - 2) = a - radius * axis;
  result.col(kVertices - 1) = b + radius * axis;
  return result;
}

inline void appendFaces(int first, std::vector<Eigen::Vector3i>& faces) {
  for (int s = 0; s < kSegments; ++s) {
    const int next = (s + 1) % kSegments;
    for (int ring = 0; ring + 1 < kRings; ++ring) {
      const int low = first + kSegments * ring;
      const int high = low + kSegments;
      faces.push_back({low + s, low + next, high + next});
      faces.push_back({low + s, high + next, high + s});
    }
    const int top = first + kSegments * (kRings - 1);
    faces.push_back({first + next, first + s, first + kVertices - 2});
    faces.push_back({top + s, top + next, first + kVertices - 1});
  }
}

}  // namespace capsule

/// 24 SMPL joints; betas: stature, width across, girth (each about 3 cm per unit).
inline BodyModel capsuleFigure() {
  const JointPositions joints = defaultRestSkeleton().joints;
  BodyModel model;
  model.name = "capsule figure";
  model.parents.assign(kSmplParents.begin(), kSmplParents.end());
  model.poseDirections.resize(kNumSmplJoints - 1);
  const int numVertices = capsule::kVertices * (kNumSmplJoints - 1);
  model.templateVertices.resize(3, numVertices);
  std::vector<Eigen::Vector3i> faces;
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(numVertices, kNumSmplJoints);
  Eigen::MatrixXd regressor = Eigen::MatrixXd::Zero(kNumSmplJoints, numVertices);
  for (int joint = 1; joint < kNumSmplJoints; ++joint) {
    const int first = capsule::kVertices * (joint - 1);
    const int parent = kSmplParents[joint];
    model.templateVertices.middleCols(first, capsule::kVertices) =
        capsule::points(joints.col(parent), joints.col(joint), capsule::radiusOfBone(joint));
    weights.block(first, parent, capsule::kVertices, 1).setOnes();
    capsule::appendFaces(first, faces);
    const double share = 1.0 / capsule::kSegments;
    const int end = first + capsule::kSegments * capsule::kLastRing;
    regressor.row(joint).segment(end, capsule::kSegments).setConstant(share);
    const int start = first + capsule::kSegments * capsule::kFirstRing;
    if (joint == kSpine1)
      regressor.row(kPelvis).segment(start, capsule::kSegments).setConstant(share);
  }
  model.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f)
    model.faces.col(static_cast<Eigen::Index>(f)) = faces[f];
  model.skinningWeights = weights.sparseView();
  model.jointRegressor = regressor.sparseView();
  model.skinningWeights.makeCompressed();
  model.jointRegressor.makeCompressed();

  const Eigen::Matrix3Xd normals = vertexNormals({model.templateVertices, model.faces});
  model.shapeDirections = Eigen::MatrixXd::Zero(3 * numVertices, 3);
  for (Eigen::Index v = 0; v < numVertices; ++v) {
    model.shapeDirections(3 * v + 1, 0) = 0.04 * model.templateVertices(1, v);
    model.shapeDirections(3 * v, 1) = 0.04 * model.templateVertices(0, v);
    model.shapeDirections.block<3, 1>(3 * v, 2) = 0.01 * normals.col(v);
  }
  return model;
}

}  // namespace avatar::test
