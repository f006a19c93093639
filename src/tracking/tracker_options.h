#pragma once

#include "avatar/pose_prior.h"

#include <Eigen/Core>

#include <optional>

namespace simulcap {

/// How a body is tracked; the energy is eq. (1), E = λ_data E_data + λ_inter E_inter + λ_pri E_pri.
struct TrackerOptions {
  int iterations = 6;          ///< Gauss–Newton steps per frame, 1 … 50
  int numSamples = 1500;       ///< body vertices that look for depth, 100 … 20000
  int numDepthSamples = 1200;  ///< pixels of the person that look for the body, 100 … 50000

  double dataWeight = 1.0;         ///< λ_data, > 0
  double firstInterWeight = 1.0;   ///< λ_inter of the first three iterations, ≥ 0
  double laterInterWeight = 10.0;  ///< λ_inter from then on, ≥ 0; both 0: E_inter is off
  double priorWeight = 0.01;       ///< λ_pri, ≥ 0

  double clothOffset = 0.005;  ///< σ of eq. (2): the body stays this far behind cloth [m], ≥ 0
  double firstGate = 0.20;     ///< matches of the first iteration are nearer than this [m], > 0
  double lastGate = 0.12;      ///< of the last one; between them geometric [m], > 0

  /// Height of the floor in the world [m]; absent: none known, no foot contact.
  std::optional<double> floorHeight;
  /// The poses found have no arm in the trunk: see armsApart(). Tracking goes on from where depth
  /// has them.
  bool armsApart = false;
  /// How the person leans on the whole, see avatar::lean() [rad]: poses are held near it. Absent:
  /// isn't known.
  std::optional<Eigen::Vector3d> usualLean = {};
  /// Betas are estimated along with the pose until setBetas() or holdBetas(). Off: they stay 0.
  bool estimateShape = true;
  /// Absent: the prior that comes with the program.
  std::optional<avatar::GaussianMixture> posePrior;

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

}  // namespace simulcap
