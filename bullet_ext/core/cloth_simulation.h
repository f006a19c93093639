#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"
#include "bullet_ext/core/cloth_stepper.h"
#include "bullet_ext/core/energy_balance.h"
#include "bullet_ext/core/external_force.h"
#include "bullet_ext/core/task_chains.h"
#include "bullet_ext/core/thread_team.h"

#include <Eigen/Core>

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace bullet_ext {

/// How a frame is divided.
struct FrameTiming {
  double duration = 1.0 / 30.0;  ///< of the frame [s], 1e-6 … 1
  int substeps = 100;            ///< 1 … 1000000

  double substepDuration() const { return duration / substeps; }

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Something that corrects positions and velocities after every substep: contact with a body, with
/// other cloth, with rigid bodies; a strain limit. What a scene doesn't name isn't there.
class SubstepConstraint {
 public:
  virtual ~SubstepConstraint() = default;

  /// Before the first substep; `states` in the order of the simulation's cloths. Called again when
  /// a frame is redone from its start with other substeps.
  virtual void beginFrame(std::span<const ClothState> states, const FrameTiming& timing) = 0;

  /// After all cloths have moved through substep `substep` (0 …).
  virtual void resolve(std::span<ClothState> states, int substep) = 0;
};

/// One that acts on each cloth by itself, so that cloths needn't wait for each other. Stages of a
/// cloth follow each other, their pieces are resolved in any order or at the same time.
class ClothwiseConstraint : public SubstepConstraint {
 public:
  struct Part {
    int cloth = 0, stage = 0, piece = 0;
  };

  /// Numbers of pieces of a cloth's stages.
  virtual std::vector<int> stages(int cloth) const = 0;
  virtual void resolvePart(const Part& part, ClothState& state, int substep) = 0;

  /// One after the other.
  void resolve(std::span<ClothState> states, int substep) final;
};

/// Where pins are at the end of a frame; on the way they move on straight lines.
struct PinTargets {
  std::vector<int> vertices;   ///< solver order, pins of the mesh
  Eigen::Matrix3Xd positions;  ///< 3 × number of vertices [m]
};

/// What happened in a frame.
struct FrameReport {
  int substeps = 0;  ///< that the frame was done with
  int redone = 0;    ///< times it was rolled back and redone with twice the substeps
  /// false: blown up even with the most substeps. The cloth lost its momentum and what moves it
  /// moved it on through the frame against strong drag; where even that blew up it stayed in place.
  bool stable = true;
  EnergyBalance energy;       ///< of all cloths, in the frame as it was kept
  double largestSpeed = 0.0;  ///< of all vertices at the end [m/s]
};

struct SimulationOptions {
  StepperOptions stepper;
  Integrator integrator = Integrator::kSemiImplicitEuler;
  /// A frame has blown up when a cloth has more than this many times the energy that was there and
  /// that gravity, pins and contact can have put in (EnergyBalance), > 1. What it has too much of
  /// is remembered until it has lost it again, so that cloth cannot gain a little in every frame
  /// either; but a hundredth is forgiven: walking skirts, balls thrown at curtains and the like
  /// stay below 1.01.
  double energyFactor = 1.1;
  int mostRedos = 4;  ///< 0 … 10: substeps are doubled up to this often

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// Cloths that live together: steps all of them through a frame, substep by substep, lets
/// constraints correct them, and takes back a frame that blew up, as its energy shows. Owns cloths
/// and constraints; external forces are the caller's and outlive it. Deterministic for any number
/// of threads.
class ClothSimulation {
 public:
  explicit ClothSimulation(const SimulationOptions& options = {});

  /// A cloth at rest in its rest shape; returns its index.
  int addCloth(ClothMesh mesh);

  void addForce(int cloth, const ExternalForce& force);

  /// Undoes one addForce(); throws std::invalid_argument if there was none.
  void removeForce(int cloth, const ExternalForce& force);

  /// Constraints resolve in the order in which they were added. Those that act on each cloth by
  /// itself share the threads best when they come first.
  void addConstraint(std::unique_ptr<SubstepConstraint> constraint);

  /// Of options.stepper.threads threads, for constraints to share their work out; idle while these
  /// are called.
  ThreadTeam& team() const { return *team_; }

  int numCloths() const { return static_cast<int>(states_.size()); }

  const ClothMesh& mesh(int cloth) const {
    return steppers_[static_cast<std::size_t>(cloth)]->mesh();
  }

  const ClothState& state(int cloth) const { return states_[static_cast<std::size_t>(cloth)]; }

  std::span<const ClothState> states() const { return states_; }

  /// Throws std::invalid_argument for sizes other than the mesh's or values that aren't finite.
  void setState(int cloth, ClothState state);

  void setPinTargets(int cloth, PinTargets targets);

  /// Other damping than the material's from now on, as for fitting.
  void setDamping(int cloth, DampingMode mode, double damping);

  /// Moves everything through a frame.
  FrameReport advance(const FrameTiming& timing);

 private:
  /// States before a frame: to go back to.
  using Snapshot = std::vector<ClothState>;

  /// Which of the energies that constraints change are booked.
  enum class Booking { kKinetic, kWhole };

  /// The states are `before` when it is called.
  FrameReport attemptFrom(const Snapshot& before, const FrameTiming& timing);
  FrameReport attempt(const FrameTiming& timing, Booking booking);
  bool seemsToGain() const;
  FrameReport calmDown(const Snapshot& before, const FrameTiming& timing);
  void runSubsteps(const FrameTiming& timing, Booking booking);
  void setSubsteps(const FrameTiming& timing);
  std::vector<TaskChain> chainsOf(const FrameTiming& timing, Booking booking);
  void appendStep(std::size_t cloth, const FrameTiming& timing, Booking booking, TaskChain& chain);
  void appendConstraint(std::size_t cloth, ClothwiseConstraint& constraint, TaskChain& chain);
  std::size_t numClothwiseFirst() const;
  void bookConstraints(std::size_t cloth, double sign, Booking booking);
  void aimPins(const FrameTiming& timing);
  void placePins(std::size_t cloth);
  double excessAfter(std::size_t cloth) const;
  double negligibleEnergy(std::size_t cloth) const;
  bool isPlausible(std::size_t cloth) const;
  void restore(const Snapshot& snapshot);

  void forEachCloth(const std::function<void(std::size_t)>& task);

  SimulationOptions options_;
  std::unique_ptr<ThreadTeam> team_;  ///< outlives those who use it
  std::vector<std::unique_ptr<ClothIntegrator>> steppers_;
  std::vector<EnergyAccount> accounts_;  ///< one per cloth
  std::vector<EnergyBalance> balances_;  ///< of the last attempt, one per cloth
  std::vector<double> excesses_;         ///< energy from nowhere, not lost again yet, per cloth [J]
  std::vector<ClothState> states_;
  std::vector<std::vector<const ExternalForce*>> forces_;
  std::vector<PinTargets> pinTargets_;
  std::vector<std::unique_ptr<SubstepConstraint>> constraints_;
  int substep_ = 0;  ///< the running one
};

/// Largest speed of a vertex [m/s].
double largestSpeed(const ClothState& state);

}  // namespace bullet_ext
