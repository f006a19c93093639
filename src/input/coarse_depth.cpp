#include "src/input/coarse_depth.h"

#include "src/input/depth_noise.h"

#include <algorithm>
#include <cmath>

namespace simulcap {
namespace {

/// A measured pixel of the cell, the middle one first.
struct Sample {
  int x = 0, y = 0;
  float z = 0.0F;
};

Sample sampleOf(const std::vector<float>& depth, int imageWidth, int left, int top, int step) {
  const int middle = step / 2;
  for (int i = 0; i < step; ++i) {
    for (int k = 0; k < step; ++k) {
      const int x = left + (middle + k) % step;
      const int y = top + (middle + i) % step;
      const float z = depth[static_cast<std::size_t>(y) * imageWidth + x];
      if (z > 0.0F)
        return {x, y, z};
    }
  }
  return {};
}

/// Normal across the cells two to each side; 0 at jumps, holes and the border.
Eigen::Vector3f cellNormal(const CoarseDepth& coarse, int cell) {
  constexpr int kReach = 2;
  const int x = cell % coarse.width;
  const int y = cell / coarse.width;
  if (x < kReach || y < kReach || x >= coarse.width - kReach || y >= coarse.height - kReach)
    return Eigen::Vector3f::Zero();
  const float z = coarse.depth[cell];
  const int sides[] = {-kReach, kReach, -kReach * coarse.width, kReach * coarse.width};
  for (const int side : sides) {
    const float beside = coarse.depth[cell + side];
    if (beside <= 0.0F || std::abs(beside - z) > kReach * coarseJump(coarse, z))
      return Eigen::Vector3f::Zero();
  }
  const Eigen::Vector3f across =
      coarse.points.col(cell + sides[1]) - coarse.points.col(cell + sides[0]);
  const Eigen::Vector3f down =
      coarse.points.col(cell + sides[3]) - coarse.points.col(cell + sides[2]);
  return down.cross(across).normalized();
}

/// The piece around a seed; enters its cells into `known` under the next free number.
Component grownPiece(
    const CoarseDepth& coarse,
    const std::vector<std::uint8_t>& wanted,
    int seed,
    Components& known) {
  const int id = static_cast<int>(known.pieces.size());
  Component piece;
  const auto isJoined = [&](int cell, int neighbour) {
    const float z = coarse.depth[cell];
    const float zn = coarse.depth[neighbour];
    return wanted[neighbour] != 0 && zn > 0.0F && known.pieceOfCell[neighbour] < 0 &&
           std::abs(zn - z) <= coarseJump(coarse, std::min(z, zn));
  };
  const auto take = [&](int cell) {
    known.pieceOfCell[cell] = id;
    piece.cells.push_back(cell);
  };
  take(seed);
  for (std::size_t next = 0; next < piece.cells.size(); ++next) {
    const int cell = piece.cells[next];
    piece.area += coarse.area(cell);
    piece.min = piece.min.cwiseMin(coarse.points.col(cell));
    piece.max = piece.max.cwiseMax(coarse.points.col(cell));
    forNeighbours(coarse, cell, [&](int n) {
      if (isJoined(cell, n))
        take(n);
    });
  }
  return piece;
}

/// Hands the depths of a front of cells on to their neighbours without any, the next front.
std::vector<int> spread(
    const CoarseDepth& coarse, const std::vector<int>& front, std::vector<float>& depth) {
  std::vector<int> next;
  const auto handOn = [&](int from, int to) {
    if (depth[to] != 0.0F)
      return;
    depth[to] = depth[from];
    next.push_back(to);
  };
  for (const int cell : front)
    forNeighbours(coarse, cell, [&](int n) { handOn(cell, n); });
  return next;
}

}  // namespace

CoarseDepth coarseDepth(const std::vector<float>& depth, const avatar::Camera& camera) {
  constexpr int kCellsAcross = 160;
  CoarseDepth result;
  result.step = std::max(1, (camera.width + kCellsAcross / 2) / kCellsAcross);
  result.width = camera.width / result.step;
  result.height = camera.height / result.step;
  result.depth.resize(result.size());
  result.points.setZero(3, result.size());
  result.widthPerDepth = static_cast<float>(result.step / std::sqrt(camera.fx * camera.fy));
  for (int cell = 0; cell < result.size(); ++cell) {
    const int left = cell % result.width * result.step;
    const int top = cell / result.width * result.step;
    const Sample s = sampleOf(depth, camera.width, left, top, result.step);
    result.depth[cell] = s.z;
    result.points.col(cell) << s.z * static_cast<float>((s.x - camera.cx) / camera.fx),
        s.z * static_cast<float>((s.y - camera.cy) / camera.fy), s.z;
  }
  return result;
}

ScenePoints scenePoints(const CoarseDepth& coarse) {
  ScenePoints scene;
  scene.points.resize(3, coarse.size());
  scene.normals.resize(3, coarse.size());
  scene.areas.resize(coarse.size());
  Eigen::Index count = 0;
  for (int cell = 0; cell < coarse.size(); ++cell) {
    if (coarse.depth[cell] <= 0.0F)
      continue;
    scene.points.col(count) = coarse.points.col(cell);
    scene.normals.col(count) = cellNormal(coarse, cell);
    scene.areas[count++] = coarse.area(cell);
  }
  scene.points.conservativeResize(3, count);
  scene.normals.conservativeResize(3, count);
  scene.areas.conservativeResize(count);
  return scene;
}

float coarseJump(const CoarseDepth& coarse, float z) {
  constexpr float kMaxTangent = 3.0F;  // of the angle between normal and ray: 72°
  return 3.0F * depthNoise(z) + 0.01F + kMaxTangent * z * coarse.widthPerDepth;
}

Components connectedComponents(const CoarseDepth& coarse, const std::vector<std::uint8_t>& wanted) {
  Components result;
  result.pieceOfCell.assign(coarse.size(), -1);
  for (int seed = 0; seed < coarse.size(); ++seed) {
    if (wanted[seed] != 0 && coarse.depth[seed] > 0.0F && result.pieceOfCell[seed] < 0)
      result.pieces.push_back(grownPiece(coarse, wanted, seed, result));
  }
  return result;
}

std::vector<float> depthAround(
    const CoarseDepth& coarse, const std::vector<std::uint8_t>& mask, int reach) {
  std::vector<float> result(coarse.size(), 0.0F);
  std::vector<int> front;
  for (int cell = 0; cell < coarse.size(); ++cell) {
    if (mask[cell] != 0) {
      result[cell] = coarse.depth[cell];
      front.push_back(cell);
    }
  }
  for (int ring = 0; ring < reach; ++ring)
    front = spread(coarse, front, result);
  return result;
}

}  // namespace simulcap
