#pragma once

#include "src/evaluation/ground_truth.h"
#include "src/evaluation/label_overlap.h"
#include "src/evaluation/moving_surface.h"

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <string>
#include <vector>

namespace simulcap {

/// The layers of a captured person.
struct CapturedLayers {
  struct Garment {
    std::string name;
    Eigen::Matrix3Xi faces;  ///< 3 × F
  };

  Eigen::Matrix3Xi bodyFaces;  ///< 3 × F
  std::vector<Garment> garments;
};

/// A frame of a captured person, in the camera's frame [m].
struct CapturedFrame {
  int number = 0;                          ///< within the recording
  Eigen::Matrix3Xd body;                   ///< 3 × V
  Eigen::Matrix3Xd joints;                 ///< 3 × J
  std::vector<Eigen::Matrix3Xd> garments;  ///< 3 × V each, in the layers' order
  std::vector<Eigen::Matrix3Xd> skinned;   ///< the same garments moved by the body alone
};

/// What is seen of a captured frame, and whether the true person stood still in it.
struct CapturedView {
  std::vector<std::vector<bool>> garmentsVisible;  ///< an entry per vertex of each garment
  bool still = false;  ///< the truth moved less than a quarter of a millimetre since the last frame
};

/// What a captured and a true body have in common.
struct CommonBody {
  bool joints = false;    ///< the same definition of the joints
  bool vertices = false;  ///< vertex by vertex the same places of the body
};

/// Figures of `ground_truth` in metrics.json, frame by frame (interfaces: "Output folder").
///
/// Garments are compared with those of the same name; a remaining one with the nearest that remains
/// in the first frame. What is visible is decided by the truth: the whole true person, body
/// included, seen from the true camera.
class TruthComparison {
 public:
  /// Keeps a reference to the truth.
  TruthComparison(GroundTruth& truth, CapturedLayers layers, CommonBody common, int threads);

  /// Frames in ascending order. Throws avatar::FileError, std::out_of_range as
  /// GroundTruth::frame().
  CapturedView add(const CapturedFrame& frame);

  /// Figures without a measurement are absent.
  nlohmann::json figures() const;

  /// What could not be compared, or is compared under another name: one line each.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Pair {
    std::size_t truth = 0, ours = 0;  // garments
    MovingSurface trueSurface, ourSurface, skinnedSurface;
  };

  void begin(const CapturedFrame& frame, const TrueFrame& truth);
  void pairGarments(const CapturedFrame& frame, const TrueFrame& truth);
  void move(const CapturedFrame& frame, const TrueFrame& truth);
  void addBody(const CapturedFrame& frame, const TrueFrame& truth);
  void addLabels(const CapturedFrame& frame);
  bool stoodStill(const TrueFrame& truth, int number);

  GroundTruth& truth_;
  CapturedLayers layers_;
  CommonBody common_;
  int threads_;
  std::vector<std::string> notes_;

  std::vector<Pair> pairs_;
  std::optional<MovingSurface> truePerson_, ourPerson_;  // all layers: garments, then the body
  std::optional<MovingSurface> trueBody_, ourBody_;      // without common vertices
  std::vector<PixelLabel> labels_;                       // of our garments, then the body
  TrueFrame lastTruth_;
  int lastNumber_ = -2;

  Distribution jointErrors_{0.05}, outerErrors_{0.05};
  SurfaceErrors bodyErrors_, garmentErrors_, skinnedErrors_;  // the body's: all as visible
  LabelOverlap labelOverlap_;
};

/// {mean, median, p95, max} of a distribution.
nlohmann::json distributionJson(const Distribution& values);

}  // namespace simulcap
