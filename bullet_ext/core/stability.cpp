#include "bullet_ext/core/stability.h"

#include "bullet_ext/core/torsion_force.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

namespace bullet_ext {
namespace {

/// The cloth about its rest shape in mass-scaled coordinates y = √m · x: y'' = −A y. There the
/// springs' tension and the hinges' moment are 0, so that every element has one row b and
/// A = Σ b bᵀ: √(k/2) (ê, −ê) for a spring, √w g for a hinge, each column over √m of its vertex.
class RestOscillator {
 public:
  explicit RestOscillator(const ClothMesh& mesh)
      : mesh_(mesh), springRows_(3, mesh.springs.cols()), hingeRows_(12, mesh.hinges.cols()) {
    inverseRootMasses_ = mesh.inverseMasses.cwiseSqrt();
    for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
      const Eigen::Vector3d edge =
          mesh.restPositions.col(mesh.springs(1, s)) - mesh.restPositions.col(mesh.springs(0, s));
      springRows_.col(s) = std::sqrt(0.5 * mesh.springStiffness[s]) * edge.normalized();
    }
    for (Eigen::Index h = 0; h < mesh.hinges.cols(); ++h) {
      const HingeVectors<double> x = mesh.restPositions(Eigen::all, mesh.hinges.col(h));
      hingeRows_.col(h) = std::sqrt(mesh.hingeStiffness[h]) * hingeAngle(x).gradient.reshaped();
    }
  }

  /// A y, 3 × N.
  Eigen::Matrix3Xd times(const Eigen::Matrix3Xd& y) const {
    const Eigen::Matrix3Xd x = y * inverseRootMasses_.asDiagonal();
    Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, y.cols());
    for (Eigen::Index s = 0; s < mesh_.springs.cols(); ++s) {
      const Eigen::Vector3d row = springRows_.col(s);
      const double extension = row.dot(x.col(mesh_.springs(1, s)) - x.col(mesh_.springs(0, s)));
      result.col(mesh_.springs(0, s)) -= extension * row;
      result.col(mesh_.springs(1, s)) += extension * row;
    }
    for (Eigen::Index h = 0; h < mesh_.hinges.cols(); ++h) {
      addHinge(h, x, result);
    }
    return result * inverseRootMasses_.asDiagonal();
  }

 private:
  void addHinge(Eigen::Index h, const Eigen::Matrix3Xd& x, Eigen::Matrix3Xd& result) const {
    const auto row = hingeRows_.col(h).reshaped(3, 4);
    double turn = 0.0;
    for (int i = 0; i < 4; ++i) {
      turn += row.col(i).dot(x.col(mesh_.hinges(i, h)));
    }
    for (int i = 0; i < 4; ++i) {
      result.col(mesh_.hinges(i, h)) += turn * row.col(i);
    }
  }

  const ClothMesh& mesh_;
  Eigen::Matrix3Xd springRows_;
  Eigen::Matrix<double, 12, Eigen::Dynamic> hingeRows_;
  Eigen::VectorXd inverseRootMasses_;
};

/// A bit of every eigenvector, the same in every run: values from a linear congruential generator
/// (Knuth's MMIX constants).
Eigen::Matrix3Xd startVector(Eigen::Index columns) {
  std::uint64_t state = 1;
  double squaredNorm = 0.0;
  Eigen::Matrix3Xd start(3, columns);
  for (double& value : start.reshaped()) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    value = static_cast<double>(state >> 11U) * 0x1p-53 - 0.5;
    squaredNorm += value * value;
  }
  return start / std::sqrt(squaredNorm);
}

/// The largest eigenvalue of the matrix that the iteration has built so far, and how far it may be
/// from one of A: the next off-diagonal entry times the eigenvector's last.
struct RitzValue {
  double value = 0.0;
  double residual = 0.0;
};

RitzValue largestRitzValue(
    const Eigen::VectorXd& diagonal, const Eigen::VectorXd& offDiagonal, Eigen::Index size) {
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal.head(size), offDiagonal.head(size - 1));
  return {
      solver.eigenvalues()[size - 1],
      offDiagonal[size - 1] * std::abs(solver.eigenvectors()(size - 1, size - 1))};
}

