#pragma once

#include "src/synthesis/depth_sensor.h"

#include <vector>

namespace simulcap {

/// applySensor() of kTimeOfFlight.
std::vector<float> timeOfFlightImage(
    const std::vector<float>& depth, const avatar::Camera& camera, const SensedFrame& sensed);

}  // namespace simulcap
