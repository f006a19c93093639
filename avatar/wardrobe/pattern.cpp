#include "avatar/wardrobe/pattern.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace avatar {
namespace {

constexpr double kSliceStep = 0.005;      // between the sections of a tube [m]
constexpr double kWaistbandEase = 0.008;  // [m]: what holds a garment up sits close
constexpr double kShoulderEase = 0.4;     // share of the ease: fabric rests on the shoulders
constexpr double kBeyond = 0.05;          // tubes go on this far behind their openings [m]

/// Linear from `a` at `from` to `b` at `to`, constant beyond.
double ramp(double x, double from, double to, double a, double b) {
  return a + (b - a) * std::clamp((x - from) / (to - from), 0.0, 1.0);
}

RegionFaces garmentFaces(const Garment& garment, const DressingBody& body) {
  return facesByRegion(garment.mesh.faces, garment.skinningWeights, body.jointRegions);
}

/// Some regions of the body and of all garments below.
std::vector<MeshPart> partsOf(const PatternInput& input, const std::vector<BodyRegion>& regions) {
  std::vector<MeshPart> parts;
  const auto add = [&](const MeshView& mesh, const RegionFaces& faces) {
    for (const BodyRegion region : regions)
      parts.push_back({mesh, faces[static_cast<std::size_t>(region)]});
  };
  add(input.body.mesh(), input.body.regionFaces);
  for (const Garment& garment : input.inner)
    add(garment.mesh, garmentFaces(garment, input.body));
  return parts;
}

/// A vertical axis through a joint, pointing down: places along it are depths below the joint.
PlaneFrame downFrom(const Eigen::Vector3d& joint) {
  return planeThrough(joint, -Eigen::Vector3d::UnitY());
}

PlaneFrame fromTo(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return planeThrough(from, (to - from).normalized());
}

Region hemAt(double height) {
  return halfSpace(Eigen::Vector3d(0.0, height, 0.0), -Eigen::Vector3d::UnitY());
}

// ---- Tops ----

struct TopDesign {
  double sleeveEnd;   // share of the arm from shoulder to elbow (1) to wrist (2)
  double sleeveEase;  // share of the ease
  double hemAbove;    // hem above the crotch [share of pelvis-to-neck length]
  double drape;       // how straight the fabric hangs below the chest
};

MeshPart bodyPart(const DressingBody& body, BodyRegion region) {
  return {body.mesh(), body.regionFaces[static_cast<std::size_t>(region)]};
}

/// Where the neck widens into the shoulders.
struct NeckBase {
  Eigen::Vector3d centre;  ///< [m]
  double radius;           ///< of the neck where it is thinnest [m]
};

NeckBase neckBase(const DressingBody& body) {
  const Eigen::Vector3d neck = body.joints.col(kNeck);
  const Eigen::Vector3d head = body.joints.col(kHead);
  const double length = (head - neck).norm();
  const MeshPart trunk = bodyPart(body, BodyRegion::kTrunk);
  const AxisRange alongNeck{0.2 * length, 0.9 * length, kSliceStep};
  const ConvexTube neckTube =
      tubeAround({trunk, bodyPart(body, BodyRegion::kHead)}, fromTo(neck, head), alongNeck);
  double thinnest = alongNeck.first;
  for (int slice = 0; slice < alongNeck.count(); ++slice) {
    if (neckTube.meanRadius(alongNeck.at(slice)) < neckTube.meanRadius(thinnest))
      thinnest = alongNeck.at(slice);
  }
  const Eigen::Vector3d centre = neckTube.centre(thinnest);
  const double radius = neckTube.meanRadius(thinnest);
  constexpr double kWider = 1.4;  // the shoulders' slope has begun
  const AxisRange depths{0.0, 1.5 * length, kSliceStep};
  const ConvexTube shoulders = tubeAround({trunk}, downFrom(centre), depths);
  int slice = 0;
  while (slice + 1 < depths.count() && shoulders.meanRadius(depths.at(slice)) < kWider * radius)
    ++slice;
  return {centre - depths.at(slice) * Eigen::Vector3d::UnitY(), radius};
}

/// Round neckline: around the neck a little more than the neck's own width is left out, above the
/// neck's base, which is level at the back and comes down at the front.
Region neckOpening(const PatternInput& input) {
  const NeckBase base = neckBase(input.body);
  const Eigen::Vector3d centre = base.centre;
  const double radius = base.radius + 0.02 + kShoulderEase * input.ease;
  constexpr double kTilt = 35.0 * std::numbers::pi / 180.0;
  const Region aboveFront =
      halfSpace(centre, Eigen::Vector3d(0.0, std::cos(kTilt), std::sin(kTilt)));
  const Region aboveBack = halfSpace(centre, Eigen::Vector3d::UnitY());
  return [=](const Eigen::Vector3d& p) {
    const FieldSample front = aboveFront(p);
    const FieldSample back = aboveBack(p);
    const Eigen::Vector3d across(p.x() - centre.x(), 0.0, p.z() - centre.z());
    const double distance = std::max(across.norm(), 1e-6);
    // Above and around at once, with rounded corners between.
    return joined(
        {radius - distance, -across / distance},
        front.distance >= back.distance ? front : back,
        radius);
  };
}

BodyRegion armRegion(bool left) {
  return left ? BodyRegion::kLeftArm : BodyRegion::kRightArm;
}

/// A straight axis along the arm, from the shoulder joint.
PlaneFrame armFrame(const DressingBody& body, bool left) {
  return fromTo(
      body.joints.col(left ? kLeftShoulder : kRightShoulder),
      body.joints.col(left ? kLeftWrist : kRightWrist));
}

/// The faces of an arm part that reach behind the shoulder joint, where the sleeve's tube begins.
MeshPart shoulderCap(const MeshPart& arm, const PlaneFrame& frame) {
  const Eigen::Vector3d axis = frame.normal();
  MeshPart cap{arm.mesh, {}};
  for (const int face : arm.faces) {
    double first = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k)
      first =
          std::min(first, axis.dot(arm.mesh.vertices.col(arm.mesh.faces(k, face)) - frame.origin));
    if (first < 0.0)
      cap.faces.push_back(face);
  }
  return cap;
}