/// Lanczos iteration without reorthogonalization: what rounding spoils are copies of eigenvalues
/// already found, not the largest of them.
class Lanczos {
 public:
  Lanczos(const RestOscillator& oscillator, Eigen::Index columns, int maxIterations)
      : oscillator_(oscillator),
        diagonal_(Eigen::VectorXd::Zero(maxIterations)),
        offDiagonal_(Eigen::VectorXd::Zero(maxIterations)),
        previous_(Eigen::Matrix3Xd::Zero(3, columns)),
        current_(startVector(columns)) {}

  void advance() {
    Eigen::Matrix3Xd next = oscillator_.times(current_);
    const double alpha = next.cwiseProduct(current_).sum();
    next -= alpha * current_;
    if (size_ > 0) {
      next -= offDiagonal_[size_ - 1] * previous_;
    }
    const double beta = next.norm();
    diagonal_[size_] = alpha;
    offDiagonal_[size_] = beta;
    next /= std::max(beta, std::numeric_limits<double>::min());
    previous_.swap(current_);
    current_.swap(next);
    ++size_;
  }

  int size() const { return size_; }

  /// All directions that the start vector has are found.
  bool exhausted() const {
    return offDiagonal_[size_ - 1] <= 1e-12 * diagonal_.head(size_).maxCoeff();
  }

  RitzValue largest() const { return largestRitzValue(diagonal_, offDiagonal_, size_); }

 private:
  const RestOscillator& oscillator_;
  Eigen::VectorXd diagonal_, offDiagonal_;
  Eigen::Matrix3Xd previous_, current_;
  int size_ = 0;
};

Stability largestEigenvalue(
    const RestOscillator& oscillator, Eigen::Index columns, const StabilityOptions& options) {
  constexpr int kCheckEvery = 8;  // a check costs more than some iterations of a small mesh
  Lanczos lanczos(oscillator, columns, options.maxIterations);
  RitzValue largest;
  bool done = false;
  while (!done) {
    lanczos.advance();
    const bool last = lanczos.exhausted() || lanczos.size() == options.maxIterations;
    if (last || lanczos.size() % kCheckEvery == 0) {
      largest = lanczos.largest();
      done = last || largest.residual <= options.tolerance * largest.value;
    }
  }
  return {
      .largestSquaredFrequency = largest.value + largest.residual, .iterations = lanczos.size()};
}

}  // namespace

void StabilityOptions::validate() const {
  if (!(safety >= 0.01 && safety <= 1.0)) {
    throw std::invalid_argument("StabilityOptions: safety must be within [0.01, 1]");
  }
  if (!(tolerance >= 1e-8 && tolerance <= 0.5)) {
    throw std::invalid_argument("StabilityOptions: tolerance must be within [1e-8, 0.5]");
  }
  if (maxIterations < 1 || maxIterations > 10000) {
    throw std::invalid_argument("StabilityOptions: maxIterations must be within [1, 10000]");
  }
}

Stability stability(const ClothMesh& mesh, const StabilityOptions& options) {
  options.validate();
  const RestOscillator oscillator(mesh);
  Stability result = largestEigenvalue(oscillator, mesh.numVertices(), options);
  result.largestSubstep = result.largestSquaredFrequency > 0.0
                              ? options.safety * 2.0 / std::sqrt(result.largestSquaredFrequency)
                              : std::numeric_limits<double>::infinity();
  return result;
}

int substepsFor(double frameDuration, double largestSubstep) {
  if (!(frameDuration > 0.0) || !(largestSubstep > 0.0)) {
    throw std::invalid_argument("substepsFor: durations must be above 0 s");
  }
  // A frame of exactly n substeps takes n of them, whatever the division rounds to.
  const double count = std::max(1.0, std::ceil(frameDuration / largestSubstep * (1.0 - 1e-9)));
  if (count > 1.0 && frameDuration / count < kShortestSubstep) {
    throw std::invalid_argument(
        "the cloth is so stiff for its mass that it needs substeps of " +
        std::to_string(1e6 * frameDuration / count) +
        " microseconds, too short for single precision; use the implicit integrator, softer or "
        "heavier cloth, or a coarser mesh");
  }
  return static_cast<int>(count);
}

}  // namespace bullet_ext
