#include "avatar/anthropometry.h"

#include "avatar/body_pose.h"
#include "avatar/geometry/adjacency.h"
#include "avatar/geometry/measures.h"
#include "avatar/geometry/plane_section.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace avatar {
namespace {

constexpr int kUsedJoints = kRightWrist + 1;
constexpr double kShortestBone = 0.01;  // of the stature; below it a bone has no usable direction

// Levels of the trunk between the hip joints (0) and the shoulder joints (1), which lie at 0.530
// and 0.818 of the stature (Drillis & Contini 1966).
constexpr double kHipCrestLevel = 0.2;  // iliac crest, 0.59 of the stature
constexpr double kNavelLevel = 0.25;    // 0.60 of the stature
constexpr double kLowRibLevel = 0.55;   // under the bust, 0.69 of the stature
constexpr double kNippleLevel = 0.66;   // 0.72 of the stature; the armpits are above it

struct Range {
  double from = 0.0;
  double to = 0.0;
};

void requireMeasurable(bool condition, const std::string& problem) {
  if (!condition) {
    throw std::invalid_argument("body measures: " + problem);
  }
}

void requireClosed(const MeshView& mesh, const Adjacency& adjacency) {
  const Topology shape = topology(mesh.faces, adjacency);
  requireMeasurable(shape.closed && mesh.numFaces() > 0, "the mesh must be closed");
  requireMeasurable(shape.edgeManifold, "no edge of the mesh may have more than two faces");
  requireMeasurable(shape.oriented, "the faces of the mesh must be wound alike");
  requireMeasurable(signedVolume(mesh) > 0.0, "the mesh is inside out");
}

void requireTPose(const Eigen::Matrix3Xd& joints, double stature) {
  constexpr double kCos45 = 0.7071;
  for (int joint = 1; joint < kUsedJoints; ++joint) {
    const int parent = kSmplParents.at(joint);
    const Eigen::Vector3d bone = joints.col(joint) - joints.col(parent);
    requireMeasurable(
        bone.norm() > kShortestBone * stature,
        std::string(kSmplJointNames.at(joint)) + " and its parent joint are too close");
  }
  for (const int joint : {kLeftElbow, kRightElbow, kLeftWrist, kRightWrist}) {
    const Eigen::Vector3d bone = joints.col(joint) - joints.col(kSmplParents.at(joint));
    const double outward = joint == kLeftElbow || joint == kLeftWrist ? bone.x() : -bone.x();
    requireMeasurable(
        outward > kCos45 * bone.norm(), "the arms must be stretched out sideways (T-pose)");
  }
  for (const int joint : {kLeftKnee, kRightKnee, kLeftAnkle, kRightAnkle}) {
    const Eigen::Vector3d bone = joints.col(joint) - joints.col(kSmplParents.at(joint));
    requireMeasurable(
        -bone.y() > kCos45 * bone.norm(), "the legs must be stretched downwards (T-pose)");
  }
  requireMeasurable(
      joints(0, kLeftHip) > joints(0, kRightHip) &&
          joints(0, kLeftShoulder) > joints(0, kRightShoulder),
      "left joints must be at greater x than right ones");
  const double shoulders = 0.5 * (joints(1, kLeftShoulder) + joints(1, kRightShoulder));
  const double hips = 0.5 * (joints(1, kLeftHip) + joints(1, kRightHip));
  requireMeasurable(
      shoulders - hips > kShortestBone * stature && joints(1, kNeck) > joints(1, kPelvis) &&
          joints(1, kHead) > joints(1, kNeck),
      "shoulders, neck and head must be above the hips");
}

double distanceTo(const PlaneLoop& loop, const Eigen::Vector2d& point) {
  return (loop.colwise() - point).colwise().norm().minCoeff();
}

double tapeLength(const PlaneLoop& loop) {
  return perimeter(convexHull(loop));
}

/// u = z, v = x, so that the normal is y.
PlaneFrame levelPlane(double y) {
  PlaneFrame plane;
  plane.origin << 0.0, y, 0.0;
  plane.axes << 0, 1, 0, 0, 1, 0;
  return plane;
}

/// u = z, v = −y: seen from the body's left.
PlaneFrame sagittalPlane(double x) {
  PlaneFrame plane;
  plane.origin << x, 0.0, 0.0;
  plane.axes << 0, 0, 0, -1, 1, 0;
  return plane;
}

double average(const auto& measureSide) {
  return 0.5 * (measureSide(true) + measureSide(false));
}

/// Calls visit(value) on evenly spaced values from one end of the range to the other.
void scan(const Range& range, const auto& visit) {
  constexpr int kSteps = 48;  // about 5 mm over an adult's trunk
  for (int i = 0; i <= kSteps; ++i) {
    visit(range.from + (range.to - range.from) * i / kSteps);
  }
}

struct Neck {
  double girth = std::numeric_limits<double>::infinity();
  double height = 0.0;  // y where the bone meets the plane of the girth
};

class Tailor {
 public:
  Tailor(const MeshView& mesh, const Adjacency& adjacency, const Eigen::Matrix3Xd& joints)
      : mesh_(mesh),
        adjacency_(adjacency),
        joints_(joints),
        sole_(mesh.vertices.row(1).minCoeff()),
        top_(mesh.vertices.row(1).maxCoeff()),
        crotch_(findCrotch()) {}

