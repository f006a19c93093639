#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"

#include <functional>
#include <optional>
#include <vector>

namespace simulcap {

/// A cloth of the grid.
struct GridCloth {
  double stretch = 0.0;     ///< k [N/m]
  double torsion = 0.0;     ///< w [N·m/rad]
  double vertexMass = 0.0;  ///< [kg]
  double edgeLength = 0.0;  ///< [m]
};

/// Cloths whose largest stable substep is predicted and observed: every value with every other.
struct StabilityGrid {
  std::vector<double> stretch = {300, 800, 1300, 1e4, 1e5, 1e6};  ///< k [N/m]
  std::vector<double> torsion = {0.001, 0.01, 0.05, 0.1, 1, 10};  ///< w [N·m/rad]
  /// [kg]: the paper's, and what a vertex of 0.2 kg/m² weighs at edges of 2 cm.
  std::vector<double> vertexMass = {0.001, 0.00007};
  std::vector<double> edgeLength = {0.02, 0.01};  ///< [m]
  double hangingSeconds = 0.5;  ///< simulated in each run of the small sheet, 0.01 … 10
  double dropSeconds = 1.0;     ///< and of the large one, 0.05 … 10

  /// The corners, in seconds.
  static StabilityGrid quick();

  /// Throws std::invalid_argument for an empty list, or a time outside its range.
  void validate() const;

  /// In the order mass, edge, torsion, stretch, the last one changing fastest.
  std::vector<GridCloth> cloths() const;
};

/// A run with one substep.
struct SubstepTrial {
  double substep = 0.0;  ///< [s]
  bool held = false;     ///< ended with no more energy than it had and got
  /// Least altitude of a triangle that was seen, in parts of its altitude at rest.
  double leastAltitude = 1.0;
};

/// Runs with substeps that close in on the largest one that holds.
struct ObservedLimit {
  double substep = 0.0;              ///< largest that held [s]; 0: none did
  std::vector<SubstepTrial> trials;  ///< in the order in which they were made
};

/// A sheet nine times as large, dropped with the substep that pre-flight just accepts: soft ones
/// sag and fold until triangles collapse, where the guard in flight (cloth_simulation.h) has to
/// help.
struct GuardedDrop {
  int substeps = 0;  ///< per frame
  int redone = 0;    ///< times a frame was taken back and redone
  int givenUp = 0;   ///< frames that blew up even with the most substeps
};

/// What pre-flight says of a cloth, and what is seen.
struct GridFinding {
  GridCloth cloth;
  double predicted = 0.0;           ///< 2/√λ [s], without safety factor
  ObservedLimit shaken;             ///< every mode excited, the highest among them; no gravity
  ObservedLimit hanging;            ///< dropped, held at two corners: it sags, folds and swings
  std::optional<GuardedDrop> drop;  ///< nothing where a frame needs more than a thousand substeps

  /// The largest substep that pre-flight takes [s].
  double accepted() const;
  /// Whether all runs held that pre-flight takes.
  bool acceptedHeld() const;
  /// The cloth folded or was crushed until triangles had lost half their altitude in a run up to
  /// the accepted substep: it is not near its rest shape, of which the prediction speaks.
  bool collapsed() const;
  /// |observed/predicted − 1| of the shaken cloth and, unless it collapsed, of the hanging one.
  double error() const;
};

/// Of what is observed, relative to what is predicted, where triangles don't collapse.
inline constexpr double kLargestGridError = 0.05;

/// A square of so many edges each way, triangles nearly equilateral, pinned at its upper corners,
/// without damping.
bullet_ext::ClothMesh gridSheet(const GridCloth& cloth, int edges);

/// At rest but for a small displacement of every free vertex in its own direction, so that every
/// mode has its part; the same for each run. `amount` [m].
bullet_ext::ClothState shakenState(const bullet_ext::ClothMesh& mesh, double amount);

/// Predicts and observes the limit of one cloth; both times [s] are of the runs under gravity.
GridFinding observe(const GridCloth& cloth, double hangingSeconds, double dropSeconds);

/// All cloths of the grid on up to `threads` threads; `done` is called after each, from any thread.
std::vector<GridFinding> observe(
    const StabilityGrid& grid, int threads, const std::function<void()>& done);

}  // namespace simulcap
