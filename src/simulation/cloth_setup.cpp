#include "src/simulation/cloth_setup.h"

#include <stdexcept>

namespace simulcap {

bullet_ext::ClothMaterial clothMaterial(const avatar::ClothParameters& parameters) {
  bullet_ext::ClothMaterial material;
  material.stretchStiffness = parameters.stretchStiffness;
  material.torsionStiffness = parameters.torsionStiffness;
  material.massMode = parameters.massMode == avatar::MassMode::kAreal
                          ? bullet_ext::MassMode::kAreal
                          : bullet_ext::MassMode::kPerVertex;
  material.vertexMass = parameters.vertexMass;
  material.arealDensity = parameters.arealDensity;
  material.dampingMode = parameters.dampingMode == avatar::DampingMode::kPerSubstep
                             ? bullet_ext::DampingMode::kPerSubstep
                             : bullet_ext::DampingMode::kPerSecond;
  material.damping = parameters.damping;
  material.friction = parameters.friction;
  material.thickness = parameters.thickness;
  return material;
}

bullet_ext::ClothMesh clothMesh(const StagedCloth& cloth) {
  bullet_ext::ClothMeshOptions options;
  options.pins = cloth.pins;
  options.edgeStretchStiffness = cloth.parameters.edgeStretchStiffness;
  options.hingeTorsionStiffness = cloth.parameters.edgeTorsionStiffness;
  options.vertexMasses = cloth.parameters.vertexMasses;
  try {
    return bullet_ext::buildClothMesh(
        cloth.rest.vertices, cloth.rest.faces, clothMaterial(cloth.parameters), options);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(cloth.name + ": " + error.what());
  }
}

}  // namespace simulcap
