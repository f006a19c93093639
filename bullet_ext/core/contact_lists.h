#pragma once

#include "bullet_ext/core/contact_elements.h"
#include "bullet_ext/core/contact_kernels.h"
#include "bullet_ext/core/contact_list_builder.h"
#include "bullet_ext/core/thread_team.h"

#include <Eigen/Core>

#include <cstdint>
#include <limits>
#include <vector>

/// Which pairs of elements may come near, found again and again at little cost.
///
/// Everything here follows one rule. Distances change no faster than what separates two things
/// moves, so whoever knows that a distance exceeds a limit by s doesn't have to look again until
/// the relative motion since then has added up to s. It is used at three levels:
///   all patches       which pairs of patches are near;   motion relative to the mean of all
///   a pair of patches which pairs of elements are near;  relative motion of the two patches
///   a pair of elements whether it is a contact;          the same
/// Relative motion is measured from the real positions in every substep and again whenever they
/// have been corrected. The displacements of a patch's vertices are in a box m ± e, so elements of
/// patches a and b move by at most the length of |m_a − m_b| + e_a + e_b (along each axis) against
/// each other.
namespace bullet_ext {

/// What was done, since construction; nothing when nobody asked for it.
struct ContactCounters {
  std::int64_t substeps = 0;
  std::int64_t patchSearches = 0;  ///< searches for pairs of patches
  std::int64_t listBuilds = 0;     ///< lists made for a pair of patches
  std::int64_t pairsListed = 0;    ///< pairs of elements in these lists
  std::int64_t pairsFiltered = 0;  ///< looked at because they may be near
  std::int64_t distances = 0;      ///< exact distances in substeps
  std::int64_t contacts = 0;       ///< pairs that were pushed or held
  std::int64_t continuousTests = 0;
  std::int64_t approaches = 0;  ///< continuous tests that found one
  std::int64_t zones = 0;       ///< groups of vertices moved together as the last resort
  std::int64_t unresolved = 0;  ///< pairs that pins force through each other
  std::int64_t tangles = 0;     ///< vertices per frame that were let through or pushed out

  bool operator==(const ContactCounters&) const = default;
};

/// Names a ListedPair: pair `index` of list `list`.
struct PairName {
  int list = 0;
  int index = 0;
};

struct ContactListsOptions {
  bool self = true;     ///< pairs within a garment
  bool between = true;  ///< pairs of different garments
};

/// What the vertices of a patch do in a substep: their displacements are within middle ± extent.
struct PatchMotion {
  Eigen::Array4f middle, extent;  ///< [m], the fourth is 0
};

class ContactLists {
 public:
  /// The elements and the team must outlive the lists. Same results for any number of threads.
  ContactLists(
      const ContactElements& elements, const ContactListsOptions& options, ThreadTeam& team);

  /// Forgets everything: positions have been changed from outside.
  void clear();

  /// The vertices move from start to end on straight lines in the running substep.
  void measure(const Positions& start, const Positions& end);

  /// The same when since the last time only the ends of these vertices have changed (N flags).
  void measureMoved(const Positions& start, const Positions& end, const std::vector<char>& moved);

  /// Adds to `awake` the names of all pairs, apart from those that are awake already, that may come
  /// nearer than their thickness in the motion that was measured.
  /// Returns false when a list with awake pairs has to be made again: the caller drops the names it
  /// has, calls sleep() and asks once more.
  bool collect(const Positions& start, std::vector<PairName>& awake, ContactCounters& counters);

  /// All awake pairs have to be collected again.
  void sleep(const std::vector<PairName>& awake);

  ListedPair& pair(const PairName& name) {
    return lists_[static_cast<std::size_t>(name.list)].pairs[static_cast<std::size_t>(name.index)];
  }

  /// The substep ends where the motion measured last does; the next one starts there.
  void advance();

  /// After advance(): the pair's elements are `clearance` [m] farther apart than their thickness,
  /// or nearer if it is negative.
  void setClearance(const PairName& name, float clearance);

 private:
  struct List {
    int patch1 = 0, patch2 = 0;  ///< patch1 ≤ patch2
    float reach = -1.0F;         ///< relative motion after which it has to be made again [m]
    float consumed = 0.0F;       ///< relative motion since it was made [m]
    float step = 0.0F;           ///< of the running substep
    float examined = 0.0F;       ///< step for which its pairs have been collected
    int awake = 0;
    float firstWakeUp = std::numeric_limits<float>::infinity();  ///< least of `wakeUp`
    std::vector<float> wakeUp;  ///< per pair: value of `consumed` at which to look; infinite: awake
    std::vector<ListedPair> pairs;
  };

  void boundMotions();
  bool searchHolds() const;
  void search(const Positions& start);
  bool wanted(int patch1, int patch2) const;
  float thicknessOf(const List& list) const;

  /// What one thread needs to make lists.
  struct Builder {
    PairFinder finder;
    Positions slanted;  ///< with a fourth coordinate; valid for the list that is being made
  };

  float apart(const List& list, int axisOf, const Positions& start, Positions& slanted) const;
  void build(List& list, const Positions& start, Builder& builder) const;
  bool examine();
  void buildUsedUp(const Positions& start, ContactCounters& counters);
  void wake(int list, std::vector<PairName>& awake);

  const ContactElements& elements_;
  ThreadTeam& team_;
  const ContactKernels& kernels_;
  ContactListsOptions options_;
  float largestThickness_ = 0.0F;
  std::vector<PatchMotion> motions_;      ///< of the patches in the running substep
  std::vector<Eigen::Vector4f> normals_;  ///< of the patches at the last search
  std::vector<int> examined_, usedUp_;    ///< lists, as found by examine()
  std::vector<Builder> builders_;         ///< one per thread
  /// How far patches have strayed from the mean of all since the last search, and do in the running
  /// substep [m].
  std::vector<float> strayed_, straying_;
  float searchReach_ = -1.0F;  ///< how far any two may together [m]
  std::vector<List> lists_;    ///< ascending in (patch1, patch2)
};

}  // namespace bullet_ext
