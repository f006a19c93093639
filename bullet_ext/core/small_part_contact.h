#pragma once

#include "bullet_ext/core/body_contact.h"
#include "bullet_ext/core/body_surface.h"
#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"
#include "bullet_ext/core/moving_box_tree.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace bullet_ext {

/// Vertices of a surface, at the start of its frame, that are too strongly curved for the cloth's
/// vertices alone to keep its triangles outside: an edge of length e over a curvature κ sags by
/// e² κ/8, here by more than half the thickness. e is the cloth's mean edge at rest, κ the largest
/// convex curvature (n_j − n_i)·(p_j − p_i)/|p_j − p_i|² along an edge of the surface. Ascending.
std::vector<int> smallPartVertices(
    const BodySurface& surface, const ClothMesh& mesh, double thickness);

struct SmallPartCounts {
  std::int64_t contacts = 0;      ///< pairs pushed
  std::int64_t pairTests = 0;     ///< body vertex against cloth triangle
  std::int64_t listRebuilds = 0;  ///< of one body vertex each

  SmallPartCounts& operator+=(const SmallPartCounts& other);

  bool operator==(const SmallPartCounts&) const = default;
};

/// Fingers, ears, noses: their vertices against the cloth's triangles. The response is that of
/// BodyContact, with the triangle's closest point in the vertex's place; its corners share it by
/// inverse mass times barycentric coordinate, so that the point moves as asked and the cloth's
/// momentum changes by what a force at that point would change. A triangle that is deeper than the
/// thickness behind a body vertex belongs to another side of the part and is left alone.
///
/// Each body vertex has a list of the triangles within a reach. The cloth's motion since, the sum
/// over substeps of a bound of the largest displacement, and its own tell when the list must be
/// made again; where neither has been moved between two frames, lists survive them.
class SmallPartContact {
 public:
  /// Keeps references to both. Throws std::invalid_argument for invalid options.
  SmallPartContact(
      const ClothMesh& mesh, const BodySurface& surface, const BodyContactOptions& options);

  /// As of BodyContact. Selects the vertices in the first frame.
  void beginFrame(const ClothState& state, double substepDuration, int numSubsteps);

  /// After BodyContact's in each substep. One thread, pairs in a fixed order.
  SmallPartCounts resolve(ClothState& state, int substep);

  const std::vector<int>& vertices() const { return vertices_; }

 private:
  struct Near {
    int vertex = -1;
    int face = -1;                    ///< one of the surface that has the vertex,
    int corner = 0;                   ///< as this corner
    float speed = 0.0F;               ///< in this frame [m/s]
    float step = 0.0F;                ///< bound of the motion in this substep [m]
    float slack = -1.0F;              ///< relative motion that is still allowed for [m]
    std::vector<std::int32_t> faces;  ///< of the cloth
  };

  void renewLists(const ClothState& state, float time, SmallPartCounts& counts);
  bool push(ClothState& state, const Near& near, int face, float time) const;

  const ClothMesh& mesh_;
  const BodySurface& surface_;
  BodyContactOptions options_;
  double substepDuration_ = 0.0;
  std::vector<int> vertices_;
  std::vector<Near> near_;
  Eigen::Matrix4Xf before_;  ///< the cloth's positions after the last substep
  std::vector<MovingBox> boxes_;
  std::optional<MovingBoxTree> tree_;
};

}  // namespace bullet_ext
