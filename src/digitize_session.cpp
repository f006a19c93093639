#include "src/digitize_session.h"

#include "avatar/avatar_body.h"
#include "avatar/digitization/body_enhancement.h"
#include "avatar/digitization/garment_finishing.h"
#include "avatar/digitization/hidden_hems.h"
#include "avatar/digitization/seen_extent.h"
#include "avatar/digitization/surface_gap.h"
#include "avatar/digitization/upright_stand.h"
#include "avatar/motion.h"
#include "avatar/skinning.h"
#include "avatar/wardrobe/dressing_body.h"
#include "src/digitization/human_parser.h"
#include "src/digitization/single_view_outfit.h"
#include "src/digitization/turn_labels.h"
#include "src/program/parallel_for.h"
#include "src/program/quiet_stdout.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace simulcap {
namespace {

/// Over views from all sides.
Eigen::Vector3d meanLean(const std::vector<avatar::PosedDepthFrame>& frames) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const avatar::PosedDepthFrame& frame : frames)
    sum += avatar::lean(frame.pose);
  return sum / static_cast<double>(frames.size());
}

class Digitizer {
 public:
  Digitizer(const avatar::BodyModel& model, const DigitizeOptions& options)
      : model_(model), options_(options), skinning_(model) {
    const avatar::LoopRunner runLoop = [threads = options.threads](
                                           long count, const std::function<void(long)>& body) {
      parallelFor(count, threads, body);
    };
    if (options.betas) {
      options_.turn.betas = options.betas;
      options_.body.fitShape = false;
    }
    options_.fusion.runLoop = runLoop;
    options_.parsing.runLoop = runLoop;
    if (!options.parsingModel.empty())
      parser_.emplace(options.parsingModel);
  }

  DigitizedPerson run(const FrameSupply& recording) {
    turn_ = trackTurn(recording, model_, options_.turn);
    result_.seconds = {{"input", turn_.inputSeconds}, {"body_tracking", turn_.trackingSeconds}};
    describeTurn();
    if (turn_.degreesSeen < options_.leastDegrees) {
      stage("built_in_garments", [&] { dressBuiltIn(); });
      return std::move(result_);
    }
    straighten();
    sketch();
    trackDressed(recording);
    make();
    if (options_.desag && !result_.avatar.garments.empty())
      stage("rest_shape", [&] { desag(); });
    return std::move(result_);
  }

 private:
  void make() {
    stage("frame_parsing", [&] { parseFrames(); });
    stage("fusion", [&] { fuse(); });
    stage("inner_body", [&] { fitBody(); });
    stage("outer_surface", [&] { complete(); });
    stage("surface_parsing", [&] {
      result_.labels = avatar::withHiddenHems(
          result_.outer,
          avatar::parsedSurface(result_.outer, options_.surfaceParsing),
          dressingBody_);
    });
    stage("garments", [&] { dress(); });
  }

  /// What hangs loosely about the legs isn't carried by them, and draws thighs and hips that are
  /// tracked without it to its near side. Until it is known, people are taken to stand as they
  /// should.
  void straighten() {
    const avatar::ShapedBody shaped = skinning_.shape(turn_.betas);
    options_.fusion.legsCovered = !avatar::legsApart(turn_.frames, skinning_, shaped);
    if (!options_.fusion.legsCovered)
      lean_ = meanLean(turn_.frames);
    if (avatar::thighsApart(turn_.frames, skinning_, shaped))
      return;
    for (avatar::PosedDepthFrame& frame : turn_.frames)
      frame.pose = avatar::uprightBelowNeck(frame.pose, skinning_, shaped);
  }

  /// Body and clothes for the tracker, which looks at samples some centimetres apart.
  void sketch() {
    const DigitizeOptions wanted = options_;
    options_.fusion.voxelSize = std::max(0.008, wanted.fusion.voxelSize);
    options_.fusion.truncation =
        std::max(2.0 * options_.fusion.voxelSize, wanted.fusion.truncation);
    options_.surface.poissonDepth = std::min(7, wanted.surface.poissonDepth);
    options_.edgeLength = std::max(0.03, wanted.edgeLength);
    isSketch_ = true;
    make();
    isSketch_ = false;
    options_ = wanted;
  }

  /// The turn's poses again, now that body and clothes are known.
  void trackDressed(const FrameSupply& recording) {
    if (options_.onStage)
      options_.onStage("body_tracking, dressed");
    std::optional<OuterLayer> clothes;
    if (!result_.avatar.garments.empty()) {
      clothes = outerLayer(result_.avatar);
      clothes->unknown = ClothUnknown::kWidths;
    }
    turn_ = trackAgain(
        turn_, recording, model_, {result_.body.betas, std::move(clothes), lean_}, options_.turn);
    StageSeconds seconds = std::move(result_.seconds);
    seconds.emplace_back("input", turn_.inputSeconds);
    seconds.emplace_back("body_tracking", turn_.trackingSeconds);
    result_ = {};
    result_.seconds = std::move(seconds);
    describeTurn();
  }

