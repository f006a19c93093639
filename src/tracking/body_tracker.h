#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"
#include "avatar/geometry/camera.h"
#include "src/input/depth_cloud.h"
#include "src/tracking/outer_layer.h"
#include "src/tracking/tracked_body.h"
#include "src/tracking/tracker_options.h"
#include "src/tracking/unseen_joints.h"

#include <Eigen/Core>

#include <memory>

namespace simulcap {

/// All that a tracker remembers from frame to frame; plain data, so that a capture can be resumed.
struct TrackerState {
  int framesTracked = 0;         ///< 0: not started yet
  int framesLost = 0;            ///< in a row, up to now
  avatar::BodyPose pose;         ///< of the last frame
  avatar::BodyPose before;       ///< of the one before
  double timestamp = 0.0;        ///< of the last frame [s]
  double timestampBefore = 0.0;  ///< of the one before [s]
  Eigen::VectorXd betas;         ///< B, and what is unknown of the clothes as in BodyParameters
  /// What the frames so far say about them (inverse covariance, relative to the weights of the
  /// energy), the poses eliminated.
  Eigen::MatrixXd betaInformation;
  /// kBetas × kBetas: what the frames so far say about the pose, see pose_uncertainty.h.
  Eigen::MatrixXd poseInformation;
  bool betasHeld = false;
  UnseenSeconds unseenSeconds = {};
  /// Of the body's samples, see learnedBareness(); unused with an outer layer.
  Eigen::VectorXd bareness;
  Eigen::VectorXd clothOffsets;  ///< of the samples, see learnedOffsets()
};

/// Follows the undressed body of one person through the depth frames of one camera (section 4.1):
/// ICP by Gauss–Newton on pose and translation, analytic derivatives, Geman–McClure weights.
///
/// The first frame with a person starts it, in any upright pose and facing anywhere; until the
/// betas are known they are estimated along. Without labels in the cloud, skin is bare where the
/// outer layer leaves it so, or, without one, where depth shows it in time (learnedBareness()).
/// Same calls, same results, bit by bit.
class BodyTracker {
 public:
  /// The camera is in the capture's world (Y up) and stays where it is. Keeps a reference to the
  /// model, which must have SMPL's 24 joints first. Throws std::invalid_argument on an invalid
  /// model, camera or options.
  BodyTracker(
      const avatar::BodyModel& model,
      const avatar::Camera& camera,
      const TrackerOptions& options = {});
  ~BodyTracker();
  BodyTracker(BodyTracker&&) noexcept;
  BodyTracker& operator=(BodyTracker&&) noexcept;
  BodyTracker(const BodyTracker&) = delete;
  BodyTracker& operator=(const BodyTracker&) = delete;

  /// The next frame; `timestamp` [s] increases from call to call. An empty cloud, one without a
  /// person or one that the body can't be found in gives kLost and a predicted pose. Throws
  /// std::invalid_argument when the cloud's size isn't the camera's or time doesn't increase.
  TrackedBody track(const DepthCloud& cloud, double timestamp);

  /// Of the body, as estimated so far or as given.
  Eigen::VectorXd betas() const;

  /// kNumClothRegions entries, as estimated so far; none unless they are what is unknown of the
  /// outer layer.
  Eigen::VectorXd clothWidths() const;

  /// The person's shape is known: no longer estimated. Throws std::invalid_argument for more
  /// entries than the model has, or values that are not finite.
  void setBetas(const Eigen::VectorXd& betas);

  /// The estimate is good enough: the betas stay as they are.
  void holdBetas();

  /// From now on the clothes are looked for as well as the body. Its weights must have the model's
  /// joints (std::invalid_argument).
  void setOuterLayer(const OuterLayer& layer);

  /// To go on from where another tracker of the same model, camera and options stood
  /// (std::invalid_argument for a state of other sizes).
  const TrackerState& state() const;
  void restore(const TrackerState& state);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace simulcap
