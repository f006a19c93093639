#include "avatar/wardrobe/outfit.h"

#include "avatar/avatar_body.h"
#include "avatar/avatar_pose.h"
#include "avatar/garment_pose_fit.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/geometry/measures.h"
#include "avatar/wardrobe/attachment.h"
#include "avatar/wardrobe/dressing_body.h"
#include "avatar/wardrobe/layers_below.h"
#include "avatar/wardrobe/sewing.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <numbers>
#include <set>
#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

/// What is put on: one of the two.
struct Piece {
  std::string name;
  int rank = 0;
  const GarmentOrder* order = nullptr;
  const ModelledGarment* modelled = nullptr;
  BodyPose pose = aPose();
};

constexpr int kLowerRank = 0;  // as trousers
constexpr int kUpperRank = 2;  // as a T-shirt

std::string percent(double fraction) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100.0 * fraction);
  return text;
}

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", 1000.0 * metres);
  return text;
}

std::string degrees(double radians) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f degrees", radians * 180.0 / std::numbers::pi);
  return text;
}

/// All meshes whose pose is not known, in one.
TriangleMesh poseless(const std::vector<OutfitPiece>& pieces) {
  TriangleMesh all;
  for (const OutfitPiece& piece : pieces) {
    const auto* modelled = std::get_if<ModelledGarment>(&piece);
    if (modelled == nullptr || modelled->pose)
      continue;
    const ModelledGarment& garment = *modelled;
    const Eigen::Index numVertices = all.numVertices();
    const Eigen::Index numFaces = all.numFaces();
    all.vertices.conservativeResize(3, numVertices + garment.mesh.numVertices());
    all.vertices.rightCols(garment.mesh.numVertices()) = garment.mesh.vertices;
    all.faces.conservativeResize(3, numFaces + garment.mesh.numFaces());
    all.faces.rightCols(garment.mesh.numFaces()) =
        garment.mesh.faces.array() + static_cast<int>(numVertices);
  }
  return all;
}

/// Colours of modelled garments that have none, by layer; display values.
Eigen::Vector3d layerColor(std::size_t layer) {
  static const std::array<Eigen::Vector3d, 4> kColors = {
      {{0.45, 0.42, 0.34}, {0.36, 0.52, 0.72}, {0.80, 0.78, 0.70}, {0.62, 0.30, 0.34}}};
  return kColors[layer % kColors.size()];
}

/// Triangles too thin for a mass-spring cloth: their springs across are stiff and short.
long countNeedles(const TriangleMesh& mesh) {
  constexpr double kNeedle = 5.0 * std::numbers::pi / 180.0;
  long needles = 0;
  for (Eigen::Index f = 0; f < mesh.numFaces(); ++f)
    needles += faceAngles(mesh, f).minCoeff() < kNeedle ? 1 : 0;
  return needles;
}

/// Of the nearest places of the mesh that a garment was made from; none if that has none.
Eigen::Matrix3Xd colorsNearest(const TriangleMesh& mesh, const ModelledGarment& modelled) {
  if (modelled.vertexColors.cols() == 0)
    return {};
  const TriangleBvh bvh(modelled.mesh);
  Eigen::Matrix3Xd colors(3, mesh.numVertices());
  for (Eigen::Index v = 0; v < colors.cols(); ++v) {
    const ClosestPoint nearest = bvh.closestPoint(mesh.vertices.col(v));
    colors.col(v) =
        modelled.vertexColors(Eigen::all, modelled.mesh.faces.col(nearest.face)) * nearest.weights;
  }
  return colors.cwiseMax(0.0).cwiseMin(1.0);
}

class Dresser {
 public:
  Dresser(const BodyModel& model, const Eigen::VectorXd& betas) : model_(model), betas_(betas) {
    result_.avatar.body = makeAvatarBody(model, betas);
  }

  Piece piece(const GarmentOrder& order) const {
    order.validate();
    return {
        order.label.empty() ? order.name : order.label,
        wardrobePiece(order.name).rank,
        &order,
        nullptr};
  }

  /// `found`: the pose of those that don't know theirs.
  Piece piece(const ModelledGarment& modelled, const BodyPose& found) const {
    Piece result{modelled.name, kUpperRank, nullptr, &modelled, modelled.pose.value_or(found)};
    const double chest =
        worldFromJoints(result_.avatar.body, result.pose)[kSpine3].translation().y();
    if (modelled.mesh.vertices.row(1).maxCoeff() < chest)
      result.rank = kLowerRank;
    return result;
  }

  /// The pose in which all garments were modelled that don't say it.
  BodyPose foundPose(const std::vector<OutfitPiece>& pieces) {
    const TriangleMesh together = poseless(pieces);
    if (together.numFaces() == 0)
      return aPose();
    const ConstructionPose found = fitConstructionPose(model_, betas_, together);
    if (found.status != ConstructionPoseStatus::kFitted)
      throw std::runtime_error(
          "the garments fit this body in no pose (" + percent(found.fractionInside) +
          " of the vertices stay under the skin, their median distance is " +
          millimetres(found.medianClearance) +
          "): give the betas of the body they were modelled on, metres, Y up, facing +Z");
    result_.notes.push_back(
        "garments were modelled with the arms " + degrees(found.armsDown) + " down and the legs " +
        degrees(found.legsApart) + " out; " + percent(found.fractionInside) +
        " of the vertices were under the skin");
    return found.pose;
  }

