#include "src/commands/body_input.h"

#include "avatar/default_body/embedded_body.h"
#include "avatar/io/file_error.h"
#include "avatar/io/npz.h"
#include "src/commands/commands.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

namespace simulcap {
namespace {

/// The whole text as a number, else nothing.
template <typename Number>
bool isNumber(const std::string& text, Number& value) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end;
}

Eigen::VectorXd readBetas(const std::string& path, const avatar::BodyModel& model) {
  const avatar::NpzArrays arrays = avatar::readNpz(path, {"betas"});
  const auto found = arrays.find("betas");
  if (found == arrays.end())
    throw avatar::FileError(path, "betas", "missing: expected the shape of a body");
  const Eigen::VectorXd betas = found->second.asMatrix().reshaped();
  if (betas.size() > model.numBetas() || !betas.allFinite())
    throw avatar::FileError(
        path,
        "betas",
        "expected at most " + std::to_string(model.numBetas()) +
            " finite numbers, the shape parameters of the body, found " +
            found->second.shapeText());
  Eigen::VectorXd shape = Eigen::VectorXd::Zero(model.numBetas());
  shape.head(betas.size()) = betas;
  return shape;
}

}  // namespace

double parseNumber(const std::string& option, const std::string& text) {
  double value = 0.0;
  if (!isNumber(text, value) || !std::isfinite(value))
    throw UsageError(option + ": expected a number, found '" + text + "'");
  return value;
}

std::vector<std::string> splitAtCommas(const std::string& text) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t comma = text.find(','); comma != std::string::npos;
       comma = text.find(',', begin)) {
    parts.push_back(text.substr(begin, comma - begin));
    begin = comma + 1;
  }
  parts.push_back(text.substr(begin));
  return parts;
}

NamedShape parseShape(const std::string& text, const avatar::BodyModel& model) {
  if (model.name == "default") {
    for (const avatar::BodyPreset& preset : avatar::bodyPresets()) {
      if (preset.name == text)
        return {preset.name, preset.betas};
    }
  }
  if (text.ends_with(".npz"))
    return {std::filesystem::path(text).stem().string(), readBetas(text, model)};
  NamedShape shape{text, Eigen::VectorXd::Zero(model.numBetas())};
  const std::vector<std::string> numbers = splitAtCommas(text);
  if (static_cast<int>(numbers.size()) > model.numBetas())
    throw UsageError(
        "--betas: " + std::to_string(numbers.size()) + " numbers given, the body has " +
        std::to_string(model.numBetas()) + " shape parameters");
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    double& beta = shape.betas[static_cast<Eigen::Index>(i)];
    if (!isNumber(numbers[i], beta) || !std::isfinite(beta))
      throw UsageError(
          "--betas: expected numbers like 1,0,-2" +
          (model.name == "default" ? " or a preset (" + presetNames() + ")" : std::string()) +
          ", found '" + text + "'");
  }
  return shape;
}

std::string shapeHelp() {
  return "Shape: betas like 1,0,-2, a preset of the default body (" + presetNames() +
         "), or an .npz with betas";
}

void addShapeOption(CLI::App& verb, std::vector<std::string>& texts, const std::string& where) {
  verb.add_option(
          "--betas",
          texts,
          shapeHelp() + "; repeat for several " + where + " (default: the mean shape)")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false)
      ->type_name("BETAS");
}

std::vector<NamedShape> parseShapes(
    const std::vector<std::string>& texts, const avatar::BodyModel& model) {
  if (texts.empty())
    return {{"", Eigen::VectorXd::Zero(model.numBetas())}};
  std::vector<NamedShape> shapes;
  shapes.reserve(texts.size());
  for (const std::string& text : texts)
    shapes.push_back(parseShape(text, model));
  return shapes;
}

std::string presetNames() {
  std::string names;
  for (const avatar::BodyPreset& preset : avatar::bodyPresets())
    names += (names.empty() ? "" : ", ") + preset.name;
  return names;
}

PixelSize parseSize(const std::string& text) {
  PixelSize size;
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos || !isNumber(text.substr(0, cross), size.width) ||
      !isNumber(text.substr(cross + 1), size.height) || size.width < 16 || size.height < 16 ||
      size.width > 8192 || size.height > 8192)
    throw UsageError(
        "--size: expected WIDTHxHEIGHT in pixels, each 16 to 8192, like 480x640; found '" + text +
        "'");
  return size;
}

}  // namespace simulcap
