#pragma once

#include "src/scene/scene.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace simulcap {

/// What there is to say about a key besides its type and default.
struct FieldText {
  std::string unit = {};
  double min = 0.0, max = 0.0;  ///< numbers and integers
  int minItems = 0, maxItems = 0;
  std::vector<std::string> choices = {};  ///< texts: the allowed ones
  std::string pattern = {};               ///< texts: regular expression
  std::string example = {};
  std::string defaultWords = {};
  std::string needs = {};
  bool required = false;
  std::string meaning = {};
};

/// One of several keys that exclude each other; an empty key stands for none of them.
struct Alternative {
  std::string key;
  std::string meaning;
};

template <class Enum>
using ChoiceNames = std::vector<std::pair<std::string, Enum>>;

// choiceNames(value): the texts of an enumeration's values.

inline ChoiceNames<Integrator> choiceNames(Integrator) {
  return {
      {"semi_implicit", Integrator::kSemiImplicit},
      {"forward_euler", Integrator::kForwardEuler},
      {"implicit", Integrator::kImplicit}};
}

inline ChoiceNames<avatar::UpAxis> choiceNames(avatar::UpAxis) {
  return {{"auto", avatar::UpAxis::kAuto}, {"y", avatar::UpAxis::kY}, {"z", avatar::UpAxis::kZ}};
}

inline ChoiceNames<avatar::MassMode> choiceNames(avatar::MassMode) {
  return {{"per_vertex", avatar::MassMode::kPerVertex}, {"areal", avatar::MassMode::kAreal}};
}

inline ChoiceNames<avatar::DampingMode> choiceNames(avatar::DampingMode) {
  return {
      {"per_second", avatar::DampingMode::kPerSecond},
      {"per_substep", avatar::DampingMode::kPerSubstep}};
}

inline ChoiceNames<SensorModel> choiceNames(SensorModel) {
  return {
      {"ideal", SensorModel::kIdeal},
      {"kinect_v1", SensorModel::kKinectV1},
      {"time_of_flight", SensorModel::kTimeOfFlight}};
}

// Beyond these no scene of cloth and people makes sense: a typing mistake or a wrong unit.
inline constexpr double kFarAway = 1000.0;  // [m]
inline constexpr double kFast = 1000.0;     // [m/s], [rad/s]
inline constexpr double kSeedMax = 4294967295.0;

template <class Visitor>
void describePlacement(Visitor& v, Placement& placement) {
  v.field(
      "position",
      placement.position,
      {.unit = "m",
       .min = -kFarAway,
       .max = kFarAway,
       .meaning = "Where the local origin is put."});
  v.field(
      "rotation_deg",
      placement.rotationDegrees,
      {.unit = "°",
       .min = -360.0,
       .max = 360.0,
       .meaning = "Turns about the world's x, then y, then z axis, before it is put there."});
}

}  // namespace simulcap
