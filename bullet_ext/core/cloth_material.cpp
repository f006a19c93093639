#include "bullet_ext/core/cloth_material.h"

#include <sstream>
#include <stdexcept>
#include <string>

namespace bullet_ext {
namespace {

/// Written so that NaN fails.
void requireWithin(std::string_view field, double value, double lowest, double highest) {
  if (!(value >= lowest && value <= highest)) {
    std::ostringstream message;
    message << "ClothMaterial: " << field << " is " << value << ", must be within [" << lowest
            << ", " << highest << "]";
    throw std::invalid_argument(message.str());
  }
}

}  // namespace

void ClothMaterial::validate() const {
  requireWithin("stretchStiffness", stretchStiffness, 0.0, 1e7);
  requireWithin("torsionStiffness", torsionStiffness, 0.0, 1e4);
  requireWithin("vertexMass", vertexMass, 1e-9, 1e3);
  requireWithin("arealDensity", arealDensity, 1e-6, 1e3);
  requireWithin("damping", damping, 0.0, dampingMode == DampingMode::kPerSubstep ? 1.0 : 1e4);
  requireWithin("friction", friction, 0.0, 10.0);
  requireWithin("thickness", thickness, 1e-6, 0.1);
}

ClothMaterial paperMaterial(std::string_view name) {
  if (name == "soft") {
    return {.stretchStiffness = 300.0, .torsionStiffness = 0.01};
  }
  if (name == "middle") {
    return {.stretchStiffness = 800.0, .torsionStiffness = 0.05};
  }
  if (name == "hard") {
    return {.stretchStiffness = 1300.0, .torsionStiffness = 0.1};
  }
  throw std::invalid_argument(
      "paperMaterial: no material \"" + std::string(name) + "\"; there are soft, middle and hard");
}

}  // namespace bullet_ext
