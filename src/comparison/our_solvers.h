#pragma once

#include "bullet_ext/core/cloth_simulation.h"
#include "bullet_ext/core/implicit_stepper.h"
#include "src/comparison/solver_under_test.h"
#include "src/simulation/scene_run.h"

#include <memory>
#include <vector>

namespace simulcap {

/// Free cloths in ClothSimulation: pins and gravity, no contact. A frame that blows up is not
/// redone with more substeps, as the program would: the comparison is about these ones.
class ExplicitSolver final : public ClothSolverUnderTest {
 public:
  ExplicitSolver(
      const ComparisonTask& task, const bullet_ext::SimulationOptions& options, int substeps);

  bool advance() override;

  Eigen::Matrix3Xd vertices(int cloth) const override;

 private:
  ComparisonTask task_;
  bullet_ext::FrameTiming timing_;
  bullet_ext::ClothSimulation simulation_;
  std::vector<std::unique_ptr<bullet_ext::Gravity>> gravity_;
  int frame_ = 0;
};

/// Free cloths in ImplicitStepper.
class ImplicitSolver final : public ClothSolverUnderTest {
 public:
  ImplicitSolver(const ComparisonTask& task, int stepsPerFrame);

  bool advance() override;

  Eigen::Matrix3Xd vertices(int cloth) const override;

 private:
  struct Piece {
    std::unique_ptr<bullet_ext::ImplicitStepper> stepper;
    bullet_ext::ClothState state;
    bullet_ext::Gravity gravity;
  };

  ComparisonTask task_;
  int stepsPerFrame_;
  std::vector<Piece> pieces_;  // one per cloth of the stage
  int frame_ = 0;
};

/// A whole scene as `simulcap simulate` runs it: body, contact, wind, strain limit.
class WholeSceneSolver final : public ClothSolverUnderTest {
 public:
  /// Throws std::runtime_error for substeps that pre-flight finds unstable.
  WholeSceneSolver(const ComparisonTask& task, int substeps, int threads);

  bool advance() override { return run_.advance().stable; }

  Eigen::Matrix3Xd vertices(int cloth) const override { return run_.vertices(cloth); }

 private:
  SceneRun run_;
};

}  // namespace simulcap
