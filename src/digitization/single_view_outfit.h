#pragma once

#include "avatar/digitization/posed_frame.h"
#include "avatar/layered_avatar.h"
#include "avatar/skinning.h"
#include "avatar/wardrobe/wardrobe.h"

#include <Eigen/Core>

#include <optional>
#include <string>
#include <vector>

namespace simulcap {

struct SingleViewOptions {
  bool onePiece = false;      ///< labels say upper where a dress is
  double edgeLength = 0.02;   ///< of the garments' meshes [m], 0.008 … 0.05
  double covered = 0.5;       ///< a part wears a garment when this share of it shows it, 0 … 1
  double hangingFree = 0.06;  ///< cloth this far from the thighs is a skirt's [m], 0.01 … 0.5
};

struct ChosenGarment {
  avatar::GarmentOrder order;
  std::optional<Eigen::Vector3d> color;  ///< display values, where the frame has colours
};

struct SingleViewOutfit {
  std::vector<ChosenGarment> garments;
  std::optional<Eigen::Vector3d> skinColor;
  bool guessed = false;  ///< the garments' kind: the frame has no labels
};

/// Built-in garments like those that one frame shows on a tracked body: their kind from what is
/// labelled skin and what garment on its body parts, their ease from how far depth is before the
/// skin, their colour from the picture. Throws std::runtime_error when the labels show no garment,
/// std::invalid_argument as avatar::partImage().
SingleViewOutfit singleViewOutfit(
    const avatar::PosedDepthFrame& frame,
    const avatar::Skinning& skinning,
    const Eigen::VectorXd& betas,
    const SingleViewOptions& options = {});

struct BuiltInAvatar {
  avatar::LayeredAvatar avatar;
  std::vector<std::string> notes;  ///< what is worn, and what of it is a guess
};

/// Makes the garments and puts them on.
BuiltInAvatar wearing(
    const SingleViewOutfit& outfit, const avatar::BodyModel& model, const Eigen::VectorXd& betas);

}  // namespace simulcap
