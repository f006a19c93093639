#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/camera.h"
#include "avatar/layered_avatar.h"
#include "avatar/skinning.h"
#include "avatar/surface_attachment.h"
#include "bullet_ext/capture_world.h"
#include "src/capture/capture_options.h"
#include "src/capture/observed_frame.h"
#include "src/fitting/depth_targets.h"
#include "src/fitting/layer_view.h"
#include "src/fitting/steady_targets.h"
#include "src/fitting/warped_clothes.h"
#include "src/tracking/tracked_body.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// A person and its clothes as they go into a capture. The body is the model's; `avatar` may have
/// details of its own, when it has the model's vertices.
struct CapturePerson {
  const avatar::BodyModel& model;
  const avatar::LayeredAvatar& avatar;
  /// Of the garments, 3 × N each [m], in their bind poses; empty: their meshes.
  std::vector<Eigen::Matrix3Xd> restShapes = {};
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
  bool stable = true;  ///< false: the cloth blew up and was put on anew
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
  avatar::BodyPose pose;          ///< of the last frame
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
  /// believed, but nothing is fitted, and it carries the clothes with it, as does one that was
  /// found again: nobody moves as it jumps.
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
  double carry(const ObservedFrame& frame);
  bool simulate(const Eigen::Matrix3Xd& body, double duration);
  void wear(const avatar::BodyPose& pose);
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
  void forEachLayer(const std::function<void(std::size_t)>& task) const;
  std::vector<GarmentTargets> findTargets(
      const std::vector<GarmentView>& views, const DepthCloud& cloud) const;
  void pull(const std::vector<GarmentTargets>& targets, bool goesOn);
  int substepsFor(double duration) const;

  CapturePerson person_;
  avatar::Camera camera_;
  CaptureOptions options_;
  int threads_;
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
  avatar::BodyPose pose_;          // the same
};

/// The person with its clothes as they hang on it where it stands still in the pose they were made
/// in, simulated: nearer to what a camera sees than clothes as they were cut. Digitized clothes,
/// which were seen as they hang, stay as they are. `seconds` are simulated, momentum fading. Throws
/// as a session does.
avatar::LayeredAvatar draped(const CapturePerson& person, int threads, double seconds = 0.5);

}  // namespace simulcap