  BodyMeasures measure() const {
    BodyMeasures m;
    m.stature = top_ - sole_;
    const Neck neck = narrowestNeck();
    m.neckGirth = neck.girth;
    m.headHeight = top_ - chinHeight(neck.height);
    m.chestGirth = chestGirth();
    m.waistGirth = smallestGirth({trunkLevel(kHipCrestLevel), trunkLevel(kLowRibLevel)});
    m.abdomenGirth = tapeLength(trunkSection(trunkLevel(kNavelLevel)));
    m.hipGirth = hipGirth();
    m.thighGirth = average([&](bool left) { return thighGirth(left); });
    m.calfGirth = average([&](bool left) { return calfGirth(left); });
    m.upperArmGirth = average([&](bool left) { return upperArmGirth(left); });
    m.shoulderBreadth = (joint(kLeftShoulder) - joint(kRightShoulder)).norm();
    m.armLength = average([&](bool left) { return armLength(left); });
    m.handLength = average([&](bool left) { return handLength(left); });
    m.legLength = 0.5 * (joints_(1, kLeftHip) + joints_(1, kRightHip)) - sole_;
    m.crotchHeight = crotch_ - sole_;
    m.footLength = average([&](bool left) { return footLength(left); });
    m.volume = signedVolume(mesh_);
    m.mass = kBodyDensity * m.volume;
    m.bmi = m.mass / (m.stature * m.stature);
    return m;
  }

 private:
  Eigen::Vector3d joint(int index) const { return joints_.col(index); }

  /// The point of a bone, or of its prolongation, at a height.
  Eigen::Vector3d boneAt(int upper, int lower, double y) const {
    const Eigen::Vector3d bone = joint(upper) - joint(lower);
    return joint(lower) + (y - joints_(1, lower)) / bone.y() * bone;
  }

  double trunkLevel(double fraction) const {
    const double hips = 0.5 * (joints_(1, kLeftHip) + joints_(1, kRightHip));
    const double shoulders = 0.5 * (joints_(1, kLeftShoulder) + joints_(1, kRightShoulder));
    return hips + fraction * (shoulders - hips);
  }

  /// The largest loop around the point: the skin, not the hollow of a mouth; the limb, not one that
  /// the same plane cuts elsewhere. When the point lies outside (a bone under the skin's dent), the
  /// nearest loop.
  PlaneLoop loopAround(const PlaneFrame& plane, const Eigen::Vector3d& point) const {
    const std::vector<PlaneLoop> loops = planeSection(mesh_, adjacency_, plane);
    requireMeasurable(!loops.empty(), "the joints lie off the mesh");
    const Eigen::Vector2d p = plane.project(point);
    const PlaneLoop* best = nullptr;
    for (const PlaneLoop& loop : loops) {
      if (encloses(loop, p) && (!best || signedArea(loop) > signedArea(*best))) {
        best = &loop;
      }
    }
    if (best) {
      return *best;
    }
    return *std::min_element(loops.begin(), loops.end(), [&](const auto& a, const auto& b) {
      return distanceTo(a, p) < distanceTo(b, p);
    });
  }

  PlaneLoop trunkSection(double y) const {
    return loopAround(levelPlane(y), boneAt(kNeck, kPelvis, y));
  }

  /// The lowest point of the trunk between the legs.
  double findCrotch() const {
    const PlaneFrame plane = sagittalPlane(joints_(0, kPelvis));
    return -loopAround(plane, joint(kPelvis)).row(1).maxCoeff();
  }

