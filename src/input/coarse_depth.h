#pragma once

#include "avatar/geometry/camera.h"
#include "src/input/scene_planes.h"

#include <cstdint>
#include <vector>

namespace simulcap {

/// A depth image in cells of step × step pixels, each with the depth of one measured pixel of its
/// own: enough to tell objects apart at a fraction of the cost.
struct CoarseDepth {
  int step = 1;              ///< cell size [px]
  int width = 0;             ///< [cells]
  int height = 0;            ///< [cells]
  std::vector<float> depth;  ///< width · height [m]; 0 = none
  Eigen::Matrix3Xf points;   ///< 3 × width·height in the camera's frame [m]; 0 = none
  float widthPerDepth = 0;   ///< a cell at depth z sees a square of widthPerDepth · z face on

  int size() const { return width * height; }

  float area(int cell) const {
    const float side = widthPerDepth * depth[cell];
    return side * side;
  }
};

/// About 160 cells across.
CoarseDepth coarseDepth(const std::vector<float>& depth, const avatar::Camera& camera);

/// The cells that are measured, as points with normals and areas.
ScenePoints scenePoints(const CoarseDepth& coarse);

/// A connected piece of surface.
struct Component {
  std::vector<int> cells;
  float area = 0.0F;                                      ///< [m²]
  Eigen::Vector3f min = Eigen::Vector3f::Constant(1e9F);  ///< of its points [m]
  Eigen::Vector3f max = Eigen::Vector3f::Constant(-1e9F);
};

/// Pieces of the wanted cells without jumps in depth, and each cell's piece (−1: none).
struct Components {
  std::vector<Component> pieces;
  std::vector<int> pieceOfCell;
};

Components connectedComponents(const CoarseDepth& coarse, const std::vector<std::uint8_t>& wanted);

/// Neighbouring cells farther apart than this see two surfaces [m].
float coarseJump(const CoarseDepth& coarse, float z);

/// Calls function(neighbour) for the up to 8 neighbours of a cell.
template <typename Function>
void forNeighbours(const CoarseDepth& coarse, int cell, const Function& function) {
  const int x = cell % coarse.width;
  const int y = cell / coarse.width;
  for (int ny = y > 0 ? y - 1 : 0; ny <= y + 1 && ny < coarse.height; ++ny) {
    for (int nx = x > 0 ? x - 1 : 0; nx <= x + 1 && nx < coarse.width; ++nx) {
      const int neighbour = ny * coarse.width + nx;
      if (neighbour != cell)
        function(neighbour);
    }
  }
}

/// Calls function(x, y) for the pixels of a cell.
template <typename Function>
void forPixels(const CoarseDepth& coarse, int cell, const Function& function) {
  const int left = cell % coarse.width * coarse.step;
  const int top = cell / coarse.width * coarse.step;
  for (int y = top; y < top + coarse.step; ++y) {
    for (int x = left; x < left + coarse.step; ++x)
      function(x, y);
  }
}

/// For each cell within `reach` cells of the mask the depth of the mask's cell near it [m]; 0
/// farther away.
std::vector<float> depthAround(
    const CoarseDepth& coarse, const std::vector<std::uint8_t>& mask, int reach);

}  // namespace simulcap
