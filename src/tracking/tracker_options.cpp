#include "src/tracking/tracker_options.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace simulcap {

void TrackerOptions::validate() const {
  const auto require = [](bool holds, const char* what) {
    if (!holds) {
      throw std::invalid_argument(std::string("TrackerOptions: ") + what);
    }
  };
  require(iterations >= 1 && iterations <= 50, "iterations must be 1 to 50");
  require(numSamples >= 100 && numSamples <= 20000, "numSamples must be 100 to 20000");
  require(
      numDepthSamples >= 100 && numDepthSamples <= 50000, "numDepthSamples must be 100 to 50000");
  require(dataWeight > 0.0 && std::isfinite(dataWeight), "dataWeight must be positive");
  require(
      firstInterWeight >= 0.0 && laterInterWeight >= 0.0 && std::isfinite(firstInterWeight) &&
          std::isfinite(laterInterWeight),
      "the weights of E_inter must not be negative");
  require(priorWeight >= 0.0 && std::isfinite(priorWeight), "priorWeight must not be negative");
  require(clothOffset >= 0.0 && clothOffset <= 0.1, "clothOffset must be 0 to 0.1 m");
  require(
      lastGate > 0.0 && firstGate >= lastGate && firstGate <= 1.0,
      "gates must be 0 < lastGate <= firstGate <= 1 m");
  require(!floorHeight || std::isfinite(*floorHeight), "floorHeight must be finite");
  require(!usualLean || usualLean->allFinite(), "usualLean must be finite");
}

}  // namespace simulcap