ConvexTube trunkTube(const PatternInput& input, double bottomHeight) {
  const DressingBody& body = input.body;
  const Eigen::Vector3d neck = body.joints.col(kNeck);
  const double above = 0.6 * (body.joints(1, kHead) - neck.y());
  std::vector<MeshPart> parts =
      partsOf(input, {BodyRegion::kTrunk, BodyRegion::kLeftLeg, BodyRegion::kRightLeg});
  for (const bool left : {true, false}) {
    for (const MeshPart& arm : partsOf(input, {armRegion(left)}))
      parts.push_back(shoulderCap(arm, armFrame(body, left)));
  }
  return tubeAround(parts, downFrom(neck), {-above, neck.y() - bottomHeight + kBeyond, kSliceStep});
}

/// Half way up the neck, within the neck's opening.
Region belowHead(const DressingBody& body) {
  const Eigen::Vector3d middle = 0.5 * (body.joints.col(kNeck) + body.joints.col(kHead));
  return halfSpace(middle, Eigen::Vector3d::UnitY());
}

GarmentPiece sleeve(const PatternInput& input, const TopDesign& design, bool left) {
  const DressingBody& body = input.body;
  const Eigen::Vector3d elbow = body.joints.col(left ? kLeftElbow : kRightElbow);
  const Eigen::Vector3d wrist = body.joints.col(left ? kLeftWrist : kRightWrist);
  const PlaneFrame frame = armFrame(body, left);
  const Eigen::Vector3d shoulder = frame.origin;
  const double upper = frame.normal().dot(elbow - shoulder);
  const double whole = frame.normal().dot(wrist - shoulder);
  const double end = design.sleeveEnd <= 1.0 ? design.sleeveEnd * upper
                                             : upper + (design.sleeveEnd - 1.0) * (whole - upper);
  ConvexTube tube =
      tubeAround(partsOf(input, {armRegion(left)}), frame, {0.0, end + kBeyond, kSliceStep});
  const double ease = input.ease;
  const double sleeveEase = design.sleeveEase * ease;
  tube.loosen([=](double place) {
    return ramp(place, 0.0, 0.6 * upper, kShoulderEase * ease, sleeveEase);
  });
  const Region start = halfSpace(shoulder - 0.1 * upper * frame.normal(), -frame.normal());
  const Region cuff = halfSpace(shoulder + end * frame.normal(), frame.normal());
  return {tube, {start}, {cuff}};
}

