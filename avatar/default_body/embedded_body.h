#pragma once

#include "avatar/body_model.h"

#include <string>
#include <vector>

namespace avatar {

/// The built-in body, read once from the bytes embedded at build time.
const BodyModel& defaultBody();

/// The built-in body for "default", else the body model file at that path. Throws FileError.
BodyModel loadBody(const std::string& nameOrPath);

/// A named shape of the default body.
struct BodyPreset {
  std::string name;
  std::string description;
  Eigen::VectorXd betas;
};

/// Typical shapes: mean, female, male, and some further apart.
const std::vector<BodyPreset>& bodyPresets();

}  // namespace avatar
