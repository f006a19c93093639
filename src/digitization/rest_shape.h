#pragma once

#include "src/capture_session.h"

#include <Eigen/Core>

#include <functional>
#include <string>
#include <vector>

namespace simulcap {

struct RestShapeOptions {
  int rounds = 6;        ///< settlings at most, 1 … 50
  double step = 0.8;     ///< share of a round's drift that the rest shape is moved by, (0, 1]
  double seconds = 1.0;  ///< of settling in each round, 0.1 … 10
  int threads = 1;
  std::function<void(int round)> onRound = {};  ///< called before each, from 0

  /// Throws std::invalid_argument when a value is out of its range.
  void validate() const;
};

/// How far a garment moves when it settles, mean over its vertices [m].
struct SettlingDrift {
  std::string garment;
  double asWorn = 0.0;    ///< from the captured shape, which has the captured shape as rest shape
  double desagged = 0.0;  ///< from the captured shape, with the rest shape that was found
};

struct DesaggedAvatar {
  avatar::LayeredAvatar avatar;
  std::vector<SettlingDrift> drift;  ///< per garment
};

/// Garments that hang as they were captured when gravity has had its part. What a camera sees hangs
/// already: taken for a rest shape it would sag once more. The rest shape r of a captured shape c
/// is found by the fixed point r ← r + step (c − settled(r)), r − c smoothed, all layers together,
/// in the pose they were made in; the rounds' best shape is kept for each garment, and where none
/// hangs nearer than the captured one, that. Garments whose rest shape was found are as cut, no
/// longer as worn; they keep off the skin and inner layers as before. Throws as a session does.
DesaggedAvatar desagged(const CapturePerson& person, const RestShapeOptions& options = {});

/// The same for a capture, which shows garments as they were worn: their rest shapes alone. Empty
/// where no garment is as worn.
std::vector<Eigen::Matrix3Xd> restShapes(
    const CapturePerson& person, const RestShapeOptions& options = {});

}  // namespace simulcap
