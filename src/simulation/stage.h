#pragma once

#include "avatar/body_model.h"
#include "avatar/geometry/mesh.h"
#include "avatar/layered_avatar.h"
#include "avatar/motion.h"
#include "avatar/skinning.h"
#include "avatar/surface_attachment.h"
#include "src/scene/scene.h"
#include "src/simulation/procedural_cloth.h"

#include <Eigen/Core>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// Offsets of a body's rest shape in a pose, 3 × V [m].
using SoftTissue = std::function<Eigen::Matrix3Xd(const avatar::BodyPose&)>;

struct StageOptions {
  double settleSeconds = 0.0;  ///< of standing still at the beginning of the pre-roll [s], ≥ 0
  /// Offsets of the skin of a shaped body, which grow from nothing while clothes settle; or empty.
  std::function<SoftTissue(const avatar::BodyModel&, const avatar::ShapedBody&)> softTissue;
};

/// The person of a scene, frame by frame.
class StagedBody {
 public:
  /// Throws avatar::FileError for files that can't be used.
  StagedBody(const SceneBody& body, const SceneTime& time, const StageOptions& options = {});

  const avatar::BodyModel& model() const { return *model_; }

  const avatar::ShapedBody& shaped() const { return shaped_; }

  const Eigen::VectorXd& betas() const { return betas_; }

  /// What happens before frame 0: clothes, put on in the A-pose, settle, then the body moves on to
  /// the first pose.
  /// Frames are counted from there on.
  int numPrerollFrames() const { return numPrerollFrames_; }

  /// Poses of the pre-roll and of all frames, at the scene's rate.
  const std::vector<avatar::BodyPose>& poses() const { return poses_; }

  /// 3 × V [m].
  Eigen::Matrix3Xd vertices(int frame) const;

  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void loadSoftTissue(const std::string& path);

  std::unique_ptr<const avatar::BodyModel> model_;
  std::unique_ptr<const avatar::Skinning> skinning_;
  Eigen::VectorXd betas_;
  avatar::ShapedBody shaped_;
  std::vector<avatar::BodyPose> poses_;
  int numPrerollFrames_ = 0;
  std::vector<Eigen::Matrix3Xd> recordedTissue_;  // per frame, added to the rest shape [m]; or none
  SoftTissue softTissue_;                         // the same from the pose; or empty
  int numSettleFrames_ = 0;
  std::vector<std::string> warnings_;
};

/// A piece of cloth as the simulation takes it: N vertices.
struct StagedCloth {
  std::string name;
  avatar::TriangleMesh rest;  ///< rest shape
  Eigen::Matrix3Xd start;     ///< 3 × N [m]: where it is at the beginning
  avatar::ClothParameters parameters;
  std::vector<int> pins;  ///< ascending
  Eigen::Vector3d color = {0.45, 0.55, 0.70};

  /// How pins move: with the skin (worn cloth), with the twist, or not at all.
  std::optional<avatar::SurfaceAttachment> attachment;
  std::optional<ProceduralCloth> twistedCloth;
  Eigen::Isometry3d worldFromLocal = Eigen::Isometry3d::Identity();
  Twist twist;
};

/// A scene, made: everything that a simulation starts from.
struct Stage {
  double framesPerSecond = 30.0;
  int numFrames = 1;                            ///< without the pre-roll
  int numPrerollFrames = 0;                     ///< simulated before frame 0 and not shown
  std::unique_ptr<StagedBody> body;             ///< null: none
  std::optional<avatar::LayeredAvatar> avatar;  ///< the body and what it wears
  std::vector<StagedCloth> cloths;              ///< inner ones first
  std::vector<std::string> notes;               ///< what was found and mended
};

/// Makes body, motion and cloth of a scene. Throws avatar::FileError for files that can't be used,
/// std::runtime_error for what the scene asks and can't be done.
Stage setStage(const Scene& scene, const StageOptions& options = {});

/// A scene of an avatar's clothes on a body, whose garments have the names and parameters of the
/// avatar's.
Scene sceneOf(const avatar::LayeredAvatar& avatar, const SceneBody& body, const SceneTime& time);

/// As setStage(), of a scene made by sceneOf(), whose body wears the avatar's garments as they are.
Stage setStage(const Scene& scene, avatar::LayeredAvatar avatar);

/// 3 × number of pins [m] at a time from the beginning of the pre-roll [s]; `body` as it is then,
/// null without one.
Eigen::Matrix3Xd pinPositions(
    const StagedCloth& cloth, double seconds, const avatar::MeshView* body);

}  // namespace simulcap
