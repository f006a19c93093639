#pragma once

#include "src/comparison/solver_under_test.h"
#include "src/reference/cloth.h"

#include <vector>

namespace simulcap {

/// The cloths of a scene in the slow solver of src/reference, with either energy.
class ReferenceSolver final : public ClothSolverUnderTest {
 public:
  ReferenceSolver(const ComparisonTask& task, ClothEnergy energy, int stepsPerFrame);

  bool advance() override;

  Eigen::Matrix3Xd vertices(int cloth) const override;

 private:
  struct Piece {
    reference::Cloth cloth;
    reference::StepOptions options;
  };

  ComparisonTask task_;
  int stepsPerFrame_;
  int frame_ = 0;
  std::vector<Piece> pieces_;  // one per cloth of the stage
};

}  // namespace simulcap
