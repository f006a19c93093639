#include "src/capture/capture_options.h"

#include <stdexcept>
#include <string>
#include <utility>

namespace simulcap {
namespace {

void require(bool valid, const char* problem) {
  if (!valid)
    throw std::invalid_argument(std::string("CaptureOptions: ") + problem);
}

}  // namespace

const std::vector<std::string>& captureMethodNames() {
  static const std::vector<std::string> names = {
      "simulcap", "simulate-only", "skinning", "direct-fit", "nonrigid-icp", "single-surface"};
  return names;
}

CaptureOptions CaptureOptions::literal() {
  CaptureOptions options;
  options.pullAlongNormals = false;
  options.strainLimit.reset();
  options.hiddenMomentum = 1.0;
  options.fittedMomentum = 1.0;
  options.substepDuration = options.longestSubstep = 1.0 / 3000.0;
  options.fitRounds = 10;
  options.fitIterations = 10;
  options.fitSubstep = 1.0 / 3000.0;
  options.roundsGoOn = false;
  options.garmentContactInterval = 0.0;
  options.view.blendRadius = 0.05;
  options.steadiness.gain = 1.0;
  options.force = {.mode = bullet_ext::DepthForceMode::kLiteral};
  return options;
}

CaptureOptions CaptureOptions::live() {
  CaptureOptions options;
  options.longestSimulated = 1.0 / 30.0;
  options.mostRedos = 1;
  options.dressingSeconds = 0.25;
  return options;
}

void CaptureOptions::validate() const {
  require(
      substepDuration >= 1e-5 && substepDuration <= 1e-2,
      "substepDuration must be within [1e-5, 1e-2] s");
  require(
      longestSubstep >= 1e-5 && longestSubstep <= 1e-2,
      "longestSubstep must be within [1e-5, 1e-2] s");
  require(
      longestSimulated >= 1e-3 && longestSimulated <= 1.0,
      "longestSimulated must be within [1e-3, 1] s");
  require(mostRedos >= 0 && mostRedos <= 10, "mostRedos must be within [0, 10]");
  require(fitRounds >= 1 && fitRounds <= 100, "fitRounds must be within [1, 100]");
  require(fitIterations >= 1 && fitIterations <= 1000, "fitIterations must be within [1, 1000]");
  require(fitSubstep >= 1e-5 && fitSubstep <= 1e-2, "fitSubstep must be within [1e-5, 1e-2] s");
  require(
      !strainLimit || (*strainLimit >= 0.001 && *strainLimit <= 10.0),
      "strainLimit must be within [0.001, 10]");
  require(hiddenMomentum >= 0.0 && hiddenMomentum <= 1.0, "hiddenMomentum must be within [0, 1]");
  require(fittedMomentum >= 0.0 && fittedMomentum <= 1.0, "fittedMomentum must be within [0, 1]");
  require(
      garmentContactInterval >= 0.0 && garmentContactInterval <= 0.1,
      "garmentContactInterval must be within [0, 0.1] s");
  require(
      dressingSeconds >= 0.0 && dressingSeconds <= 10.0, "dressingSeconds must be within [0, 10]");
  view.validate();
  targets.validate();
  steadiness.validate();
  force.validate();
  direct.validate();
  warp.validate();
}

bool isSimulated(CaptureMethod method) {
  return method == CaptureMethod::kSimulcap || method == CaptureMethod::kSimulateOnly;
}

bool isFitted(CaptureMethod method) {
  return method != CaptureMethod::kSimulateOnly && method != CaptureMethod::kSkinning;
}

bool isWarped(CaptureMethod method) {
  return method == CaptureMethod::kNonrigidIcp || method == CaptureMethod::kSingleSurface;
}

std::vector<std::string> leftOut(
    const CaptureOptions& options, const avatar::LayeredAvatar& person) {
  const bool simulated = isSimulated(options.method) && !person.garments.empty();
  const std::pair<bool, const char*> parts[] = {
      {!person.garments.empty(), "garments"},
      {simulated, "cloth simulation"},
      {simulated, "contact with the body"},
      {simulated && options.garmentContact && person.garments.size() > 1,
       "contact between garments"},
      {false, "self-contact"},  // captures never look for it
      {simulated && options.strainLimit, "strain limit"},
      {isFitted(options.method) && !person.garments.empty(), "depth fitting"}};
  std::vector<std::string> names;
  for (const auto& [present, name] : parts) {
    if (!present)
      names.emplace_back(name);
  }
  return names;
}

}  // namespace simulcap
