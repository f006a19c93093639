#pragma once

#include "avatar/anthropometry.h"
#include "avatar/skinning.h"

#include <string>
#include <vector>

namespace simulcap {

/// A column of the table.
struct MeasuredBody {
  std::string label;
  avatar::BodyMeasures measures;
};

/// Measures a shape as it stands in its T-pose.
MeasuredBody measured(
    const std::string& label, const avatar::BodyModel& model, const avatar::ShapedBody& body);

/// A text table, measures down and bodies across, each measure with its unit.
std::string measureTable(const std::vector<MeasuredBody>& bodies);

/// {"female":{"stature_m":1.63,…},…} in SI units.
std::string measureJson(const std::vector<MeasuredBody>& bodies);

}  // namespace simulcap
