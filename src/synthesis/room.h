#pragma once

#include "avatar/geometry/mesh.h"
#include "src/synthesis/surface_color.h"

#include <Eigen/Geometry>

#include <cstdint>
#include <vector>

namespace simulcap {

/// A thing that stands still, in the world [m].
struct RoomThing {
  avatar::TriangleMesh mesh;
  SolidPattern pattern;
};

struct Room {
  std::vector<RoomThing> things;        ///< floor and walls, then what stands about
  std::vector<Eigen::Vector3d> lights;  ///< positions in the world [m]
};

/// What a room must leave free.
struct RoomSpace {
  Eigen::AlignedBox3d person;  ///< everything that the person ever touches [m]
  Eigen::Vector3d camera = Eigen::Vector3d::Zero();  ///< [m]
};

/// A floor at y = 0, three walls behind and beside the person as the camera sees them, and boxes
/// and columns at the walls. Nothing stands between the camera and the person.
Room makeRoom(std::uint32_t seed, const RoomSpace& space);

}  // namespace simulcap
