#include "avatar/digitization/body_parts.h"

#include "avatar/geometry/measures.h"
#include "avatar/geometry/rasterizer.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

namespace avatar {
namespace {

constexpr double kNearSkin = 0.08;  // tight clothes and errors of tracking [m]

int carryingJoint(const BodyModel& model, int vertex) {
  int joint = 0;
  double most = -1.0;
  using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  for (Weights::InnerIterator it(model.skinningWeights, vertex); it; ++it) {
    if (it.value() > most) {
      most = it.value();
      joint = static_cast<int>(it.col());
    }
  }
  return joint;
}

/// 0 at the joint, 1 at its child.
double alongBone(const ShapedBody& shaped, int joint, int child, const Eigen::Vector3d& point) {
  const Eigen::Vector3d start = shaped.joints.col(joint);
  const Eigen::Vector3d bone = shaped.joints.col(child) - start;
  return bone.dot(point - start) / bone.squaredNorm();
}

BodyPart partOf(
    const ShapedBody& shaped, int joint, const Eigen::Vector3d& point, const Eigen::Vector3d& out) {
  switch (joint) {
    case kHead:
      // At rest the body faces +Z. Below the height of the eyes there is no hair in front.
      return out.z() > 0.4 && point.y() < shaped.joints(1, kHead) + 0.11 ? BodyPart::kFace
                                                                         : BodyPart::kHead;
    case kNeck:
      return BodyPart::kNeck;
    case kSpine2:
    case kSpine3:
    case kLeftCollar:
    case kRightCollar:
      return BodyPart::kChest;
    case kSpine1:
      return BodyPart::kWaist;
    case kPelvis:
      return BodyPart::kHip;
    case kLeftHip:
    case kRightHip:
      return alongBone(shaped, joint, joint + 3, point) < 0.5 ? BodyPart::kThigh
                                                              : BodyPart::kLowerThigh;
    case kLeftKnee:
    case kRightKnee:
      return BodyPart::kShank;
    case kLeftAnkle:
    case kRightAnkle:
    case kLeftFoot:
    case kRightFoot:
      return BodyPart::kFoot;
    case kLeftShoulder:
    case kRightShoulder:
      return alongBone(shaped, joint, joint + 2, point) < 0.5 ? BodyPart::kUpperArm
                                                              : BodyPart::kLowerUpperArm;
    case kLeftElbow:
    case kRightElbow:
      return BodyPart::kForearm;
    default:  // wrists, hands and the fingers of larger models
      return BodyPart::kHand;
  }
}

/// Every pixel takes the value of the nearest pixel that has one.
void spreadParts(std::vector<BodyPart>& parts, int width, int height) {
  cv::Mat empty(height, width, CV_8U);
  for (int i = 0; i < width * height; ++i)
    empty.data[i] = parts[static_cast<std::size_t>(i)] == BodyPart::kNone ? 255 : 0;
  if (cv::countNonZero(empty) == width * height)
    return;
  cv::Mat distance, nearest;
  cv::distanceTransform(empty, distance, nearest, cv::DIST_L2, 5, cv::DIST_LABEL_PIXEL);
  std::vector<BodyPart> partOfLabel(static_cast<std::size_t>(width * height) + 1, BodyPart::kNone);
  const auto labelAt = [&](int i) {
    return static_cast<std::size_t>(nearest.at<int>(i / width, i % width));
  };
  for (int i = 0; i < width * height; ++i) {
    if (parts[static_cast<std::size_t>(i)] != BodyPart::kNone)
      partOfLabel[labelAt(i)] = parts[static_cast<std::size_t>(i)];
  }
  for (int i = 0; i < width * height; ++i)
    parts[static_cast<std::size_t>(i)] = partOfLabel[labelAt(i)];
}

/// Do all pixels this far away show the same part?
bool isInside(const std::vector<BodyPart>& parts, int x, int y, int width, int height) {
  constexpr int kMargin = 2;  // [px]
  if (x < kMargin || y < kMargin || x + kMargin >= width || y + kMargin >= height)
    return false;
  const auto at = [&](int px, int py) {
    return parts
        [static_cast<std::size_t>(py) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(px)];
  };
  const BodyPart part = at(x, y);
  return at(x - kMargin, y) == part && at(x + kMargin, y) == part && at(x, y - kMargin) == part &&
         at(x, y + kMargin) == part;
}

}  // namespace

std::array<double, kNumSurfaceLabels> labelPrior(BodyPart part) {
  switch (part) {
    case BodyPart::kFace:
    case BodyPart::kHead:
      return {0.97, 0.02, 0.01};
    case BodyPart::kNeck:
      return {0.60, 0.39, 0.01};
    case BodyPart::kChest:
      return {0.06, 0.93, 0.01};
    case BodyPart::kWaist:
      return {0.03, 0.67, 0.30};
    case BodyPart::kHip:
      return {0.02, 0.45, 0.53};
    case BodyPart::kUpperArm:
      return {0.20, 0.79, 0.01};
    case BodyPart::kLowerUpperArm:
      return {0.50, 0.48, 0.02};
    case BodyPart::kForearm:
      return {0.57, 0.40, 0.03};
    case BodyPart::kHand:
      return {0.95, 0.03, 0.02};
    case BodyPart::kThigh:
      return {0.08, 0.17, 0.75};
    case BodyPart::kLowerThigh:
      return {0.30, 0.07, 0.63};
    case BodyPart::kShank:
      return {0.45, 0.03, 0.52};
    case BodyPart::kFoot:
      return {0.97, 0.01, 0.02};
    default:
      return {0.34, 0.33, 0.33};
  }
}

SurfaceLabel seedLabel(BodyPart part) {
  switch (part) {
    case BodyPart::kFace:
    case BodyPart::kHand:
      return kSkinLabel;
    case BodyPart::kChest:
      return kUpperLabel;
    case BodyPart::kThigh:
      return kLowerLabel;
    default:
      return kNoLabel;
  }
}

std::vector<BodyPart> bodyParts(const BodyModel& model, const ShapedBody& shaped) {
  const Eigen::Matrix3Xd normals = vertexNormals({shaped.vertices, model.faces});
  std::vector<BodyPart> parts;
  parts.reserve(static_cast<std::size_t>(model.numVertices()));
  for (int v = 0; v < model.numVertices(); ++v)
    parts.push_back(
        partOf(shaped, carryingJoint(model, v), shaped.vertices.col(v), normals.col(v)));
  return parts;
}

PartImage partImage(
    const PosedDepthFrame& frame,
    const Skinning& skinning,
    const ShapedBody& shaped,
    const std::vector<BodyPart>& parts) {
  const Eigen::Matrix3Xi& faces = skinning.model().faces;
  const Eigen::Matrix3Xd vertices = skinning.pose(shaped, frame.pose).vertices;
  const RasterImage body = rasterize({vertices, faces}, frame.camera, {.barycentrics = false});
  PartImage image;
  image.parts.assign(body.depth.size(), BodyPart::kNone);
  for (std::size_t i = 0; i < body.depth.size(); ++i) {
    if (body.triangle[i] >= 0)
      image.parts[i] = parts[static_cast<std::size_t>(faces(0, body.triangle[i]))];
  }
  image.sure.assign(body.depth.size(), 0);
  for (std::size_t i = 0; i < body.depth.size(); ++i) {
    const int x = static_cast<int>(i) % body.width;
    const int y = static_cast<int>(i) / body.width;
    const bool near = frame.depth[i] > 0.0F && body.depth[i] > 0.0F &&
                      std::abs(frame.depth[i] - body.depth[i]) < static_cast<float>(kNearSkin);
    image.sure[i] = near && isInside(image.parts, x, y, body.width, body.height) ? 1 : 0;
  }
  spreadParts(image.parts, body.width, body.height);
  return image;
}

}  // namespace avatar