  void putOn(const Piece& piece) {
    const DressingBody body = standForDressing(model_, betas_, piece.pose);
    const std::vector<Garment> worn = wornIn(piece.pose);
    Garment garment = piece.order != nullptr ? makeGarment(*piece.order, body, worn)
                                             : fitted(*piece.modelled, piece.rank, body, worn);
    garment.layer = static_cast<int>(worn.size());
    for (const Garment& below : worn)
      garment.collideWith.push_back(below.name);
    result_.avatar.garments.push_back(std::move(garment));
  }

  DressedAvatar take() { return std::move(result_); }

 private:
  Garment fitted(
      const ModelledGarment& modelled,
      int rank,
      const DressingBody& body,
      const std::vector<Garment>& worn) {
    Garment garment;
    garment.name = modelled.name;
    garment.color = layerColor(worn.size());
    const LayersBelow below(body.mesh(), worn);
    if (modelled.edgeLength)
      remesh(garment, modelled, below);
    else
      keepMesh(garment, modelled, below);
    attach(garment, body, rank == kLowerRank ? Fastening::kPinned : Fastening::kLoose);
    return garment;
  }

  void remesh(Garment& garment, const ModelledGarment& modelled, const LayersBelow& below) {
    garment.mesh = sewn(
        modelled.mesh,
        below,
        {.edgeLength = *modelled.edgeLength,
         .thickness = garment.cloth.thickness,
         .smoothingRounds = 0});
    garment.mesh.vertices = roundedToFloat(garment.mesh.vertices);
    garment.vertexColors = colorsNearest(garment.mesh, modelled);
    note(
        modelled.name,
        "remeshed from " + std::to_string(modelled.mesh.numVertices()) + " to " +
            std::to_string(garment.mesh.numVertices()) + " vertices");
  }

  void keepMesh(Garment& garment, const ModelledGarment& modelled, const LayersBelow& below) {
    garment.vertexColors = modelled.vertexColors;
    const ClearanceResult clear = below.cleared(modelled.mesh, garment.cloth.thickness);
    garment.mesh = {roundedToFloat(clear.vertices), modelled.mesh.faces};
    if (clear.movedVertices > 0)
      note(
          modelled.name,
          std::to_string(clear.movedVertices) + " of " +
              std::to_string(garment.mesh.numVertices()) +
              " vertices were moved out of skin or inner garments, by " +
              millimetres(clear.maxDisplacement) + " at most");
    if (clear.verticesBelow > 0)
      note(
          modelled.name,
          std::to_string(clear.verticesBelow) + " vertices have no room between skin and skin");
    if (const long needles = countNeedles(garment.mesh); needles > 0)
      note(
          modelled.name,
          std::to_string(needles) + " of " + std::to_string(garment.mesh.numFaces()) +
              " triangles are needles (an angle below 5 degrees), which simulate badly: have it "
              "remeshed unless its vertices must stay");
  }

  /// What is worn already, as it follows the body into a pose.
  std::vector<Garment> wornIn(const BodyPose& pose) const {
    std::vector<Garment> worn = result_.avatar.garments;
    for (Garment& garment : worn) {
      if (garment.bindPose.jointRotations == pose.jointRotations &&
          garment.bindPose.translation == pose.translation)
        continue;
      garment.mesh.vertices = posedVertices(garment, result_.avatar.body, pose);
      garment.bindPose = pose;
    }
    return worn;
  }

  void note(const std::string& garment, const std::string& text) {
    result_.notes.push_back(garment + ": " + text);
  }

  const BodyModel& model_;
  const Eigen::VectorXd& betas_;
  DressedAvatar result_;
};

void requireDifferentNames(const std::vector<Piece>& pieces) {
  std::set<std::string> names;
  for (const Piece& piece : pieces) {
    if (!names.insert(piece.name).second)
      throw std::invalid_argument("outfit: '" + piece.name + "' occurs twice");
  }
}

}  // namespace

DressedAvatar dressed(const BodyModel& model, const Eigen::VectorXd& betas, const Outfit& outfit) {
  Dresser dresser(model, betas);
  const BodyPose found = dresser.foundPose(outfit.pieces);
  std::vector<Piece> pieces;
  pieces.reserve(outfit.pieces.size());
  for (const OutfitPiece& piece : outfit.pieces) {
    if (const auto* order = std::get_if<GarmentOrder>(&piece))
      pieces.push_back(dresser.piece(*order));
    else
      pieces.push_back(dresser.piece(std::get<ModelledGarment>(piece), found));
  }
  if (outfit.order == LayerOrder::kByKind)
    std::stable_sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
      return a.rank != b.rank ? a.rank < b.rank : a.name < b.name;
    });
  requireDifferentNames(pieces);
  for (const Piece& piece : pieces)
    dresser.putOn(piece);
  return dresser.take();
}

}  // namespace avatar
