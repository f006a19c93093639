#include "avatar/wardrobe/wardrobe.h"

#include "avatar/avatar_body.h"
#include "avatar/geometry/measures.h"
#include "avatar/wardrobe/attachment.h"
#include "avatar/wardrobe/layers_below.h"
#include "avatar/wardrobe/pattern.h"
#include "avatar/wardrobe/sewing.h"

#include <stdexcept>
#include <utility>

namespace avatar {
namespace {

struct PieceRecipe {
  WardrobePiece piece;
  GarmentShape (*pattern)(const PatternInput&);
  bool hasWaistband;
  Eigen::Vector3d color;  // display values
};

const std::vector<PieceRecipe>& recipes() {
  static const std::vector<PieceRecipe> all = {
      {{"tshirt", "T-shirt with short sleeves", 0.025, 2},
       tshirtPattern,
       false,
       {0.36, 0.52, 0.72}},
      {{"shirt", "loose long-sleeved shirt", 0.045, 3}, shirtPattern, false, {0.80, 0.78, 0.70}},
      {{"trousers", "long trousers", 0.025, 0}, trousersPattern, true, {0.25, 0.28, 0.36}},
      {{"shorts", "shorts above the knee", 0.03, 0}, shortsPattern, true, {0.45, 0.42, 0.34}},
      {{"skirt", "flared knee-length skirt", 0.02, 1}, skirtPattern, true, {0.62, 0.30, 0.34}},
      {{"dress", "knee-length dress with cap sleeves", 0.02, 2},
       dressPattern,
       false,
       {0.30, 0.55, 0.48}},
  };
  return all;
}

const PieceRecipe& recipe(const std::string& name) {
  for (const PieceRecipe& candidate : recipes()) {
    if (candidate.piece.name == name)
      return candidate;
  }
  std::string known;
  for (const WardrobePiece& piece : wardrobe())
    known += (known.empty() ? "" : ", ") + piece.name;
  throw std::invalid_argument("wardrobe: there is no '" + name + "' (known: " + known + ")");
}

Eigen::AlignedBox3d roomAround(const DressingBody& body) {
  Eigen::AlignedBox3d box = boundingBox(body.mesh());
  const Eigen::Vector3d room = Eigen::Vector3d::Constant(0.3);  // ease and flare [m]
  return {box.min() - room, box.max() + room};
}

}  // namespace

const std::vector<WardrobePiece>& wardrobe() {
  static const std::vector<WardrobePiece> pieces = [] {
    std::vector<WardrobePiece> result;
    for (const PieceRecipe& entry : recipes())
      result.push_back(entry.piece);
    return result;
  }();
  return pieces;
}

const WardrobePiece& wardrobePiece(const std::string& name) {
  return recipe(name).piece;
}

void GarmentOrder::validate() const {
  recipe(name);
  const auto require = [this](bool holds, const std::string& what) {
    if (!holds)
      throw std::invalid_argument("wardrobe: " + name + ": " + what);
  };
  require(!ease || (*ease >= 0.005 && *ease <= 0.15), "ease must be 0.005 to 0.15 m");
  require(edgeLength >= 0.008 && edgeLength <= 0.05, "edgeLength must be 0.008 to 0.05 m");
}

Garment makeGarment(
    const GarmentOrder& order, const DressingBody& body, const std::vector<Garment>& inner) {
  order.validate();
  const PieceRecipe& made = recipe(order.name);
  const PatternInput input{body, inner, order.ease.value_or(made.piece.ease)};
  Garment garment;
  garment.name = order.label.empty() ? order.name : order.label;
  garment.color = made.color;
  constexpr double kCellShare = 0.4;  // of the drawn surface, of an edge
  const TriangleMesh drawn =
      shapeSurface(made.pattern(input), roomAround(body), kCellShare * order.edgeLength);
  garment.mesh = sewn(
      drawn,
      LayersBelow(body.mesh(), inner),
      {.edgeLength = order.edgeLength, .thickness = garment.cloth.thickness});
  garment.mesh.vertices = roundedToFloat(garment.mesh.vertices);
  attach(garment, body, made.hasWaistband ? Fastening::kPinned : Fastening::kLoose);
  return garment;
}

}  // namespace avatar