  template <typename Work>
  void stage(const char* name, const Work& work) {
    if (options_.onStage)
      options_.onStage(name);
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    result_.seconds.emplace_back(name, time.count());
  }

  void warn(const std::string& text) { result_.warnings.push_back(text); }

  void describeTurn() {
    if (turn_.frames.empty())
      throw std::runtime_error(
          "the body was lost in all " + std::to_string(turn_.framesRead) +
          " frames of the turn; expected one upright person, arms a little away from the body");
    result_.camera = turn_.camera;
    result_.firstNumber = turn_.numbers.front();
    result_.framesRead = turn_.framesRead;
    result_.framesLost = turn_.framesLost;
    result_.framesFused = static_cast<int>(turn_.frames.size());
    result_.degreesSeen = turn_.degreesSeen;
    result_.warnings = turn_.warnings;
    constexpr double kWhole = 360.0;
    if (turn_.degreesSeen < kWhole) {
      char text[160];
      std::snprintf(
          text,
          sizeof text,
          "only %.0f of 360 degrees of the person were seen, the rest is a guess: turn round once "
          "completely, slowly",
          turn_.degreesSeen);
      warn(text);
    }
    if (10 * turn_.framesLost > turn_.framesRead)
      warn(
          "the body was lost in " + std::to_string(turn_.framesLost) + " of " +
          std::to_string(turn_.framesRead) +
          " frames of the turn: turn more slowly, arms a little away from the body");
  }

  /// In garments of the wardrobe, like those in the first frame.
  void dressBuiltIn() {
    result_.builtIn = true;
    turn_.frames.resize(1);
    const avatar::PosedDepthFrame& frame = turn_.frames.front();
    if (!frame.labels.empty() || !frame.color.rgb.empty() || !options_.labelFolder.empty())
      parseFrames();
    const SingleViewOutfit outfit = singleViewOutfit(
        frame,
        skinning_,
        turn_.betas,
        {.onePiece = onePiece_ || options_.parsing.onePiece, .edgeLength = options_.edgeLength});
    BuiltInAvatar dressed = wearing(outfit, model_, turn_.betas);
    result_.avatar = std::move(dressed.avatar);
    result_.body.betas = turn_.betas;
    result_.firstPose = frame.pose;
    for (const std::string& note : dressed.notes)
      warn(note);
  }

  void parseFrames() {
    labelFrames();
    avatar::FrameParsing parsing =
        avatar::parsedFrames(turn_.frames, skinning_, turn_.betas, options_.parsing);
    for (std::size_t f = 0; f < turn_.frames.size(); ++f) {
      avatar::PosedDepthFrame& frame = turn_.frames[f];
      frame.labels = std::move(parsing.labels[f]);
      result_.parsed.push_back(
          {.number = turn_.numbers[f],
           .left = static_cast<int>(std::lround(turn_.camera.cx - frame.camera.cx)),
           .top = static_cast<int>(std::lround(turn_.camera.cy - frame.camera.cy)),
           .width = frame.camera.width,
           .height = frame.camera.height,
           .labels = frame.labels});
    }
    onePiece_ = parsing.onePiece;
    for (const std::string& warning : parsing.warnings)
      warn(warning);
  }

  /// By what the user gives beside the colours.
  void labelFrames() {
    if (!options_.labelFolder.empty())
      readTurnLabels(turn_, options_.labelFolder);
    if (!parser_)
      return;
    const NetworkLabels labels = parseTurn(turn_, *parser_, options_.parsedFrames);
    if (labels.frames == 0)
      warn("all frames have label pictures: the human-parsing network wasn't asked");
    if (labels.onePiece)
      options_.parsing.onePiece = true;
  }

  void fuse() {
    const std::size_t count = turn_.frames.size();
    fused_ = fusedFrames(0, count);
    if (isSketch_)
      return;
    const std::size_t some = std::min<std::size_t>(count / 10, 10);
    constexpr double kReach = 0.05;  // errors of a person's pose are smaller [m]
    if (some >= 2)
      result_.loopGap =
          avatar::medianGap(fusedFrames(count - some, count), fusedFrames(0, some), kReach);
  }

  /// In which the person is put together.
  avatar::BodyPose canonicalPose() const {
    if (!options_.fusion.legsCovered)
      return avatar::aPose();
    return avatar::aPoseOnLegsOf(
        turn_.frames.front().pose, skinning_, skinning_.shape(turn_.betas));
  }

  avatar::FusedPoints fusedFrames(std::size_t first, std::size_t end) const {
    avatar::CanonicalFusion fusion(skinning_, turn_.betas, canonicalPose(), options_.fusion);
    for (std::size_t f = first; f < end; ++f)
      fusion.allocate(turn_.frames[f]);
    for (std::size_t f = first; f < end; ++f)
      fusion.integrate(turn_.frames[f]);
    // Seen once, at right angles from 1.8 m, or more often.
    constexpr double kMinWeight = 0.3;
    return avatar::surfacePoints(fusion.volume(), kMinWeight);
  }