GarmentShape topPattern(const PatternInput& input, const TopDesign& design) {
  const DressingBody& body = input.body;
  const Eigen::Vector3d neck = body.joints.col(kNeck);
  const double trunkLength = neck.y() - body.joints(1, kPelvis);
  const double hem = body.crotchHeight + design.hemAbove * trunkLength;
  const double chest = neck.y() - body.joints(1, kSpine3);
  GarmentPiece trunk{trunkTube(input, hem), {belowHead(body)}, {neckOpening(input), hemAt(hem)}};
  const double ease = input.ease;
  trunk.tube.drape(chest, neck.y() - hem, design.drape);
  trunk.tube.loosen(
      [=](double depth) { return ramp(depth, 0.0, chest, kShoulderEase * ease, ease); });
  return {{trunk, sleeve(input, design, true), sleeve(input, design, false)}};
}

// ---- Bottoms ----

Region waistOpening(const DressingBody& body) {
  return halfSpace(Eigen::Vector3d(0.0, waistHeight(body), 0.0), Eigen::Vector3d::UnitY());
}

/// Hips and, as far down as `bottomHeight`, both legs together; places are depths below the waist.
ConvexTube hipTube(const PatternInput& input, double bottomHeight) {
  const DressingBody& body = input.body;
  const double waist = waistHeight(body);
  const Eigen::Vector3d top(body.joints(0, kPelvis), waist, body.joints(2, kPelvis));
  return tubeAround(
      partsOf(input, {BodyRegion::kTrunk, BodyRegion::kLeftLeg, BodyRegion::kRightLeg}),
      downFrom(top),
      {-kBeyond, waist - bottomHeight + kBeyond, kSliceStep});
}

struct TrouserDesign {
  double legEnd;    // share of the leg from hip to knee (1) to ankle (2)
  double cuffEase;  // ease at the cuff [share of the ease]
};

GarmentPiece trouserLeg(const PatternInput& input, const TrouserDesign& design, bool left) {
  const DressingBody& body = input.body;
  const Eigen::Vector3d hip = body.joints.col(left ? kLeftHip : kRightHip);
  const Eigen::Vector3d knee = body.joints.col(left ? kLeftKnee : kRightKnee);
  const Eigen::Vector3d ankle = body.joints.col(left ? kLeftAnkle : kRightAnkle);
  const PlaneFrame frame = fromTo(hip, ankle);
  const Eigen::Vector3d axis = frame.normal();
  const double thigh = axis.dot(knee - hip);
  const double whole = axis.dot(ankle - hip);
  const double end = design.legEnd <= 1.0 ? design.legEnd * thigh
                                          : thigh + (design.legEnd - 1.0) * (whole - thigh);
  ConvexTube tube = tubeAround(
      partsOf(input, {left ? BodyRegion::kLeftLeg : BodyRegion::kRightLeg}),
      frame,
      {0.0, end + kBeyond, kSliceStep});
  tube.drape(0.0, end, 0.6);
  const double ease = input.ease;
  const double cuffEase = design.cuffEase * ease;
  tube.loosen([=](double place) { return ramp(place, 0.0, end, ease, cuffEase); });
  return {tube, {halfSpace(hip, -axis)}, {halfSpace(hip + end * axis, axis)}};
}

