#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/camera.h"
#include "avatar/layered_avatar.h"
#include "avatar/skinning.h"
#include "avatar/surface_attachment.h"
#include "bullet_ext/capture_world.h"
#include "src/capture/observed_frame.h"
#include "src/fitting/depth_targets.h"
#include "src/fitting/direct_fit.h"
#include "src/fitting/layer_view.h"
#include "src/fitting/steady_targets.h"
#include "src/fitting/warped_clothes.h"
#include "src/tracking/tracked_body.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// How garments get from frame to frame.
enum class CaptureMethod {
  kSimulcap,      ///< simulated, then fitted to depth
  kSimulateOnly,  ///< simulated
  kSkinning,      ///< follow the body's joints
  kDirectFit,     ///< follow the joints, then stretched onto depth without physics
  kNonrigidIcp,   ///< warped by a graph of nodes each: the paper's multi-layer baseline
  kSingleSurface  ///< the dressed person as one surface warped by a graph, after DoubleFusion
};

/// "simulcap", "simulate-only", "skinning", "direct-fit", "nonrigid-icp", "single-surface", in the
/// order of the enumeration.
const std::vector<std::string>& captureMethodNames();

struct CaptureOptions {
  CaptureMethod method = CaptureMethod::kSimulcap;
  /// Of the simulation [s], 1e-5 … 1e-2; this and the fit's are shortened where the cloth wouldn't
  /// bear them.
  double substepDuration = 1.0 / 1500.0;
  int fitRounds = 2;           ///< correspondences are looked for anew in each, 1 … 100
  int fitIterations = 15;      ///< substeps in each round, 1 … 1000
  double fitSubstep = 0.0007;  ///< [s], 1e-5 … 1e-2
  LayerViewOptions view;
  DepthTargetOptions targets;
  SteadyTargetOptions steadiness;
  /// Gentler than the paper's (γ = 240/m, η = 0.34 N). That throws vertices by centimetres in one
  /// substep, which ends elsewhere for every noise: cloth of a standing person shook by 1.3 mm per
  /// frame instead of 0.5, single edges stretched by 56 % instead of 20, and what it was nearer to
  /// the truth where seen was 0.5 mm.
  bullet_ext::DepthForceOptions force = {.gamma = 60.0, .eta = 0.2};
  DirectFitOptions direct;  ///< for kDirectFit, in fitRounds rounds
  WarpOptions warp;         ///< for kNonrigidIcp and kSingleSurface
  /// Part of a garment's momentum relative to the body that is left after 1/30 s, where it isn't
  /// seen and where it is fitted fully, 0 … 1. A fit strains cloth, which would throw itself back
  /// in the next frame, and be fitted again: frame by frame it gets energy from nowhere. Air takes
  /// more of a swinging cloth's momentum than the paper's damping of 0.1/s as well.
  double hiddenMomentum = 0.9;
  double fittedMomentum = 0.2;
  bool pullAlongNormals = true;  ///< else along the rays, as in the paper
  /// By which part of their length edges may be longer than at rest, 0.001 … 10; none: as their
  /// springs let them. Provot's 10 %, whose scheme the paper extends.
  std::optional<double> strainLimit = 0.1;
  bool garmentContact = true;    ///< garments don't pass through each other
  double dressingSeconds = 1.0;  ///< simulated from the A-pose to the first pose, 0 … 10

  /// SimulCap's own: 100 + 100 substeps, eq. (3) as printed, clamped, along the rays; no filter
  /// over time, no strain limit, all momentum kept.
  static CaptureOptions literal();

  /// Throws std::invalid_argument that names the field outside its range.
  void validate() const;
};

/// A person and its clothes as they go into a capture. The body is the model's; `avatar` may have
/// details of its own, when it has the model's vertices.
struct CapturePerson {
  const avatar::BodyModel& model;
  const avatar::LayeredAvatar& avatar;
};

/// Wall time of the stages of one frame [ms].
struct FrameTimes {
  double simulation = 0.0;  ///< the body's surface included
  double fitting = 0.0;     ///< what the camera sees included
};

struct CapturedGarment {
  Eigen::Matrix3Xd unfitted;             ///< 3 × N [m], in the world, before depth came in
  Eigen::Matrix3Xd vertices;             ///< 3 × N [m], in the world
  std::vector<std::uint8_t> visible;     ///< N: 1 = the camera sees it, unfitted
  std::vector<std::uint8_t> provenance;  ///< N: 0 simulated … 255 fitted to depth
  RejectedTargets rejected;              ///< of the last look for targets; zeros without a fit
};

