#pragma once

#include "bullet_ext/core/body_constraint.h"
#include "bullet_ext/core/body_surface.h"
#include "bullet_ext/core/cloth_contact.h"
#include "bullet_ext/core/cloth_simulation.h"
#include "src/scene/scene.h"
#include "src/simulation/stage.h"

#include <Eigen/Core>

#include <memory>
#include <string>
#include <vector>

namespace simulcap {

/// What pre-flight found of a cloth.
struct ClothStability {
  std::string name;
  double largestSubstep = 0.0;  ///< that is stable about the rest shape [s]
};

/// A scene in motion: owns the simulation of a stage's cloths and moves it frame by frame.
class SceneRun {
 public:
  /// Builds only what the scene names. Throws std::runtime_error for a mesh that can't be
  /// simulated, or a number of substeps that pre-flight finds unstable, with the number it needs.
  SceneRun(const Scene& scene, const Stage& stage, int threads);

  const std::vector<ClothStability>& preflight() const { return preflight_; }

  int substepsPerFrame() const { return timing_.substeps; }

  /// Frames since the beginning of the pre-roll; 0 before the first advance().
  int frame() const { return frame_; }

  /// To the next frame.
  bullet_ext::FrameReport advance();

  /// What contact did in the last frame; null where the scene has none.
  const bullet_ext::BodyConstraint* bodyContact() const { return bodyContact_; }

  /// Counters are sums over all frames.
  const bullet_ext::ClothContact* clothContact() const { return clothContact_; }

  /// 3 × N [m], in the order of the stage's mesh.
  Eigen::Matrix3Xd vertices(int cloth) const;

 private:
  void addForces(const Scene& scene);
  void addBody(const Scene& scene);
  void addClothContact(const Scene& scene);
  void checkStability(const Scene& scene);
  void aimPins(const avatar::MeshView* body);

  const Stage& stage_;
  bullet_ext::FrameTiming timing_;
  bullet_ext::ClothSimulation simulation_;
  std::vector<std::unique_ptr<bullet_ext::ExternalForce>> forces_;
  std::unique_ptr<bullet_ext::BodySurface> bodySurface_;     ///< null: nothing to touch
  const bullet_ext::BodyConstraint* bodyContact_ = nullptr;  ///< the simulation's
  const bullet_ext::ClothContact* clothContact_ = nullptr;   ///< the simulation's
  Eigen::Matrix3Xd skin_;                                    ///< of the frame, 3 × V [m]
  std::vector<ClothStability> preflight_;
  int frame_ = 0;
};

}  // namespace simulcap
