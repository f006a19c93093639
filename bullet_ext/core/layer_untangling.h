#pragma once

#include "bullet_ext/core/contact_elements.h"
#include "bullet_ext/core/continuous_collision.h"
#include "bullet_ext/core/thread_team.h"

#include <Eigen/Core>

#include <array>
#include <vector>

namespace bullet_ext {

/// A vertex on the wrong side of another layer's surface.
struct MisplacedVertex {
  std::array<int, 4> vertices = {};  ///< it and the nearest triangle
  ClosestPoints<float> closest;
  /// 1: it belongs on the side of the triangle's normal (it is of the upper layer), −1: behind it.
  float side = 1.0F;
};

/// What crosses, and what is on the wrong side, in one state of all garments.
struct LayerUntangling {
  std::vector<bool> tangled;  ///< N, or none if nothing is: vertices to be let through
  std::vector<MisplacedVertex> misplaced;
};

struct UntanglingOptions {
  bool self = true;
  bool between = true;
  float depth = 0.03F;  ///< farthest wrong-sided vertex considered [m]
};

/// Crossings by exact tests. An upper layer's vertex is misplaced when it is behind the nearest
/// triangle of a lower layer (faces look outwards) and nearer than the depth, a lower layer's one
/// when it is in front of an upper layer's; next to an open border there is no inside.
LayerUntangling findTangles(
    const ContactElements& elements,
    const Eigen::Matrix4Xf& positions,
    const UntanglingOptions& options,
    ThreadTeam& team);

}  // namespace bullet_ext
