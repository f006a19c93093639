#pragma once

#include "avatar/body_pose.h"
#include "avatar/digitization/outer_surface.h"
#include "avatar/layered_avatar.h"
#include "avatar/skinning.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace avatar {

struct EnhancementOptions {
  double reach = 0.06;      ///< surface further from the skin than this is not its [m], > 0
  double maxOffset = 0.05;  ///< no vertex moves further, hair included [m], 0 … 0.2
  double smoothness = 0.5;  ///< weight of the offsets' evenness against the data, > 0
  double minCosine = 0.3;   ///< between the normals of skin and surface, [-1, 1)
  int rounds = 8;           ///< searches for nearest points, 1 … 100

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// The body under the clothes, in the surface's pose.
struct UndressedBody {
  const Skinning& skinning;
  Eigen::VectorXd betas;
  BodyPose pose;
};

/// What this person's head has that the body model doesn't, and the skin's colours.
struct BodyEnhancement {
  Eigen::Matrix3Xd offsets;       ///< 3 × V [m], to be added to the rest shape; 0 below the neck
  Eigen::Matrix3Xd vertexColors;  ///< 3 × V display values
  /// Of lit skin below the head; of the face when that wasn't seen; the default without both.
  Eigen::Vector3d skinColor = Eigen::Vector3d::Zero();
  double headSeen = 0.0;        ///< share of the head's vertices that found the surface
  double distanceBefore = 0.0;  ///< mean, of those from the surface [m]
  double distanceAfter = 0.0;   ///< the same afterwards
};

/// Fits the head of the undressed body to the fused one (paper section 3, "we enhance the head"):
/// moves it as a whole first, as the tracked pose may have it tilted, then finds offsets u of its
/// vertices that minimise
/// Σ c_v (n·(x_v + u_v − q_v))² + s Σ_edges |u_i − u_j|², q the nearest point of skin or hair, n
/// its normal and c its weight: Geman and McClure's of the residual, times how often it was seen;
/// elsewhere the head goes on evenly. u = 0 where the head's skinning weight has faded out in the
/// neck, so that it ends smoothly there. Where that would fold the head, s grows until it doesn't.
/// Colours are those of the nearest seen skin; unseen skin beside it takes them over, and has the
/// person's skin colour further away. `labels`: one per vertex of the surface. Throws
/// std::invalid_argument when sizes don't fit.
BodyEnhancement enhanceBody(
    const OuterSurface& surface,
    const std::vector<std::uint8_t>& labels,
    const UndressedBody& body,
    const EnhancementOptions& options = {});

/// Adds the details to the body that an avatar stores.
void applyEnhancement(const BodyEnhancement& enhancement, AvatarBody& body);

}  // namespace avatar
