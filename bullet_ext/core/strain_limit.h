#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace bullet_ext {

struct StrainLimitOptions {
  /// Springs may be longer than at rest by this part of their length, 0.001 … 10; Provot's 10 %.
  double limit = 0.1;
  int passes =
      1;  ///< over all springs, 1 … 100; one, as Provot has it, leaves a part of the excess
  /// By which a spring is shortened in one pass at most [m], above 0.
  double longestPull = std::numeric_limits<double>::infinity();

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// After Provot 1995: cloth that is soft at first and then hardly stretches, without the small
/// substeps of a stiff spring. To be applied after a substep. Every spring beyond the limit is
/// pulled back to it, its ends in inverse proportion to their masses (so their common centre stays)
/// or the free one alone, and they stop moving apart: an inelastic pull, which keeps momentum and
/// takes kinetic energy. Springs are visited in their order and see what earlier
/// ones did (Gauss–Seidel), so the result is the same every time, and a long excess spreads over
/// several calls. A spring between two pins stays.
class StrainLimiter {
 public:
  /// Throws std::invalid_argument for invalid options.
  StrainLimiter(const ClothMesh& mesh, const StrainLimitOptions& options);

  void setLongestPull(double metres) { longestPull_ = static_cast<float>(metres); }

  /// Returns how many springs were pulled back in the last pass. Throws std::invalid_argument for a
  /// state of another mesh.
  int apply(ClothState& state) const;

 private:
  /// Most springs are looked at and left alone: what that needs is together.
  struct Spring {
    std::int32_t end1 = 0, end2 = 0;
    float squaredLimit = 0.0F;  ///< [m²]
  };

  struct Pull {
    float longest = 0.0F;                ///< [m]
    float share1 = 0.0F, share2 = 0.0F;  ///< of the ends, together 1
  };

  int pullBackAll(ClothState& state) const;
  void pullBack(std::size_t spring, const Eigen::Vector4f& edge, ClothState& state) const;

  Eigen::Index numVertices_;
  int passes_;
  float longestPull_;  ///< [m]
  std::vector<Spring> springs_;
  std::vector<Pull> pulls_;
};

/// The same once. Throws like StrainLimiter.
int limitStrain(const ClothMesh& mesh, ClothState& state, const StrainLimitOptions& options = {});

}  // namespace bullet_ext
