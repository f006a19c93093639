#include "src/synthesis/room.h"

#include "avatar/geometry/primitives_mesh.h"
#include "src/synthesis/noise.h"

#include <algorithm>
#include <cmath>

namespace simulcap {
namespace {

constexpr double kWallHeight = 2.8;  // [m]

/// The room as the camera sees it: x to the right, y up, −z away; the origin under the person.
struct RoomFrame {
  Eigen::Isometry3d worldFromRoom = Eigen::Isometry3d::Identity();
  double behind = 0.0;  ///< from the origin to the back wall [m]
  double beside = 0.0;  ///< to the walls at the sides [m]
  double before = 0.0;  ///< to the front end of the floor [m]
};

RoomFrame roomFrame(const Noise& noise, const RoomSpace& space) {
  Eigen::Vector3d origin = space.person.center();
  origin.y() = 0.0;
  Eigen::Vector3d towardsCamera = space.camera - origin;
  towardsCamera.y() = 0.0;
  const double distance = towardsCamera.norm();
  const Eigen::Vector3d z =
      distance > 1e-6 ? Eigen::Vector3d(towardsCamera / distance) : Eigen::Vector3d::UnitZ();
  RoomFrame frame;
  frame.worldFromRoom.linear() << Eigen::Vector3d::UnitY().cross(z), Eigen::Vector3d::UnitY(), z;
  frame.worldFromRoom.translation() = origin;
  const double reach =
      0.5 * Eigen::Vector2d(space.person.sizes().x(), space.person.sizes().z()).norm();
  frame.behind = reach + noise.uniform(0, 0.9, 1.3);
  frame.beside = reach + noise.uniform(1, 1.3, 1.9);
  frame.before = std::max(distance, reach) + 1.0;
  return frame;
}

RoomThing thing(
    const RoomFrame& frame,
    const avatar::TriangleMesh& mesh,
    const Eigen::Isometry3d& roomFromThing,
    const SolidPattern& pattern) {
  return {{frame.worldFromRoom * (roomFromThing * mesh.vertices), mesh.faces}, pattern};
}

SolidPattern mottled(const Noise& noise, std::uint64_t index) {
  SolidPattern pattern;
  pattern.kind = SolidPattern::Kind::kSpeckles;
  const double tone = noise.uniform(10 * index, 0.45, 0.75);
  pattern.first =
      tone *
      Eigen::Vector3d(
          1.0, noise.uniform(10 * index + 1, 0.85, 1.0), noise.uniform(10 * index + 2, 0.7, 1.0));
  pattern.second = 0.85 * pattern.first;
  pattern.period = noise.uniform(10 * index + 3, 0.03, 0.25);
  pattern.seed = static_cast<std::uint32_t>(index);
  return pattern;
}

void addShell(Room& room, const RoomFrame& frame, const Noise& noise) {
  // Thick boxes rather than sheets: they can't be looked at from behind.
  constexpr double kThickness = 0.1;
  const double depth = frame.behind + frame.before;
  const double middle = 0.5 * (frame.before - frame.behind);
  const auto addBox = [&](const Eigen::Vector3d& size, const Eigen::Vector3d& center) {
    const Eigen::Isometry3d pose(Eigen::Translation3d{center});
    room.things.push_back(
        thing(frame, avatar::boxMesh(size), pose, mottled(noise, 10 + room.things.size())));
  };
  const double half = 0.5 * kThickness;
  addBox({2.0 * frame.beside, kThickness, depth}, {0.0, -half, middle});
  addBox(
      {2.0 * frame.beside, kWallHeight, kThickness},
      {0.0, 0.5 * kWallHeight, -frame.behind - half});
  for (const double side : {-1.0, 1.0})
    addBox(
        {kThickness, kWallHeight, depth},
        {side * (frame.beside + half), 0.5 * kWallHeight, middle});
}

void addClutter(Room& room, const RoomFrame& frame, const Noise& noise) {
  constexpr std::uint64_t kThings = 7;
  for (std::uint64_t i = 0; i < kThings; ++i) {
    const Noise own({static_cast<std::uint64_t>(1e9 * noise.uniform(50 + i)), i});
    const Eigen::Vector3d size(
        own.uniform(0, 0.2, 0.6), own.uniform(1, 0.2, 1.3), own.uniform(2, 0.2, 0.45));
    const double reach = 0.5 * std::hypot(size.x(), size.z());
    // Along the back wall, or beside at the walls of the sides.
    const bool atBack = i % 3 != 2;
    const double along = own.uniform(3, -1.0, 1.0);
    Eigen::Vector3d center(along * (frame.beside - reach), 0.5 * size.y(), -frame.behind + reach);
    if (!atBack)
      center = {
          (along < 0.0 ? -1.0 : 1.0) * (frame.beside - reach),
          0.5 * size.y(),
          -0.4 * frame.behind * own.uniform(4)};
    Eigen::Isometry3d pose(Eigen::Translation3d{center});
    pose.rotate(Eigen::AngleAxisd(own.uniform(5, -0.6, 0.6), Eigen::Vector3d::UnitY()));
    const double radius = 0.5 * std::min(size.x(), size.z());
    const bool column = i % 4 == 3 && size.y() > 2.5 * radius;
    const avatar::TriangleMesh mesh =
        column ? avatar::capsuleMesh(radius, size.y() - 2.0 * radius, 0.25 * radius)
               : avatar::boxMesh(size);
    SolidPattern pattern =
        clothPattern(static_cast<std::uint32_t>(97 + i), static_cast<std::uint32_t>(i));
    pattern.period *= 2.0;
    room.things.push_back(thing(frame, mesh, pose, pattern));
  }
}

}  // namespace

Room makeRoom(std::uint32_t seed, const RoomSpace& space) {
  const Noise noise({seed, 0x400e});
  const RoomFrame frame = roomFrame(noise, space);
  Room room;
  addShell(room, frame, noise);
  addClutter(room, frame, noise);
  for (std::uint64_t i = 0; i < 2; ++i)
    room.lights.push_back(
        frame.worldFromRoom * Eigen::Vector3d(
                                  (i == 0 ? -1.0 : 1.0) * noise.uniform(80 + i, 0.5, 1.5),
                                  noise.uniform(90 + i, 2.3, 2.7),
                                  noise.uniform(100 + i, 0.8, 2.0)));
  return room;
}

}  // namespace simulcap
