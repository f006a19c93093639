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

bullet_ext::CaptureGarment captureGarment(const StagedCloth& cloth, int layer) {
  bullet_ext::CaptureGarment garment;
  garment.vertices = cloth.rest.vertices;
  garment.faces = cloth.rest.faces;
  garment.material = clothMaterial(cloth.parameters);
  garment.mesh.pins = cloth.pins;
  garment.mesh.edgeStretchStiffness = cloth.parameters.edgeStretchStiffness;
  garment.mesh.hingeTorsionStiffness = cloth.parameters.edgeTorsionStiffness;
  garment.mesh.vertexMasses = cloth.parameters.vertexMasses;
  garment.layer = layer;
  return garment;
}

bullet_ext::ClothMesh clothMesh(const StagedCloth& cloth) {
  const bullet_ext::CaptureGarment garment = captureGarment(cloth, 0);
  try {
    return bullet_ext::buildClothMesh(
        garment.vertices, garment.faces, garment.material, garment.mesh);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(cloth.name + ": " + error.what());
  }
}

}  // namespace simulcap
