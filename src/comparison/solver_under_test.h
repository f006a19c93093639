#pragma once

#include "src/scene/scene.h"
#include "src/simulation/stage.h"

#include <Eigen/Core>

#include <string>

namespace simulcap {

/// What all solvers of a comparison are given. Scene and stage outlive them.
struct ComparisonTask {
  const Scene& scene;
  const Stage& stage;

  double frameDuration() const { return 1.0 / stage.framesPerSecond; }  ///< [s]

  /// Where a cloth's pins are at the end of frame `frame` (0: the start), 3 × number of pins [m].
  /// Only for scenes without a body.
  Eigen::Matrix3Xd pinsAt(const StagedCloth& cloth, int frame) const {
    return pinPositions(cloth, frame * frameDuration(), nullptr);
  }
};

/// What resists in a cloth. Solvers converge to the truth of their own energy, to no other.
enum class ClothEnergy {
  kPaper,        ///< springs of k/2 [N/m] along edges, hinges of w [N·m/rad]
  kBendingLinks  ///< Bullet's: springs of the mean k/2 along edges and between second neighbours
};

/// One solver with one choice of its settings.
struct SolverSettings {
  std::string solver;  ///< as compare.json names it: "bullet_soft_body"
  std::string series;  ///< what it is called in the picture; shared by runs that differ in steps
  std::string integrator;  ///< how time is divided: "semi_implicit_euler"
  std::string kernels;     ///< "portable" or "wide"; empty where there is no choice
  int stepsPerFrame = 100;
  int iterations = 0;  ///< in every step; 0: the solver has none
  int threads = 1;
  ClothEnergy energy = ClothEnergy::kPaper;
  std::string meaning;  ///< of the scene's k, w, mass and damping in this solver

  /// Steps, and iterations where there are any: "100", "8x20".
  std::string label() const {
    const std::string steps = std::to_string(stepsPerFrame);
    return iterations == 0 ? steps : steps + "x" + std::to_string(iterations);
  }
};

/// Moves the cloths of a scene frame by frame, in its own way. All solvers of a comparison live at
/// the same time and take turns, so that a busy machine slows all of them alike.
class ClothSolverUnderTest {
 public:
  virtual ~ClothSolverUnderTest() = default;

  /// To the next frame: what is timed. False when the solver itself found that it blew up.
  virtual bool advance() = 0;

  /// 3 × N [m], in the order of the stage's mesh; may be anything after a blow-up.
  virtual Eigen::Matrix3Xd vertices(int cloth) const = 0;
};

}  // namespace simulcap