/// The crotch seam: lowest between the legs, rising to the front and to the back in a parabola
/// that stays clear of the trunk.
Region crotchSeam(const PatternInput& input) {
  const DressingBody& body = input.body;
  const double room = std::max(0.008, 0.4 * input.ease);
  const double bottom = body.crotchHeight - 1.5 * room;
  const double centre = 0.5 * (body.joints(2, kLeftHip) + body.joints(2, kRightHip));
  double curvature = 7.0;  // [1/m], at most: 7 cm higher at 10 cm before and behind
  for (const int face : body.regionFaces[static_cast<std::size_t>(BodyRegion::kTrunk)]) {
    for (const int corner : body.model->faces.col(face)) {
      const double ahead = std::abs(body.vertices(2, corner) - centre) + room;
      const double above = body.vertices(1, corner) - room - bottom;
      curvature = std::min(curvature, std::max(0.0, above) / (ahead * ahead));
    }
  }
  return [=](const Eigen::Vector3d& p) {
    const double ahead = p.z() - centre;
    const Eigen::Vector3d gradient(0.0, -1.0, 2.0 * curvature * ahead);
    const double below = bottom + curvature * ahead * ahead - p.y();
    return FieldSample{below / gradient.norm(), gradient.normalized()};
  };
}

GarmentShape trouserPattern(const PatternInput& input, const TrouserDesign& design) {
  const DressingBody& body = input.body;
  const double waist = waistHeight(body);
  const double depth = waist - body.crotchHeight;
  GarmentPiece hips{hipTube(input, body.crotchHeight), {crotchSeam(input)}, {waistOpening(body)}};
  const double ease = input.ease;
  hips.tube.drape(0.0, depth, 0.5);
  hips.tube.loosen(
      [=](double place) { return ramp(place, 0.0, 0.5 * depth, kWaistbandEase, ease); });
  return {{hips, trouserLeg(input, design, true), trouserLeg(input, design, false)}, 0.03};
}

// ---- Skirts ----

constexpr double kFlare = 0.28;  // [m of radius per m of length]

double kneeHeight(const DressingBody& body) {
  return 0.5 * (body.joints(1, kLeftKnee) + body.joints(1, kRightKnee));
}

}  // namespace

GarmentShape tshirtPattern(const PatternInput& input) {
  return topPattern(input, {.sleeveEnd = 0.65, .sleeveEase = 0.8, .hemAbove = 0.06, .drape = 0.7});
}

GarmentShape shirtPattern(const PatternInput& input) {
  return topPattern(input, {.sleeveEnd = 1.95, .sleeveEase = 0.6, .hemAbove = -0.04, .drape = 0.9});
}

GarmentShape trousersPattern(const PatternInput& input) {
  return trouserPattern(input, {.legEnd = 1.97, .cuffEase = 1.2});
}

GarmentShape shortsPattern(const PatternInput& input) {
  return trouserPattern(input, {.legEnd = 0.8, .cuffEase = 1.3});
}

GarmentShape skirtPattern(const PatternInput& input) {
  const DressingBody& body = input.body;
  const double hem = kneeHeight(body);
  const double depth = waistHeight(body) - body.crotchHeight;
  GarmentPiece skirt{hipTube(input, hem), {}, {waistOpening(body), hemAt(hem)}};
  const double ease = input.ease;
  skirt.tube.loosen([=](double place) { return ramp(place, 0.0, depth, kWaistbandEase, ease); });
  skirt.tube.flare(0.0, kFlare);
  skirt.tube.drape(0.0, waistHeight(body) - hem, 1.0);
  return {{skirt}};
}

GarmentShape dressPattern(const PatternInput& input) {
  const DressingBody& body = input.body;
  const Eigen::Vector3d neck = body.joints.col(kNeck);
  const double hem = kneeHeight(body);
  const double waist = neck.y() - body.joints(1, kSpine1);
  const double chest = neck.y() - body.joints(1, kSpine3);
  const TopDesign design{.sleeveEnd = 0.5, .sleeveEase = 1.0, .hemAbove = 0.0, .drape = 0.0};
  GarmentPiece trunk{trunkTube(input, hem), {belowHead(body)}, {neckOpening(input), hemAt(hem)}};
  const double ease = input.ease;
  trunk.tube.loosen(
      [=](double depth) { return ramp(depth, 0.0, chest, kShoulderEase * ease, ease); });
  trunk.tube.flare(waist, kFlare);
  trunk.tube.drape(waist, neck.y() - hem, 1.0);
  return {{trunk, sleeve(input, design, true), sleeve(input, design, false)}};
}

}  // namespace avatar