  double smallestGirth(const Range& heights) const {
    double girth = std::numeric_limits<double>::infinity();
    scan(heights, [&](double y) { girth = std::min(girth, tapeLength(trunkSection(y))); });
    return girth;
  }

  Neck narrowestNeck() const {
    const Eigen::Vector3d bone = joint(kHead) - joint(kNeck);
    Neck neck;
    // The neck joint is inside the neck or at its root, the head joint between chin and ears.
    scan({-0.3, 0.7}, [&](double t) {
      const Eigen::Vector3d point = joint(kNeck) + t * bone;
      const double girth = tapeLength(loopAround(planeThrough(point, bone.normalized()), point));
      if (girth < neck.girth) {
        neck = {girth, point.y()};
      }
    });
    return neck;
  }

  /// The point of the profile farthest forward and down: chin and throat make an angle there. At
  /// 39° below the horizontal neither the nose nor the root of the neck is farther.
  double chinHeight(double neckHeight) const {
    constexpr double kDownPerForward = 0.8;
    const Eigen::Vector3d inHead = boneAt(kHead, kNeck, 0.5 * (top_ + joints_(1, kHead)));
    const PlaneLoop profile = loopAround(sagittalPlane(joints_(0, kHead)), inHead);
    double farthest = -std::numeric_limits<double>::infinity();
    double chin = neckHeight;
    for (const auto& point : profile.colwise()) {
      const double height = -point.y();
      const double reach = point.x() - kDownPerForward * height;
      if (height >= neckHeight && reach > farthest) {
        farthest = reach;
        chin = height;
      }
    }
    return chin;
  }

  double halfWidth(const PlaneLoop& loop) const {
    return 0.5 * (loop.row(1).maxCoeff() - loop.row(1).minCoeff());
  }

  /// Fullest level up to the armpits, which are where, above the nipples, the trunk's sides lean
  /// out into the arms by more than 1 in 2 (a chest widens upwards by about 1 in 4).
  double chestGirth() const {
    constexpr double kArmpitLean = 0.5;
    constexpr std::size_t kWindow = 4;  // levels: widths are compared over 2 cm, a mesh edge
    std::vector<double> heights;
    std::vector<double> widths;
    double girth = 0.0;
    bool belowArmpits = true;
    scan({trunkLevel(kLowRibLevel), trunkLevel(1.0)}, [&](double y) {
      const PlaneLoop loop = trunkSection(y);
      heights.push_back(y);
      widths.push_back(halfWidth(loop));
      if (y > trunkLevel(kNippleLevel)) {
        const std::size_t below = heights.size() - 1 - std::min(kWindow, heights.size() - 1);
        const double widening = widths.back() - widths[below];
        belowArmpits = belowArmpits && widening <= kArmpitLean * (y - heights[below]);
      }
      if (belowArmpits) {
        girth = std::max(girth, tapeLength(loop));
      }
    });
    return girth;
  }

  double hipGirth() const {
    double girth = 0.0;
    scan({crotch_, trunkLevel(kHipCrestLevel)}, [&](double y) {
      girth = std::max(girth, tapeLength(trunkSection(y)));
    });
    return girth;
  }

  double largestLegGirth(int upper, int lower, const Range& heights) const {
    double girth = 0.0;
    scan(heights, [&](double y) {
      const Eigen::Vector3d point = boneAt(upper, lower, y);
      girth = std::max(girth, tapeLength(loopAround(levelPlane(y), point)));
    });
    return girth;
  }

  double thighGirth(bool left) const {
    constexpr double kBelowCrotch = 0.015;  // of the stature: under the web between the legs
    const int hip = left ? kLeftHip : kRightHip;
    const int knee = left ? kLeftKnee : kRightKnee;
    const double from = crotch_ - kBelowCrotch * (top_ - sole_);
    return largestLegGirth(hip, knee, {from, 0.5 * (crotch_ + joints_(1, knee))});
  }

  double calfGirth(bool left) const {
    const int knee = left ? kLeftKnee : kRightKnee;
    const int ankle = left ? kLeftAnkle : kRightAnkle;
    const double shank = joints_(1, knee) - joints_(1, ankle);
    // Below the knee's own bulge, above the ankle's.
    const Range heights = {joints_(1, knee) - 0.1 * shank, joints_(1, ankle) + 0.2 * shank};
    return largestLegGirth(knee, ankle, heights);
  }