struct CaptureResult {
  avatar::BodyPose pose;
  TrackingStatus status = TrackingStatus::kTracked;
  Eigen::Matrix3Xd bodyVertices;  ///< 3 × V [m]
  std::vector<CapturedGarment> garments;
  FrameTimes times;
  bool stable = true;  ///< false: the cloth blew up and stands still
};

/// All that the session remembers from frame to frame, so that a capture can be resumed.
struct CaptureState {
  struct Garment {
    Eigen::Matrix3Xd positions;   ///< 3 × N [m]
    Eigen::Matrix3Xd velocities;  ///< 3 × N [m/s]
    Eigen::Matrix3Xd followed;    ///< 3 × N [m]: where the joints alone would have it
    Eigen::VectorXf offsets;      ///< N: SteadyTargets::state()
  };

  Eigen::Matrix3Xd bodyVertices;  ///< 3 × V [m]; 3 × 0: before the first frame
  std::vector<Garment> garments;
  std::vector<Eigen::MatrixXd> warps;  ///< WarpedClothes::state(); none with other methods
};

/// Captures a dressed person's clothes frame by frame (SimulCap 4.2): simulate on the moving body,
/// then fit to depth as a physical process. Same calls, same results for any number of threads.
class CaptureSession {
 public:
  /// The camera is in the capture's world. Keeps references to the person. Throws
  /// std::invalid_argument for invalid options or an avatar that doesn't fit the model,
  /// std::runtime_error for a garment that can't be simulated.
  CaptureSession(
      const CapturePerson& person,
      const avatar::Camera& camera,
      const CaptureOptions& options,
      int threads);
  ~CaptureSession();
  CaptureSession(const CaptureSession&) = delete;
  CaptureSession& operator=(const CaptureSession&) = delete;
  CaptureSession(CaptureSession&&) = delete;
  CaptureSession& operator=(CaptureSession&&) = delete;

  /// The next frame. In the first one the person is dressed, unless it is already. A lost body is
  /// believed, but nothing is fitted.
  CaptureResult processFrame(const ObservedFrame& frame);

  /// Simulates the clothes from the pose they were made in to this one.
  void dress(const avatar::BodyPose& pose);

  CaptureState state() const;

  /// To go on from where a session of the same person, camera and options stood. The world is made
  /// anew, so that all that do this go on the same way: this session too, whose contacts remember
  /// more than a state says.
  void restore(const CaptureState& state);

 private:
  struct Layer;

  bullet_ext::CaptureSetup captureSetup(int threads) const;
  avatar::SurfaceAttachment attachedPins(const avatar::Garment& garment) const;
  Eigen::Matrix3Xd bodySurface(const avatar::BodyPose& pose) const;
  Eigen::Matrix3Xd skinned(int garment, const avatar::BodyPose& pose) const;
  bool simulate(const Eigen::Matrix3Xd& body, double duration);
  void follow(const avatar::BodyPose& pose);
  void calm(const ObservedFrame& frame, const std::vector<GarmentTargets>& targets);
  void takeWarped();
  bool moveGarments(const ObservedFrame& frame, const Eigen::Matrix3Xd& body);
  std::vector<GarmentView> view(const Eigen::Matrix3Xd& body);
  std::vector<GarmentTargets> fit(
      const ObservedFrame& frame, const std::vector<GarmentView>& views);
  std::vector<GarmentTargets> fitPhysically(
      const ObservedFrame& frame, const std::vector<GarmentView>& views);
  std::vector<GarmentTargets> fitDirectly(
      const ObservedFrame& frame, const std::vector<GarmentView>& views);
  std::vector<GarmentTargets> findTargets(
      const std::vector<GarmentView>& views, const DepthCloud& cloud) const;
  void pull(const std::vector<GarmentTargets>& targets);
  int substepsFor(double duration) const;

  CapturePerson person_;
  avatar::Camera camera_;
  CaptureOptions options_;
  avatar::Skinning skinning_;
  avatar::ShapedBody shaped_;
  bullet_ext::CaptureSetup setup_;
  std::unique_ptr<bullet_ext::CaptureWorld> world_;
  LayerViewer viewer_;
  std::vector<Layer> layers_;
  std::unique_ptr<WarpedClothes> warped_;  // null with methods that don't warp
  double largestSubstep_ = 0.0;            // that every garment bears [s]
  bool dressed_ = false;
  Eigen::Matrix3Xd bodyVertices_;  // of the last frame
};

/// The person with its clothes as they hang on it where it stands still in the pose they were made
/// in, simulated: nearer to what a camera sees than clothes as they were cut. Digitized clothes,
/// which were seen as they hang, stay as they are. `seconds` are simulated, momentum fading. Throws
/// as a session does.
avatar::LayeredAvatar draped(const CapturePerson& person, int threads, double seconds = 0.5);

}  // namespace simulcap
