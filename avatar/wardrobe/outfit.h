#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"
#include "avatar/garment.h"
#include "avatar/geometry/mesh.h"
#include "avatar/layered_avatar.h"
#include "avatar/wardrobe/wardrobe.h"

#include <Eigen/Core>

#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace avatar {

/// A garment that was modelled elsewhere, on the body that is to wear it.
struct ModelledGarment {
  std::string name;
  TriangleMesh mesh;
  Eigen::Matrix3Xd vertexColors = {};  ///< 3 × V display values; or empty
  /// What the body did when the garment was modelled on it. Unset: found by fitConstructionPose()
  /// from all garments without one, which are taken to have been modelled together.
  std::optional<BodyPose> pose = {};
  /// Remeshed to edges of this length [m], 0.008 … 0.05. Unset: vertices and faces stay as they
  /// are.
  std::optional<double> edgeLength = {};
};

using OutfitPiece = std::variant<GarmentOrder, ModelledGarment>;

enum class LayerOrder {
  kByKind,   ///< lower garments below upper ones, loose ones over tight ones
  kAsListed  ///< inner ones first
};

/// What somebody wears.
struct Outfit {
  std::vector<OutfitPiece> pieces;
  LayerOrder order = LayerOrder::kByKind;
};

struct DressedAvatar {
  LayeredAvatar avatar;
  std::vector<std::string> notes;  ///< what was found and mended, one sentence each
};

/// Dresses a body shape: lower garments first, upper ones over them, each with room for those
/// below. Every garment keeps the pose it was made in as its bind pose; no vertex is nearer to the
/// skin there than the cloth's thickness. Vertices of modelled garments keep their order unless
/// they are to be remeshed. Those that end below the chest hang on their highest opening, which is
/// pinned.
///
/// Throws std::invalid_argument for an unusable body or order or a name that occurs twice, and
/// std::runtime_error, saying what to do, when modelled garments fit the body in no pose.
DressedAvatar dressed(const BodyModel& model, const Eigen::VectorXd& betas, const Outfit& outfit);

}  // namespace avatar