  double upperArmGirth(bool left) const {
    const Eigen::Vector3d shoulder = joint(left ? kLeftShoulder : kRightShoulder);
    const Eigen::Vector3d elbow = joint(left ? kLeftElbow : kRightElbow);
    const Eigen::Vector3d middle = 0.5 * (shoulder + elbow);
    return tapeLength(loopAround(planeThrough(middle, (elbow - shoulder).normalized()), middle));
  }

  double armLength(bool left) const {
    const Eigen::Vector3d elbow = joint(left ? kLeftElbow : kRightElbow);
    return (elbow - joint(left ? kLeftShoulder : kRightShoulder)).norm() +
           (joint(left ? kLeftWrist : kRightWrist) - elbow).norm();
  }

  /// In T-pose nothing lies farther out along the forearm than the fingertips.
  double handLength(bool left) const {
    const Eigen::Vector3d wrist = joint(left ? kLeftWrist : kRightWrist);
    const Eigen::Vector3d forearm = wrist - joint(left ? kLeftElbow : kRightElbow);
    const double reach = (forearm.normalized().transpose() * mesh_.vertices).maxCoeff();
    const double length = reach - forearm.normalized().dot(wrist);
    requireMeasurable(length > 0.0, "the hands end before the wrist joints");
    return length;
  }

  /// Extent of what is below the ankle and nearer to it than to the other one, along the horizontal
  /// direction from the ankle to the ball of the foot.
  double footLength(bool left) const {
    const Eigen::Vector3d ankle = joint(left ? kLeftAnkle : kRightAnkle);
    const Eigen::Vector3d other = joint(left ? kRightAnkle : kLeftAnkle);
    Eigen::Vector3d direction = joint(left ? kLeftFoot : kRightFoot) - ankle;
    direction.y() = 0.0;
    requireMeasurable(
        direction.norm() > kShortestBone * (top_ - sole_), "the feet must point forward");
    direction.normalize();
    Range extent = {
        std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (const auto& vertex : mesh_.vertices.colwise()) {
      if (vertex.y() < ankle.y() && (vertex - ankle).norm() < (vertex - other).norm()) {
        extent.from = std::min(extent.from, direction.dot(vertex));
        extent.to = std::max(extent.to, direction.dot(vertex));
      }
    }
    requireMeasurable(extent.to > extent.from, "there are no feet below the ankle joints");
    return extent.to - extent.from;
  }

  const MeshView& mesh_;
  const Adjacency& adjacency_;
  const Eigen::Matrix3Xd& joints_;
  double sole_;    // y of the lowest vertex
  double top_;     // y of the highest vertex
  double crotch_;  // y
};

}  // namespace

BodyMeasures measureBody(const MeshView& mesh, const Eigen::Matrix3Xd& joints) {
  requireValid(mesh, "body measures");
  requireMeasurable(joints.cols() >= kUsedJoints, "at least 22 joints are needed");
  requireMeasurable(joints.allFinite(), "every joint must be finite");
  const Adjacency adjacency = buildAdjacency(mesh.faces, mesh.numVertices());
  requireClosed(mesh, adjacency);
  requireTPose(joints, boundingBox(mesh).sizes().y());
  return Tailor(mesh, adjacency, joints).measure();
}

std::vector<MeasureRow> measureRows(const BodyMeasures& m) {
  return {
      {"stature", m.stature, "m"},
      {"head height", m.headHeight, "m"},
      {"neck girth", m.neckGirth, "m"},
      {"chest girth", m.chestGirth, "m"},
      {"waist girth", m.waistGirth, "m"},
      {"abdomen girth", m.abdomenGirth, "m"},
      {"hip girth", m.hipGirth, "m"},
      {"thigh girth", m.thighGirth, "m"},
      {"calf girth", m.calfGirth, "m"},
      {"upper arm girth", m.upperArmGirth, "m"},
      {"shoulder breadth", m.shoulderBreadth, "m"},
      {"arm length", m.armLength, "m"},
      {"hand length", m.handLength, "m"},
      {"leg length", m.legLength, "m"},
      {"crotch height", m.crotchHeight, "m"},
      {"foot length", m.footLength, "m"},
      {"volume", m.volume, "m^3"},
      {"mass", m.mass, "kg"},
      {"body mass index", m.bmi, "kg/m^2"}};
}

}  // namespace avatar
