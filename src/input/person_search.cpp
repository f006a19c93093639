#include "src/input/person_search.h"

#include "src/input/depth_noise.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace simulcap {
namespace {

/// Extent of a piece in the directions that matter for a person.
struct Extent {
  float height = 0.0F;  ///< along up [m]
  float width = 0.0F;   ///< across the view [m]
  float depth = 0.0F;   ///< along the view, horizontally [m]
};

/// Between the 2nd and 98th percentile along a direction [m].
float extentAlong(
    const CoarseDepth& coarse, const Component& piece, const Eigen::Vector3f& direction) {
  std::vector<float> positions;
  positions.reserve(piece.cells.size());
  for (const int cell : piece.cells)
    positions.push_back(direction.dot(coarse.points.col(cell)));
  const auto cut = std::ssize(positions) / 50;
  std::nth_element(positions.begin(), positions.begin() + cut, positions.end());
  const float low = positions[cut];
  std::nth_element(positions.begin(), positions.end() - 1 - cut, positions.end());
  return positions[positions.size() - 1 - cut] - low;
}

Extent extentOf(const CoarseDepth& coarse, const Component& piece, const Eigen::Vector3f& up) {
  const Eigen::Vector3f forward = (Eigen::Vector3f::UnitZ() - up.z() * up).normalized();
  return {
      extentAlong(coarse, piece, up),
      extentAlong(coarse, piece, up.cross(forward)),
      extentAlong(coarse, piece, forward)};
}

bool isPlausible(const Extent& extent, float area) {
  constexpr float kMinArea = 0.04F;   // a child's upper body [m²]
  constexpr float kMaxArea = 2.2F;    // an adult in a wide skirt, and noise [m²]
  constexpr float kMinHeight = 0.3F;  // head and shoulders [m]
  constexpr float kMaxHeight = 2.6F;  // arms up [m]
  constexpr float kMaxWidth = 2.3F;   // arms out [m]
  constexpr float kMaxDepth = 1.8F;
  return area >= kMinArea && area <= kMaxArea && extent.height >= kMinHeight &&
         extent.height <= kMaxHeight && extent.width <= kMaxWidth && extent.depth <= kMaxDepth;
}

/// The first cell with depth to one side of another; −1: none up to the image's edge.
int besideAcrossHoles(const CoarseDepth& coarse, int cell, int side) {
  for (int x = cell % coarse.width + side; x >= 0 && x < coarse.width; x += side) {
    cell += side;
    if (coarse.depth[cell] > 0.0F)
      return cell;
  }
  return -1;
}

/// The share of a piece's left and right border where what is beside it is farther away or nothing:
/// 1 for what stands free, small for what others hide or what goes on. Holes say nothing.
float freeBorder(const CoarseDepth& coarse, const Components& components, int id) {
  long border = 0;
  long farther = 0;
  for (const int cell : components.pieces[id].cells) {
    for (const int side : {-1, 1}) {
      const int x = cell % coarse.width + side;
      if (x < 0 || x >= coarse.width || components.pieceOfCell[cell + side] == id)
        continue;
      const int beside = besideAcrossHoles(coarse, cell, side);
      if (beside >= 0 && components.pieceOfCell[beside] == id)
        continue;
      ++border;
      farther += beside < 0 || coarse.depth[beside] > coarse.depth[cell] ? 1 : 0;
    }
  }
  return border == 0 ? 0.0F : static_cast<float>(farther) / static_cast<float>(border);
}

float likelihood(const CoarseDepth& coarse, const Components& components, int id, float height) {
  const Component& piece = components.pieces[id];
  double column = 0.0;
  double depth = 0.0;
  for (const int cell : piece.cells) {
    column += cell % coarse.width;
    depth += static_cast<double>(coarse.depth[cell]);
  }
  const auto count = static_cast<double>(piece.cells.size());
  const auto centre = static_cast<float>(column / count);
  const auto meanDepth = static_cast<float>(depth / count);  // who is captured stands in front
  const float offCentre = centre / (0.5F * static_cast<float>(coarse.width - 1)) - 1.0F;
  const float freedom = freeBorder(coarse, components, id);
  constexpr float kFullArea = 0.5F;    // more surface than that says no more [m²]
  constexpr float kFullHeight = 1.2F;  // [m]
  return std::min(piece.area, kFullArea) * std::min(height, kFullHeight) *
         std::exp(-2.0F * offCentre * offCentre) * freedom * freedom / meanDepth;
}

int mostLikelyPiece(
    const CoarseDepth& coarse, const Components& components, const SceneLayout& layout) {
  int best = -1;
  float bestLikelihood = 0.0F;
  for (int id = 0; id < static_cast<int>(components.pieces.size()); ++id) {
    const Component& piece = components.pieces[id];
    constexpr std::size_t kMinCells = 30;
    if (piece.cells.size() < kMinCells)
      continue;
    const Extent extent = extentOf(coarse, piece, layout.up);
    if (!isPlausible(extent, piece.area))
      continue;
    const float value = likelihood(coarse, components, id, extent.height);
    if (value > bestLikelihood) {
      best = id;
      bestLikelihood = value;
    }
  }
  return best;
}

/// Where a piece meets the person and other things in the image.
struct Contact {
  long cells = 0;         ///< of the piece that are beside the person
  long joined = 0;        ///< of those, at nearly the person's depth
  float distance = 1e9F;  ///< along the view, where it is least [m]
  long border = 0;        ///< neighbours of the piece, the person's left out
  long attached = 0;      ///< of those, at nearly the piece's depth: what it may be part of
};

/// What is known when limbs are looked for.
struct LimbSearch {
  const CoarseDepth& coarse;
  const SceneLayout& layout;
  const Components& components;
  const std::vector<std::uint8_t>& person;
  std::vector<float> personAround;  ///< depthAround the person
};

/// Feet stand on the floor without being part of it.
bool isOnFloor(const LimbSearch& search, int cell) {
  const Eigen::Vector3f point = search.coarse.points.col(cell);
  const auto& floor = search.layout.floor;
  return floor && floor->distance(point) < planeTolerance(*floor, point);
}

/// The wall seen between the legs or under an arm is no limb.
bool isWall(const LimbSearch& search, int id) {
  const Component& piece = search.components.pieces[id];
  const auto onWall = [&](const Plane& wall) {
    const auto near = std::count_if(piece.cells.begin(), piece.cells.end(), [&](int cell) {
      const Eigen::Vector3f point = search.coarse.points.col(cell);
      return std::abs(wall.distance(point)) < planeTolerance(wall, point);
    });
    return 2 * near > std::ssize(piece.cells);
  };
  return std::any_of(search.layout.walls.begin(), search.layout.walls.end(), onWall);
}

Contact contactOf(const LimbSearch& search, int id) {
  const CoarseDepth& coarse = search.coarse;
  constexpr float kNear = 0.12F;  // [m]
  Contact contact;
  for (const int cell : search.components.pieces[id].cells) {
    const float z = coarse.depth[cell];
    if (search.personAround[cell] > 0.0F) {
      const float distance = std::abs(search.personAround[cell] - z);
      ++contact.cells;
      contact.joined += distance <= kNear ? 1 : 0;
      contact.distance = std::min(contact.distance, distance);
    }
    forNeighbours(coarse, cell, [&](int n) {
      if (search.components.pieceOfCell[n] == id || search.person[n] != 0)
        return;
      ++contact.border;
      contact.attached += std::abs(coarse.depth[n] - z) <= kNear && !isOnFloor(search, n) ? 1 : 0;
    });
  }
  return contact;
}

bool couldBeLimb(const Component& piece) {
  constexpr float kMaxArea = 0.25F;  // both arms, or a leg [m²]
  constexpr long kMinCells = 3;
  return piece.area <= kMaxArea && std::ssize(piece.cells) >= kMinCells;
}

/// Nothing floats: a small piece beside the person that is part of nothing else is a limb, before
/// the body or half behind it.
bool isLimb(const Contact& contact) {
  constexpr float kArmReach = 0.6F;  // an arm's length [m]
  if (contact.cells == 0 || contact.distance > kArmReach)
    return false;
  const bool floating = 5 * contact.attached <= contact.border;
  const bool joined = 2 * contact.joined >= contact.cells && contact.joined >= 2 &&
                      3 * contact.attached <= contact.border;
  return floating || joined;
}

/// Marks the pieces of a plane that are larger than any person, at least 1 m² and 1 m wide; whether
/// there is one. Planes also cut through several things that merely stand in line.
bool markWall(const CoarseDepth& coarse, const Plane& plane, SceneLayout& layout) {
  constexpr float kMinArea = 1.0F;   // [m²]
  constexpr float kMinWidth = 1.0F;  // [m]
  std::vector<std::uint8_t> onPlane(coarse.size(), 0);
  for (int cell = 0; cell < coarse.size(); ++cell) {
    const Eigen::Vector3f point = coarse.points.col(cell);
    onPlane[cell] = std::abs(plane.distance(point)) <= planeTolerance(plane, point) ? 1 : 0;
  }
  const Eigen::Vector3f along = layout.up.cross(plane.normal).normalized();
  bool marked = false;
  for (const Component& piece : connectedComponents(coarse, onPlane).pieces) {
    if (piece.area < kMinArea || extentAlong(coarse, piece, along) < kMinWidth)
      continue;
    marked = true;
    for (const int cell : piece.cells)
      layout.wallDepth[cell] = coarse.depth[cell];
  }
  return marked;
}

}  // namespace

