#pragma once

#include "avatar/digitization/posed_frame.h"
#include "avatar/skinning.h"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace avatar {

struct FrameParsingOptions {
  int seedFrames = 8;         ///< evenly spread frames that the colours are learned from, ≥ 1
  int colorsPerClass = 4000;  ///< that are learned from, at most, ≥ 100
  int rounds = 2;             ///< of learning from what was labelled, 0 … 10
  double sameColor = 0.75;    ///< colours told apart less often than this are the same, 0.5 … 1
  bool onePiece = false;      ///< upper and lower garment are one, a dress or an overall
  LoopRunner runLoop = runSerially;

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// What somebody wears, as far as colours tell.
struct FrameParsing {
  std::vector<std::vector<std::uint8_t>> labels;  ///< W·H SurfaceLabel per frame
  bool onePiece = false;                          ///< upper and lower are labelled as upper
  std::vector<std::string> warnings;
};

/// Labels every pixel of the person as skin, upper or lower garment (paper section 3; formulation
/// A7). Frames with labels of their own keep them and teach the colours
/// and what each part of the body wears; without any, the tracked
/// body's parts do: face and hands are skin, the chest wears the upper garment, the thighs the
/// lower one. K-means models of each class's colours and the parts' priors label the rest.
///
/// Throws std::runtime_error, saying what to do, without colours and labels, or when upper and
/// lower garment have the same colour and the legs are apart: then nothing tells where one ends.
FrameParsing parsedFrames(
    const std::vector<PosedDepthFrame>& frames,
    const Skinning& skinning,
    const Eigen::VectorXd& betas,
    const FrameParsingOptions& options = {});

}  // namespace avatar
