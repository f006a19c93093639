#pragma once

#include "avatar/body_model.h"
#include "src/input/frame_source.h"
#include "src/live/live_feed.h"

#include <memory>
#include <optional>
#include <string>

namespace simulcap {

struct LiveTurnOptions {
  std::optional<int> frames;  ///< that the turn takes up, ≥ 1; absent: until it is whole
  double wholeTurn = 330.0;   ///< [deg], as of TurnOptions
};

/// Follows a person that turns round before a source, and keeps the frames of it.
class LiveTurn {
 public:
  /// Keeps a reference to the model. `name` is what errors call the source.
  LiveTurn(
      std::shared_ptr<FrameSource> source,
      const std::string& name,
      const avatar::BodyModel& model,
      const LiveTurnOptions& options);

  /// A feed's work: until the turn is whole, the frames end or the feed is stopped. What came
  /// before the person began to turn is forgotten but for a second of it. Throws avatar::FileError
  /// when nobody was found.
  void run(LiveFeed& feed);

  /// Once run() has ended: the turn, to be digitized.
  FrameSupply frames() const;

 private:
  std::shared_ptr<FrameSource> source_;
  std::string name_;
  const avatar::BodyModel& model_;
  LiveTurnOptions options_;
  FrameSupply turn_;
};

}  // namespace simulcap
