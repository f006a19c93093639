#include "src/digitization/turn.h"

#include "avatar/io/file_error.h"
#include "avatar/motion.h"
#include "src/capture/tracked_recording.h"
#include "src/tracking/cloth_shapes.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// The angle in (−π, π] that differs by whole turns.
double shortest(double angle) {
  return std::remainder(angle, 2.0 * std::numbers::pi);
}

Eigen::AlignedBox2i personBox(const DepthCloud& cloud) {
  Eigen::AlignedBox2i box;
  for (int y = 0; y < cloud.height; ++y) {
    for (int x = 0; x < cloud.width; ++x) {
      if (cloud.person[cloud.index(x, y)] != 0)
        box.extend(Eigen::Vector2i(x, y));
    }
  }
  return box;
}

/// What the first pass over a turn learns.
struct FirstPass {
  int count = 0;  // frames of the recording that the turn takes up
  Eigen::VectorXd betas;
};

class TurnTracking {
 public:
  TurnTracking(
      const FrameSupply& recording, const avatar::BodyModel& model, const TurnOptions& options)
      : recording_(recording), model_(model), options_(options) {}

  /// Tracks until the turn is whole and learns the shape on the way.
  FirstPass learn() {
    TrackedRecording frames = tracked({.model = model_, .betas = options_.betas}, options_.frames);
    const std::optional<int> given =
        options_.frames ? options_.frames : frames.info().turnaroundFrames;
    const int limit = std::min(given.value_or(frames.numFrames()), frames.numFrames());
    TurnedAngle turned;
    FirstPass result;
    for (std::optional<TrackedFrame> frame = frames.next(); frame;
         frame = frames.next(std::move(*frame))) {
      result.count = frame->ordinal + 1;
      addTimes(*frame);
      progress(result.count, 2 * limit);
      turned.add(frame->observed.body.pose);
      const bool whole = !given && turned.degrees() >= options_.wholeTurn;
      if (whole || result.count >= limit)
        break;
    }
    turn_.warnings = frames.warnings();
    if (result.count == 0)
      throw avatar::FileError(
          recording_.name,
          "",
          "nobody was found in " + std::to_string(frames.framesLeftOut()) +
              " frames; expected an upright person, 0.3 to 8 m from the camera");
    result.betas = frames.betas();
    return result;
  }

  /// The clothes as wide as they turn out to be over the turn.
  std::optional<OuterLayer> fitted(const KnownPerson& person, int count) {
    const std::optional<OuterLayer>& clothes = person.clothes;
    if (!clothes || clothes->unknown != ClothUnknown::kWidths)
      return clothes;
    TrackedRecording frames = tracked(person, count);
    for (std::optional<TrackedFrame> frame = frames.next(); frame;
         frame = frames.next(std::move(*frame))) {
      addTimes(*frame);
      progress(frame->ordinal + 1, 2 * count);
    }
    return widened(*clothes, frames.clothWidths());
  }

  Turn keep(const KnownPerson& person, int count) {
    turn_.betas = person.betas;
    turn_.framesTaken = count;
    TrackedRecording frames = tracked(person, count);
    const int kept = std::min(count, options_.mostFrames);
    std::vector<double> headings;
    for (std::optional<TrackedFrame> frame = frames.next(); frame;
         frame = frames.next(std::move(*frame))) {
      turn_.camera = frames.camera();
      addTimes(*frame);
      ++turn_.framesRead;
      progress(count + frame->ordinal + 1, 2 * count);
      if (frame->observed.body.status == TrackingStatus::kLost) {
        ++turn_.framesLost;
        continue;
      }
      headings.push_back(relativeHeading(frame->observed.body.pose));
      // Every frame's number of kept ones before it: they are evenly spread.
      const auto place = [&](int ordinal) { return ordinal * kept / count; };
      if (place(frame->ordinal) == place(frame->ordinal - 1) && frame->ordinal > 0)
        continue;
      turn_.numbers.push_back(frame->picture.index);
      turn_.frames.push_back(posedFrame(
          turn_.camera, frame->picture, frame->observed.cloud, frame->observed.body.pose));
    }
    turn_.degreesSeen = seenSides(headings);
    return std::move(turn_);
  }

 private:
  TrackedRecording tracked(const KnownPerson& person, int count) const {
    return tracked(
        {.model = model_,
         .betas = person.betas,
         .outer = person.clothes,
         .usualLean = person.usualLean},
        count);
  }

  TrackedRecording tracked(const TrackedPerson& person, std::optional<int> count) const {
    return {recording_.open(), recording_.name, person, {.first = 0, .count = count}};
  }

  void addTimes(const TrackedFrame& frame) {
    turn_.inputSeconds += 1e-3 * frame.inputMs;
    turn_.trackingSeconds += 1e-3 * frame.trackingMs;
  }