  void fitBody() {
    result_.body =
        avatar::fitInnerBody(skinning_, turn_.betas, canonicalPose(), fused_, options_.body);
    const avatar::ShapedBody shaped = skinning_.shape(result_.body.betas);
    dressingBody_ = avatar::standForDressing(model_, result_.body.betas, result_.body.pose);
    result_.firstPose = avatar::carriedOver(
        turn_.frames.front().pose,
        skinning_.shape(turn_.betas),
        canonicalPose(),
        shaped,
        result_.body.pose);
  }

  void complete() {
    const QuietStdout quiet;  // PCL prints where it leaves holes; they are closed
    result_.outer = avatar::completeOuterSurface(fused_, dressingBody_.mesh(), options_.surface);
    result_.outer = avatar::withSeenExtent(std::move(result_.outer), dressingBody_);
    for (const std::string& warning : result_.outer.warnings)
      warn(warning);
  }

  void dress() {
    avatar::FinishingOptions finishing;
    finishing.edgeLength = options_.edgeLength;
    avatar::FinishedGarments finished =
        avatar::finishGarments(result_.outer, result_.labels, dressingBody_, finishing);
    for (const std::string& note : finished.notes)
      warn(note);
    result_.avatar.garments = std::move(finished.garments);
    if (onePiece_ && result_.avatar.garments.size() == 1)
      result_.avatar.garments.front().name = "dress";
    result_.avatar.body = avatar::makeAvatarBody(model_, result_.body.betas);
    if (isSketch_)
      return;
    const avatar::BodyEnhancement details = avatar::enhanceBody(
        result_.outer, result_.labels, {skinning_, result_.body.betas, result_.body.pose});
    avatar::applyEnhancement(details, result_.avatar.body);
  }

  void desag() {
    RestShapeOptions options;
    options.threads = options_.threads;
    options.onRound = [&](int round) {
      if (options_.onStage && round > 0)
        options_.onStage("rest_shape, settling again");
    };
    DesaggedAvatar found = desagged({model_, result_.avatar}, options);
    result_.avatar = std::move(found.avatar);
    result_.drift = std::move(found.drift);
  }

  const avatar::BodyModel& model_;
  DigitizeOptions options_;
  avatar::Skinning skinning_;
  std::optional<HumanParser> parser_;
  Turn turn_;
  bool onePiece_ = false;
  bool isSketch_ = false;
  std::optional<Eigen::Vector3d> lean_;  // absent: hidden by what covers the legs
  avatar::FusedPoints fused_;
  avatar::DressingBody dressingBody_;  // in the canonical pose
  DigitizedPerson result_;
};

}  // namespace

void DigitizeOptions::validate() const {
  turn.validate();
  parsing.validate();
  fusion.validate();
  body.validate();
  surface.validate();
  surfaceParsing.validate();
  if (!(parsedFrames >= 1 && parsedFrames <= 10000))
    throw std::invalid_argument("DigitizeOptions: parsedFrames is expected in 1 ... 10000");
  if (!(edgeLength >= 0.008 && edgeLength <= 0.05))
    throw std::invalid_argument("DigitizeOptions: edgeLength is expected in 0.008 ... 0.05 m");
  if (!(leastDegrees >= 0.0 && leastDegrees <= 360.0))
    throw std::invalid_argument("DigitizeOptions: leastDegrees is expected in 0 ... 360");
  if (threads < 1)
    throw std::invalid_argument("DigitizeOptions: threads is expected at 1 or above");
}

DigitizedPerson digitize(
    const FrameSupply& recording, const avatar::BodyModel& model, const DigitizeOptions& options) {
  options.validate();
  return Digitizer(model, options).run(recording);
}

nlohmann::json digitizationFigures(const DigitizedPerson& person) {
  nlohmann::json seconds = nlohmann::json::object();
  double total = 0.0;
  for (const auto& [name, time] : person.seconds) {
    seconds[name] = seconds.value(name, 0.0) + time;
    total += time;
  }
  seconds["total"] = total;
  seconds["per_frame"] = person.framesRead > 0 ? total / person.framesRead : 0.0;
  nlohmann::json drift = nlohmann::json::object();
  for (const SettlingDrift& garment : person.drift)
    drift[garment.garment] = {
        {"as_worn", 1000.0 * garment.asWorn}, {"desagged", 1000.0 * garment.desagged}};
  nlohmann::json loop;
  if (person.loopGap)
    loop = 1000.0 * *person.loopGap;
  return {
      {"digitization_s", seconds},
      {"digitization",
       {{"frames", person.framesRead},
        {"frames_lost", person.framesLost},
        {"frames_fused", person.framesFused},
        {"degrees_seen", person.degreesSeen},
        {"loop_closure_mm", loop},
        {"built_in_garments", person.builtIn},
        {"body_points_for_holes", person.outer.holesFilledByBody},
        {"skin_to_surface_mm", 1000.0 * person.body.skinDistance},
        {"skin_under_cloth_mm", 1000.0 * person.body.underCloth},
        {"skin_outside_cloth", person.body.insideOut},
        {"settling_drift_mm", person.drift.empty() ? nlohmann::json() : drift},
        {"warnings", person.warnings}}}};
}

}  // namespace simulcap
