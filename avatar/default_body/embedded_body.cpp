#include "avatar/default_body/embedded_body.h"

#include "avatar/io/body_file.h"
#include "avatar/io/npz.h"

#include <initializer_list>

extern "C" {
extern const unsigned char simulcap_default_body_begin[];  // NOLINT(readability-identifier-naming)
extern const unsigned char simulcap_default_body_end[];    // NOLINT(readability-identifier-naming)
}

namespace avatar {
namespace {

BodyModel readEmbedded() {
  const auto numBytes =
      static_cast<std::size_t>(simulcap_default_body_end - simulcap_default_body_begin);
  return bodyModelFromNpz(
      readNpzFromMemory(simulcap_default_body_begin, numBytes, "default"), "default");
}

Eigen::VectorXd betas(std::initializer_list<double> values) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(values.size()));
  Eigen::Index i = 0;
  for (const double value : values)
    result[i++] = value;
  return result;
}

}  // namespace

const BodyModel& defaultBody() {
  static const BodyModel kBody = readEmbedded();
  return kBody;
}

BodyModel loadBody(const std::string& nameOrPath) {
  return nameOrPath == "default" ? defaultBody() : readBodyModel(nameOrPath);
}

const std::vector<BodyPreset>& bodyPresets() {
  // stature, mass, shoulder breadth, chest, waist, hip, leg length, arm length, muscle, belly
  static const std::vector<BodyPreset> kPresets = {
      {"mean", "the mean adult", betas({0, 0, 0, 0, 0, 0, 0, 0, 0, 0})},
      {"female",
       "a typical woman",
       betas({-1.0, -0.2, -0.7, 0.8, -0.5, 0.7, 0.0, -0.3, -0.7, 0.0})},
      {"male", "a typical man", betas({1.0, 0.0, 0.8, -0.4, 0.3, -0.8, 0.0, 0.3, 0.9, 0.0})},
      {"slender",
       "tall and thin",
       betas({1.2, -1.6, -0.2, -0.6, -0.6, -0.4, 0.8, 0.5, -0.5, -0.4})},
      {"heavy", "broad, with a belly", betas({0.2, 1.8, 0.4, 0.6, 1.2, 0.6, -0.3, 0.0, 0.2, 1.6})},
      {"athletic",
       "broad shoulders, strong",
       betas({0.8, -0.6, 1.4, 0.0, -0.4, -0.4, 0.2, 0.2, 2.0, -0.8})},
  };
  return kPresets;
}

}  // namespace avatar