SceneLayout findLayout(const CoarseDepth& coarse, const std::optional<Eigen::Vector3f>& given) {
  constexpr float kGivenTolerance = 0.1F;  // [rad]
  SceneLayout layout;
  FloorOptions options;
  if (given) {
    options.up = layout.up = *given;
    options.maxTilt = kGivenTolerance;
  }
  const ScenePoints scene = scenePoints(coarse);
  layout.floor = findFloor(scene, options);
  if (layout.floor)
    layout.up = layout.floor->normal;
  layout.wallDepth.assign(coarse.size(), 0.0F);
  for (const Plane& plane : findUprightPlanes(scene, layout.up, layout.floor)) {
    if (markWall(coarse, plane, layout))
      layout.walls.push_back(plane);
  }
  return layout;
}

std::vector<std::uint8_t> offThePlanes(const CoarseDepth& coarse, const SceneLayout& layout) {
  std::vector<std::uint8_t> result(coarse.size(), 0);
  for (int cell = 0; cell < coarse.size(); ++cell) {
    const float z = coarse.depth[cell];
    if (z <= 0.0F)
      continue;
    const Eigen::Vector3f point = coarse.points.col(cell);
    const float wall = layout.wallDepth[cell];
    const bool onFloor =
        layout.floor && layout.floor->distance(point) < planeTolerance(*layout.floor, point);
    const bool onWall = wall > 0.0F && z > wall - 0.02F - 3.0F * depthNoise(z);
    result[cell] = onFloor || onWall ? 0 : 1;
  }
  return result;
}