  void progress(int done, int total) const {
    if (options_.progress)
      options_.progress(done, total);
  }

  /// To the direction in which the camera sees the person.
  double relativeHeading(const avatar::BodyPose& pose) const {
    const Eigen::Vector3d toCamera = avatar::centre(turn_.camera) - pose.translation;
    return shortest(avatar::heading(pose) - std::atan2(toCamera.x(), toCamera.z()));
  }

  FrameSupply recording_;
  const avatar::BodyModel& model_;
  TurnOptions options_;
  Turn turn_;
};

}  // namespace

void TurnOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("TurnOptions: ") + what);
  };
  demand(!frames || *frames >= 1, "frames is expected at 1 or above");
  demand(mostFrames >= 2, "mostFrames is expected at 2 or above");
  demand(!betas || betas->allFinite(), "betas are expected to be finite");
  demand(wholeTurn >= 1.0 && wholeTurn <= 360.0, "wholeTurn is expected in 1 ... 360 degrees");
}

void TurnedAngle::add(const avatar::BodyPose& pose) {
  const double now = avatar::heading(pose);
  turned_ += last_ ? shortest(now - *last_) : 0.0;
  last_ = now;
}

double TurnedAngle::degrees() const {
  return std::abs(turned_) / kDegree;
}

double seenSides(const std::vector<double>& headings) {
  constexpr int kSteps = 36;
  constexpr double kHalfView = 45.0;  // [deg]: beyond, surface is seen at less than cos 45°
  std::array<bool, kSteps> seen = {};
  for (const double angle : headings) {
    for (int step = 0; step < kSteps; ++step) {
      const double side = 360.0 / kSteps * step * kDegree;
      if (std::abs(shortest(side - angle)) <= kHalfView * kDegree)
        seen[static_cast<std::size_t>(step)] = true;
    }
  }
  return 360.0 / kSteps * static_cast<double>(std::count(seen.begin(), seen.end(), true));
}

avatar::PosedDepthFrame posedFrame(
    const avatar::Camera& camera,
    const RgbdFrame& picture,
    const DepthCloud& cloud,
    const avatar::BodyPose& pose) {
  const Eigen::AlignedBox2i box = personBox(cloud);
  avatar::PosedDepthFrame frame;
  frame.camera = camera;
  frame.pose = pose;
  const Eigen::Vector2i first = box.isEmpty() ? Eigen::Vector2i(0, 0) : box.min();
  const Eigen::Vector2i size = box.isEmpty() ? Eigen::Vector2i(1, 1) : box.sizes().array() + 1;
  frame.camera.width = size.x();
  frame.camera.height = size.y();
  frame.camera.cx -= first.x();
  frame.camera.cy -= first.y();
  const std::size_t numPixels = frame.index(0, size.y());
  frame.depth.reserve(numPixels);
  frame.normals = Eigen::Matrix3Xf::Zero(3, static_cast<Eigen::Index>(numPixels));
  const bool colored = !picture.color.rgb.empty();
  if (colored) {
    frame.color = {size.x(), size.y(), {}};
    frame.color.rgb.reserve(3 * numPixels);
  }
  frame.labels.reserve(cloud.labels.empty() ? 0 : numPixels);
  for (std::size_t i = 0; i < numPixels; ++i) {
    const auto x = first.x() + static_cast<int>(i) % size.x();
    const auto y = first.y() + static_cast<int>(i) / size.x();
    const std::size_t pixel = cloud.index(x, y);
    frame.depth.push_back(cloud.person[pixel] != 0 ? cloud.depth[pixel] : 0.0F);
    frame.normals.col(static_cast<Eigen::Index>(i)) =
        cloud.normals.col(static_cast<Eigen::Index>(pixel));
    if (colored) {
      const auto* rgb = &picture.color.rgb[3 * pixel];
      frame.color.rgb.insert(frame.color.rgb.end(), rgb, rgb + 3);
    }
    if (!cloud.labels.empty())
      frame.labels.push_back(cloud.labels[pixel]);
  }
  return frame;
}

Turn trackTurn(
    const FrameSupply& recording, const avatar::BodyModel& model, const TurnOptions& options) {
  options.validate();
  TurnTracking tracking(recording, model, options);
  const FirstPass learned = tracking.learn();
  return tracking.keep({.betas = learned.betas}, learned.count);
}

Turn trackAgain(
    const Turn& turn,
    const FrameSupply& recording,
    const avatar::BodyModel& model,
    const KnownPerson& person,
    const TurnOptions& options) {
  TurnTracking tracking(recording, model, options);
  KnownPerson known = person;
  known.clothes = tracking.fitted(person, turn.framesTaken);
  Turn again = tracking.keep(known, turn.framesTaken);
  again.warnings = turn.warnings;
  return again;
}

}  // namespace simulcap
