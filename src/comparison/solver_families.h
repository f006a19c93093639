#pragma once

#include "src/comparison/solver_under_test.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace simulcap {

struct ComparisonOptions {
  /// Simulated time from the start, a pre-roll included [s], up to 60; at least one frame.
  double seconds = 0.5;
  int threads = 1;     ///< the most that a solver may use, ≥ 1
  bool quick = false;  ///< few and cheap settings only, for a first look

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// What a scene asks of a solver beside springs, hinges and gravity.
struct SceneNeeds {
  bool movingPins = false;
  bool everythingElse = false;  ///< body, obstacles, contact of cloths, wind, strain limit
  bool severalStiffnesses = false;
  Eigen::Index largestCloth = 0;  ///< vertices
};

/// Throws std::runtime_error for a scene without cloth.
SceneNeeds sceneNeeds(const ComparisonTask& task);

/// Solvers that differ in their settings alone. Another solver is another entry of
/// solverFamilies().
struct SolverFamily {
  std::string name;
  /// Why it has no place in a comparison of this scene; empty: it has.
  std::function<std::string(const SceneNeeds&, const ComparisonOptions&)> whyNot;
  /// One run each, from few steps to many.
  std::function<std::vector<SolverSettings>(const ComparisonTask&, const ComparisonOptions&)>
      settings;
  std::function<std::unique_ptr<ClothSolverUnderTest>(const ComparisonTask&, const SolverSettings&)>
      make;
};

std::vector<SolverFamily> solverFamilies();

}  // namespace simulcap