std::vector<std::uint8_t> findPerson(const CoarseDepth& coarse, const SceneLayout& layout) {
  const Components components = connectedComponents(coarse, offThePlanes(coarse, layout));
  std::vector<std::uint8_t> person(coarse.size(), 0);
  const int best = mostLikelyPiece(coarse, components, layout);
  if (best < 0)
    return person;
  for (const int cell : components.pieces[best].cells)
    person[cell] = 1;
  return withLimbs(coarse, layout, components, std::move(person));
}

std::vector<std::uint8_t> withLimbs(
    const CoarseDepth& coarse,
    const SceneLayout& layout,
    const Components& components,
    std::vector<std::uint8_t> person) {
  constexpr int kRounds = 2;  // a hand before a forearm before the body
  for (int round = 0; round < kRounds; ++round) {
    const LimbSearch search{
        coarse, layout, components, person, depthAround(coarse, person, kPersonReach)};
    std::vector<int> limbs;
    for (int id = 0; id < static_cast<int>(components.pieces.size()); ++id) {
      const Component& piece = components.pieces[id];
      if (person[piece.cells.front()] == 0 && couldBeLimb(piece) && isLimb(contactOf(search, id)) &&
          !isWall(search, id))
        limbs.push_back(id);
    }
    if (limbs.empty())
      break;
    for (const int id : limbs) {
      for (const int cell : components.pieces[id].cells)
        person[cell] = 1;
    }
  }
  return person;
}

}  // namespace simulcap
