#pragma once

#include "avatar/geometry/camera.h"
#include "avatar/geometry/mesh.h"
#include "avatar/geometry/shading.h"
#include "src/input/depth_cloud.h"
#include "src/synthesis/surface_color.h"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace simulcap {

/// One surface of a picture. Valid as long as what it refers to.
struct VisibleMesh {
  avatar::MeshView mesh;  ///< in the world [m]
  PixelLabel label = kBackground;
  const Eigen::Matrix3Xd* colors = nullptr;  ///< 3 × V display values; null: the pattern
  SolidPattern pattern = {};
  const Eigen::Matrix3Xd* patternPoints = nullptr;  ///< 3 × V [m], where the pattern is looked up
};

struct Lighting {
  std::vector<Eigen::Vector3d> lights;  ///< positions in the world [m]; none: even light
  double ambient = 0.45;                ///< 0 … 1
};

/// What a perfect camera sees, W × H pixels, row-major.
struct ExactFrame {
  std::vector<float> depth;          ///< W·H [m] along z; 0 = nothing
  std::vector<std::uint8_t> labels;  ///< W·H PixelLabel
  avatar::ColorImage color;          ///< Lambert's reflection of the lights
};

/// Nearer surfaces hide farther ones; both sides of faces are seen. A mesh's patternPoints must
/// have one column per vertex.
ExactFrame renderFrame(
    const std::vector<VisibleMesh>& meshes,
    const avatar::Camera& camera,
    const Lighting& lighting = {});

/// Depth alone, W·H [m].
std::vector<float> renderDepth(
    const std::vector<VisibleMesh>& meshes, const avatar::Camera& camera);

/// A camera's picture of exact colours: an optical blur of half a pixel and noise of about one grey
/// level.
avatar::ColorImage photographed(
    const avatar::ColorImage& exact, std::uint32_t seed, std::uint32_t frame);

}  // namespace simulcap
