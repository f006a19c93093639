#include "src/input/person_tracker.h"

#include "src/input/depth_noise.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

constexpr float kMaxMotion = 0.25F;  // between two frames along the view [m]
constexpr float kMaxRadius = 1.3F;   // of a person with arms out, from the centre [m]

/// How much nearer than the background something else must be [m].
float backgroundMargin(float z) {
  return 0.015F + 3.0F * depthNoise(z);
}

Eigen::Vector3f centreOf(const CoarseDepth& coarse, const std::vector<std::uint8_t>& person) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float count = 0.0F;
  for (int cell = 0; cell < coarse.size(); ++cell) {
    if (person[cell] != 0) {
      sum += coarse.points.col(cell);
      count += 1.0F;
    }
  }
  return sum / std::max(count, 1.0F);
}

/// Of each cell near the old mask, the old depths there; what is near them now is the person.
std::vector<std::uint8_t> nearOldSurface(
    const CoarseDepth& coarse,
    const std::vector<std::uint8_t>& person,
    const std::vector<float>& personDepth) {
  std::vector<std::uint8_t> result(coarse.size(), 0);
  for (int cell = 0; cell < coarse.size(); ++cell) {
    if (person[cell] == 0)
      continue;
    const auto mark = [&](int n) {
      if (coarse.depth[n] > 0.0F && std::abs(coarse.depth[n] - personDepth[cell]) < kMaxMotion)
        result[n] = 1;
    };
    mark(cell);
    forNeighbours(coarse, cell, mark);
  }
  return result;
}

}  // namespace

std::vector<std::uint8_t> PersonTracker::foreground(const CoarseDepth& coarse) const {
  std::vector<std::uint8_t> result = offThePlanes(coarse, layout_);
  for (int cell = 0; cell < coarse.size(); ++cell) {
    const float behind = background_[cell];
    if (behind > 0.0F && coarse.depth[cell] > behind - backgroundMargin(behind))
      result[cell] = 0;
    if ((coarse.points.col(cell) - centre_).squaredNorm() > kMaxRadius * kMaxRadius)
      result[cell] = 0;
  }
  return result;
}

/// The pieces that go on where the person was.
std::vector<std::uint8_t> PersonTracker::continued(const CoarseDepth& coarse) const {
  constexpr float kMinShare = 0.3F;  // of a piece, that lies where the person was
  const Components components = connectedComponents(coarse, foreground(coarse));
  const auto near = nearOldSurface(coarse, person_, personDepth_);
  std::vector<long> shared(components.pieces.size(), 0);
  for (int cell = 0; cell < coarse.size(); ++cell) {
    if (near[cell] != 0 && components.pieceOfCell[cell] >= 0)
      ++shared[components.pieceOfCell[cell]];
  }
  std::vector<std::uint8_t> person(coarse.size(), 0);
  const auto largest = std::max_element(shared.begin(), shared.end());
  if (largest == shared.end() || *largest == 0)
    return person;
  for (std::size_t id = 0; id < shared.size(); ++id) {
    const auto& cells = components.pieces[id].cells;
    const bool kept =
        static_cast<float>(shared[id]) >= kMinShare * static_cast<float>(cells.size());
    if (!kept && shared[id] != *largest)
      continue;
    for (const int cell : cells)
      person[cell] = 1;
  }
  return withLimbs(coarse, layout_, components, std::move(person));
}

/// Cells around the person may be the person's: nothing is learned there.
void PersonTracker::learnBackground(const CoarseDepth& coarse) {
  constexpr float kRate = 0.1F;  // of the running mean
  const std::vector<float> around = depthAround(coarse, person_, kPersonReach);
  for (int cell = 0; cell < coarse.size(); ++cell) {
    const float z = coarse.depth[cell];
    float& behind = background_[cell];
    if (around[cell] > 0.0F || z <= 0.0F)
      continue;
    if (behind == 0.0F || z > behind + backgroundMargin(behind))
      behind = z;
    else if (z > behind - backgroundMargin(behind))
      behind += kRate * (z - behind);
  }
}

std::vector<std::uint8_t> PersonTracker::next(const CoarseDepth& coarse) {
  const auto size = static_cast<std::size_t>(coarse.size());
  if (background_.empty())
    background_.assign(size, 0.0F);
  if (background_.size() != size)
    throw std::invalid_argument("PersonTracker: frames must all have the same size");
  std::vector<std::uint8_t> person(size, 0);
  if (!person_.empty())
    person = continued(coarse);
  if (std::find(person.begin(), person.end(), 1) == person.end())
    person = findPerson(coarse, layout_);
  if (std::find(person.begin(), person.end(), 1) == person.end())
    return person;
  person_ = person;
  personDepth_ = coarse.depth;
  centre_ = centreOf(coarse, person_);
  learnBackground(coarse);
  return person;
}

}  // namespace simulcap
