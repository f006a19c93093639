#pragma once

#include "bullet_ext/core/body_surface.h"
#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"
#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/contact_kernels.h"
#include "bullet_ext/core/contact_search.h"
#include "bullet_ext/core/external_force.h"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace bullet_ext {

struct BodyContactOptions {
  double thickness = 0.004;  ///< distance kept from the surface [m], 1e-6 … 0.1
  double friction = 0.3;     ///< Coulomb coefficient, 0 … 10
  /// How fast a vertex that is too near for another reason than its own motion is lifted [m/s],
  /// 1e-3 … 100: cloth that starts inside the body comes out at this speed.
  double recoverySpeed = 1.0;
  /// By which share of the thickness a vertex may be nearer to a triangle than to the one that it
  /// rests on before that is noticed, 0 … 0.5. Neighbouring triangles are always almost equally
  /// near, so 0 means to look at all of them all the time.
  double slack = 0.15;
  ClothKernels kernels = ClothKernels::kAutomatic;  ///< all give the same bytes

  /// Throws std::invalid_argument that names the field outside its range, or for kWide on a
  /// processor without AVX2 and FMA.
  void validate() const;

  bool operator==(const BodyContactOptions&) const = default;
};

/// With the thickness and friction of a material.
BodyContactOptions contactFor(const ClothMaterial& material);

/// Keeps the vertices of a cloth outside a moving surface, with friction.
///
/// In every substep, for the surface at the substep's end: the closest point c of the surface to a
/// vertex x, with d the signed distance and n the unit vector along which d grows. Where d is below
/// the thickness h, with v the velocity relative to the surface at c and j = max(0, −v·n):
///   Δv = j n − min(1, μ j / |v_t|) v_t,   Δx = min(h − d, j Δt + recovery Δt) n + Δt Δv_t
/// So approach stops, sliding slows by Coulomb's law, and the position gets what a substep with the
/// new velocity would have given, without bounce and without throwing out what is deep inside.
///
/// Where parts of the body nearly touch, with another skin at a distance d2 on the vertex's other
/// side, (d + d2)/2 takes the place of h if it is less: a squeezed vertex goes to the middle and
/// stays there. Where parts overlap, the nearest skin may be that of another limb, seen from
/// inside. So a vertex that was pushed and hasn't been farther than 1.1 h from that skin since,
/// remembers the direction of the push. A face that it is behind and whose normal is at more than
/// 90° to this direction doesn't count: it keeps to its own skin, is neither driven to and fro nor
/// pushed out through another limb. Nor is who has no skin within 1.1 h when another limb comes
/// over it.
///
/// Most vertices are not tested at all: see ContactCluster. Vertices are handled in groups of eight
/// that are neighbours in memory, so cloth in VertexOrder::kMorton is fast. A vertex's result
/// depends on itself and the surface alone (its neighbours decide about what is skipped safely),
/// so ranges may be resolved by different threads at the same time.
class BodyContact {
 public:
  /// Keeps a reference to the surface. Throws std::invalid_argument for invalid options.
  BodyContact(
      const ClothMesh& mesh, const BodySurface& surface, const BodyContactOptions& options = {});

  const BodyContactOptions& options() const { return options_; }

  /// After the surface's setFrame and before the first substep. numSubsteps · substepDuration must
  /// be the surface's frame (to 1e-4 of it). Throws std::invalid_argument otherwise, before any
  /// frame, for a state of another mesh or one that isn't finite.
  void beginFrame(const ClothState& state, double substepDuration, int numSubsteps);

  /// After substep 0 … numSubsteps − 1 of the stepper, in this order. Pins are left alone.
  ContactCounts resolve(ClothState& state, int substep);

  /// The same for some vertices; range.begin and, unless it is the number of vertices, range.end
  /// must be multiples of kContactLanes. Positions and velocities 4 × N, as in ClothState.
  ContactCounts resolve(
      Eigen::Matrix4Xf& positions, Eigen::Matrix4Xf& velocities, int substep, VertexRange range);

 private:
  /// Of eight vertices, four floats each.
  struct GroupState {
    float* positions;
    float* velocities;
  };

  void requireFits(const Eigen::Matrix4Xf& positions, const Eigen::Matrix4Xf& velocities) const;
  void forget(Eigen::Index vertex);
  void keepLists();

  /// Whether anybody was moved.
  bool resolveGroup(
      std::size_t index,
      const ContactSubstep& substep,
      const GroupState& state,
      ContactSearch& search);

  const BodySurface& surface_;
  BodyContactOptions options_;
  const ContactKernels& kernels_;
  double substepDuration_ = 0.0;
  int numSubsteps_ = 0;
  int lastFrame_ = 0;          ///< of the surface: its number
  float lastDuration_ = 0.0F;  ///< [s]
  std::vector<ContactGroup> groups_;
  CacheLineVector<ContactCluster> clusters_;
  Eigen::Matrix4Xf lastPositions_;  ///< 4 × N after the last frame; NaN: unknown
};

}  // namespace bullet_ext
