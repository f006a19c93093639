#pragma once

#include "avatar/body_fit.h"
#include "avatar/body_model.h"
#include "avatar/layered_avatar.h"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace avatar {

/// What happens to the size of garments.
enum class GarmentSize {
  kGraded,  ///< as the tailor would make it for the other body: the ease stays
  kKept     ///< the very piece, however it fits; it gives way only where the body doesn't fit in
};

/// What became of one garment.
struct RetargetedGarment {
  std::string name;
  /// How its vertices' distances from the skin have changed [m]; ease is kept where they are 0.
  double meanEaseChange = 0.0;
  double p95EaseChange = 0.0;
  double p95EdgeChange =
      0.0;                ///< of edges' lengths, |ratio − 1|: what grading or tightness changed
  int movedVertices = 0;  ///< pushed out of skin or inner garments, or drawn along
  int verticesBelow = 0;  ///< without room between skin and skin
};

struct RetargetedAvatar {
  LayeredAvatar avatar;
  bool sameTopology = false;  ///< bodies correspond vertex by vertex
  /// From the source body's vertices, where they correspond to, to the target's surface and back;
  /// zeros for the same topology.
  DistanceStatistics registration;
  std::vector<RetargetedGarment> garments;
};

/// Dresses another body in an avatar's garments (paper 5.2, Fig. 12; geometry alone: simulate it to
/// settle). Each garment is graded to the target's size: in the pose it was made in, every vertex
/// is moved by what the skin under it is moved by, averaged the farther the looser it hangs, so
/// that its distance from the skin stays. Then what ended in skin or inner garments is pushed out,
/// inner layers first. Faces, order of vertices, pins, layers and parameters stay. With
/// GarmentSize::kKept it is then brought back to its own size (sizeKeepingFit()) before it is
/// pushed out.
///
/// Bodies with the same faces correspond vertex by vertex, others by registerSurfaces(). Throws
/// std::invalid_argument when the avatar has a flaw, the model or betas can't be used, or the two
/// skeletons have different numbers of joints.
RetargetedAvatar retargeted(
    const LayeredAvatar& source,
    const BodyModel& model,
    const Eigen::VectorXd& betas,
    GarmentSize size = GarmentSize::kGraded);

}  // namespace avatar
