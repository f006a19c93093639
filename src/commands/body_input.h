#pragma once

#include "avatar/body_model.h"
#include "avatar/body_pose.h"

#include <Eigen/Core>

#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming)
class App;
}

namespace simulcap {

/// A shape as it was asked for.
struct NamedShape {
  std::string label;      ///< the preset's name, else the betas as text
  Eigen::VectorXd betas;  ///< as many as the model has
};

/// "0.03". `option` is named in the error. Throws UsageError.
double parseNumber(const std::string& option, const std::string& text);

/// "1,0,-2" (further betas 0), the name of a preset of the default body, or an .npz with the key
/// `betas`. Throws UsageError, and avatar::FileError for a file that can't be used.
NamedShape parseShape(const std::string& text, const avatar::BodyModel& model);

/// What --betas takes, for its help.
std::string shapeHelp();

/// --betas, several times. `where`: what several shapes become, "rows" or "columns".
void addShapeOption(CLI::App& verb, std::vector<std::string>& texts, const std::string& where);

/// One shape per text; the mean shape when there is none.
std::vector<NamedShape> parseShapes(
    const std::vector<std::string>& texts, const avatar::BodyModel& model);

/// Names of the default body's presets, for the help: "female, male, …".
std::string presetNames();

struct PixelSize {
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
};

/// "480x640". Throws UsageError.
PixelSize parseSize(const std::string& text);

/// "a,b,c" → {"a", "b", "c"}.
std::vector<std::string> splitAtCommas(const std::string& text);

}  // namespace simulcap
