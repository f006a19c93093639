#include "src/live/live_turn.h"

#include "avatar/io/file_error.h"
#include "avatar/skinning.h"
#include "src/capture/tracked_recording.h"
#include "src/digitization/turn.h"
#include "src/input/kept_frames.h"
#include "src/live/live_session.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace simulcap {
namespace {

/// 13 s, or 0.8 GB at 640×480 pixels: slower turns are cut off.
constexpr std::size_t kMostFrames = 400;
constexpr double kBegun = 15.0;  // who has turned so far means it [deg]

std::string captionOf(const TrackedFrame& frame, double degrees, double whole) {
  char text[160];
  std::snprintf(
      text,
      sizeof text,
      "frame %d: turn round once, slowly, arms a little away from the body: %.0f of %.0f degrees%s",
      frame.picture.index,
      degrees,
      whole,
      frame.observed.body.status == TrackingStatus::kLost ? ", body lost" : "");
  return text;
}

}  // namespace

LiveTurn::LiveTurn(
    std::shared_ptr<FrameSource> source,
    const std::string& name,
    const avatar::BodyModel& model,
    const LiveTurnOptions& options)
    : source_(std::move(source)), name_(name), model_(model), options_(options) {}

void LiveTurn::run(LiveFeed& feed) {
  auto keeping = std::make_unique<KeepingSource>(source_, kMostFrames);
  KeepingSource& kept = *keeping;
  TrackedRecording frames(std::move(keeping), name_, {model_, {}, {}}, {});
  const avatar::Skinning skinning(model_);
  const std::optional<int> given =
      options_.frames ? options_.frames : source_->info().turnaroundFrames;
  const auto aSecond =
      static_cast<std::size_t>(std::max(1.0, std::ceil(source_->info().framesPerSecond)));
  TurnedAngle turned;
  bool any = false;
  for (auto frame = frames.next(); frame && !feed.stopped();
       frame = frames.next(std::move(*frame))) {
    if (!any)
      feed.begin(frames.camera());
    any = true;
    turned.add(frame->observed.body.pose);
    if (!given && turned.degrees() < kBegun)
      kept.forget(aSecond);
    const bool whole =
        given ? frame->picture.index + 1 >= *given : turned.degrees() >= options_.wholeTurn;
    const bool done =
        whole || (turned.degrees() >= kBegun && kept.kept().frames.size() >= kMostFrames);
    feed.publish(
        {.body = skinning.pose(skinning.shape(frames.betas()), frame->observed.body.pose).vertices,
         .garments = {},
         .points = personPoints(frame->observed.cloud, frames.camera()),
         .caption = done ? "that will do: the avatar is being made"
                         : captionOf(*frame, turned.degrees(), options_.wholeTurn)});
    if (done)
      break;
  }
  if (!any)
    throw avatar::FileError(
        name_, "", "nobody was found; expected an upright person, 0.3 to 8 m from the camera");
  auto turn = std::make_shared<KeptFrames>(kept.kept());
  turn->info.turnaroundFrames = static_cast<int>(turn->frames.size());
  turn_ = supplyOf(std::move(turn), name_);
}

FrameSupply LiveTurn::frames() const {
  return turn_;
}

}  // namespace simulcap
