#pragma once

#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/cloth_state.h"
#include "bullet_ext/core/contact_elements.h"
#include "bullet_ext/core/contact_lists.h"
#include "bullet_ext/core/contact_response.h"
#include "bullet_ext/core/layer_untangling.h"
#include "bullet_ext/core/thread_team.h"
#include "bullet_ext/core/vertex_zones.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace bullet_ext {

struct ClothContactOptions {
  bool self = true;     ///< within garments
  bool between = true;  ///< of different garments

  /// What is nearer than its thickness is pushed apart by this part of the lack per substep, 0 … 1,
  double repulsion = 0.1;
  double repulsionSpeed = 0.1;  ///< but not faster than this [m/s], 0 … 100
  /// Pairs are looked at this long apart [s], 0 … 1, as far as that is whole substeps, and at the
  /// end of each frame; for straight ways between. 0: after every substep.
  double interval = 0.0;
  /// An upper layer's vertex this deep under a lower one is brought out again [m], 0 … 1.
  double untangleDepth = 0.03;

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Keeps garments from passing through themselves and each other.
///
/// The invariant is that no two elements meet while all vertices move on straight lines from the
/// positions at the start of a substep (or of some, see interval) to those at its end. So nothing
/// ever crosses that did not cross in the beginning, and no history of sides is needed. resolve()
/// changes the ends in this order:
///  1. Pairs that would end nearer than their thickness are kept apart by Gauss–Seidel impulses
///     with Coulomb friction: they may not come nearer than the thickness, and those that are
///     nearer not come nearer still (inelastic), plus a slow push outwards.
///  2. Every pair that may have come near is certified: an axis separates it at both ends of its
///     path, or the continuous test finds no approach to a small part of its distance. Where one is
///     found, an impulse at the time and place of the approach (Provot 1997; Bridson, Fedkiw and
///     Anderson 2002) is added to those of step 1.
///  3. What still fails after some passes is gathered in zones, whose vertices all get the mean
///     displacement (weighted by mass) of their zone: translated copies of the start. Zones grow
///     until everything is certified. Translation, where Provot has a rigid motion, keeps momentum
///     but not angular momentum, and is safe without further tests.
/// Corrections of positions change velocities alike: Δv = Δx/dt, so positions and velocities stay
/// consistent. Pins have infinite mass; where pins force elements through each other nothing is
/// done but counted.
///
/// Crossings that are there in the beginning (or made by pins or from outside) are found exactly
/// by beginFrame(); elements of theirs pass through each other freely, and layers are pushed
/// apart slowly in their order.
class ClothContact final : public SubstepConstraint {
 public:
  /// With the threads of a team that outlives it, or one; the results are the same. Throws
  /// std::invalid_argument for a garment or an option outside its range.
  explicit ClothContact(
      std::span<const ContactGarment> garments,
      const ClothContactOptions& options = {},
      ThreadTeam* team = nullptr);
  ClothContact(const ClothContact&) = delete;
  ClothContact& operator=(const ClothContact&) = delete;
  ClothContact(ClothContact&&) = delete;
  ClothContact& operator=(ClothContact&&) = delete;
  ~ClothContact() override = default;

  /// Positions that differ from those after the last resolve() have been changed from outside: all
  /// crossings are looked for. States in the order of the garments. Throws std::invalid_argument
  /// when their number or sizes are wrong.
  void beginFrame(std::span<const ClothState> states, const FrameTiming& timing) override;

  /// After each substep's integration and contacts with the body: changes positions and
  /// velocities, in substeps that end an interval. Positions must be finite. Throws like
  /// beginFrame(), or std::logic_error without a beginFrame() before.
  void resolve(std::span<ClothState> states, int substep) override;

  const ClothContactOptions& options() const { return options_; }

  const ContactCounters& counters() const { return counters_; }

  /// The pairs that were contacts in the last resolve(), in the order of the solution: vertices in
  /// the common numbering (garments one after the other, each in solver order).
  const std::vector<Contact>& contacts() const { return contacts_; }

 private:
  /// What a substep knows about a pair that may be near.
  struct AwakePair {
    int contact = -1;     ///< into contacts_
    float safe = 0.0F;    ///< smallest distance allowed along the path [m]; 0: not known yet
    float margin = 0.0F;  ///< separation along the pair's axis at the end [m],
    bool seen = false;    ///< if it has been measured
  };

  /// What one thread adds, in the order of its pairs.
  struct Share {
    std::vector<std::size_t> indices;          ///< pairs in contact, or failing
    std::vector<Contact> contacts;             ///< of the former
    std::vector<Approach<double>> approaches;  ///< of the latter
    std::int64_t distances = 0, continuousTests = 0;
    bool trusted = true;
  };

  void requireStates(std::span<const ClothState> states) const;
  void load(std::span<const ClothState> states, Eigen::Matrix4Xf& positions) const;
  void store(std::span<ClothState> states) const;
  void gather();
  bool tangled(const ListedPair& pair) const;
  float frictionOf(const std::array<int, 4>& vertices) const;
  float targetOf(float distance, float thickness) const;
  void addUntangling();
  void respond();
  void inShares(void (ClothContact::*task)(std::size_t, Share&));
  void respondTo(std::size_t index, Share& share);
  void sweepAll();
  bool moved(const ListedPair& pair) const;
  void certifyAll();
  std::vector<std::size_t> failingPairs(bool respondToThem);
  void certify(std::size_t index, Share& share);
  void hold(std::size_t index, const Approach<double>& approach);
  void moveZones(std::vector<std::size_t> failing);
  bool joinZones(VertexZones& zones, const std::vector<std::size_t>& failing);
  void finish();

  ContactElements elements_;
  ClothContactOptions options_;
  ContactCounters counters_;
  ThreadTeam alone_;
  ThreadTeam& team_;
  std::vector<Share> shares_;  ///< one per thread
  ContactLists lists_;
  LayerUntangling untangling_;
  bool idle_;  ///< nothing is asked for
  bool begun_ = false;
  double substepDuration_ = 0.0;  ///< [s]
  int interval_ = 1;              ///< in substeps
  int lastSubstep_ = 0;           ///< of the frame
  int skipped_ = 0;               ///< substeps since pairs were looked at last
  float duration_ = 0.0F;         ///< of the running motion: one substep and what was skipped [s]
  bool trusted_ = false;          ///< the start has no crossings that untangling_ doesn't know
  SubstepMotion motion_;
  Eigen::Matrix4Xf integrated_;  ///< the ends as they were given
  std::vector<char> moved_;      ///< N: vertices that contacts may have corrected
  std::vector<PairName> names_;  ///< of the awake pairs
  std::vector<AwakePair> awake_;
  std::vector<Contact> contacts_;
};

}  // namespace bullet_ext
